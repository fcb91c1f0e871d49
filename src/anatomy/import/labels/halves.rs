//! A bony mask cut at its midsagittal plane.

use crate::geometry::{Point, Vector};
use crate::volume::Volume;

/// Rounds until the plane stays.
const MAX_ROUNDS: usize = 50;

/// The two halves differ by less than this part of the larger one, or there is no pair in the mask.
const LEAST_HALF: f64 = 0.7;

/// The plane between the halves of a mask that is nearly its own mirror image: through the midpoint
/// of their centroids, at right angles to the line through them. Both follow from each other, from
/// `left`, a direction to the patient's left.
///
/// Returns a point of the plane and its normal, to the left, or `None` where the halves are too
/// unequal to be a pair.
pub(super) fn midsagittal(mask: &Volume<bool>, left: Vector) -> Option<(Point, Vector)> {
    let grid = &mask.grid;
    let points: Vec<Point> = (0..mask.data.len())
        .filter(|&o| mask.data[o])
        .map(|o| grid.center(grid.voxel(o)))
        .collect();
    let mean = |sum: Vector, n: usize| sum / n.max(1) as f64;
    let all: Vector = points.iter().map(|p| p.coords).sum();
    let mut plane = (Point::from(mean(all, points.len())), left);
    for _ in 0..MAX_ROUNDS {
        let mut sums = [Vector::zeros(); 2];
        let mut counts = [0usize; 2];
        for p in &points {
            let half = usize::from((p - plane.0).dot(&plane.1) < 0.0);
            sums[half] += p.coords;
            counts[half] += 1;
        }
        let [l, r] = [0, 1].map(|half| mean(sums[half], counts[half]));
        let next = (Point::from((l + r) / 2.0), (l - r).try_normalize(1.0)?);
        let settled = (next.0 - plane.0).norm() < 1e-6 && (next.1 - plane.1).norm() < 1e-9;
        plane = next;
        if settled {
            let (less, more) = (counts[0].min(counts[1]), counts[0].max(counts[1]));
            return (less as f64 >= LEAST_HALF * more as f64).then_some(plane);
        }
    }
    None
}

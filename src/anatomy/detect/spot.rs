//! A place found by rule, and how well the rule pins it down.
//!
//! A single extreme vertex wanders by millimetres along a blunt end from one reconstruction of the same bone to
//! the next. A place is therefore the middle of all bone that comes near the extreme, the nearer the more
//! it counts, each vertex for the area it stands for.

use crate::geometry::{Point, Ray, Vector};
use crate::volume::Surface;

/// Bone that comes to within this of a criterion's extreme might as well have been taken (mm): a
/// voxel of a good CT, and more than the noise of its surface.
pub(super) const FLAT_MM: f64 = 1.0;

/// How far below its foremost vertex the bone of a tip counts (mm). On six people's pelves places move by 0.2
/// mm in the mean (0.5 at most) between surfaces and 1 mm voxels; with 1 mm twice as far, with 3 mm hardly less,
/// and away from where raters see a tubercle (`docs/specimens.md`).
pub(super) const TIP_MM: f64 = 2.0;

/// A place found by rule.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub point: Point,
    /// Root mean square distance to the places that meet the rule to within [`FLAT_MM`].
    pub flat_mm: f64,
}

impl Spot {
    /// A place among places (each with a weight) that meet the rule to within [`FLAT_MM`].
    pub fn among(point: Point, as_good: impl Iterator<Item = (Point, f64)>) -> Self {
        let (mut sum, mut total) = (0.0, 0.0);
        for (other, weight) in as_good {
            sum += weight * (other - point).norm_squared();
            total += weight;
        }
        let flat_mm = if total > 0.0 {
            (sum / total).sqrt()
        } else {
            0.0
        };
        Self { point, flat_mm }
    }
}

/// The end of a bone in one direction.
#[derive(Debug)]
pub(super) struct Tip {
    /// The vertex that reaches farthest.
    pub foremost: usize,
    /// The tip's middle, on the surface.
    pub spot: Spot,
}

/// The tip of a bone in a direction (world, unit) among the vertices that `eligible` admits; `None` without any.
pub(super) fn tip(
    surface: &Surface,
    direction: &Vector,
    eligible: impl Fn(&Point) -> bool,
) -> Option<Tip> {
    let vertices = surface.vertices();
    let reach = |v: usize| vertices[v].coords.dot(direction);
    let inside: Vec<usize> = (0..vertices.len())
        .filter(|&v| eligible(&vertices[v]))
        .collect();
    // Of equal ones the first.
    let order = |a: &&usize, b: &&usize| reach(**a).total_cmp(&reach(**b));
    let &foremost = inside.iter().rev().max_by(order)?;
    let areas = surface.vertex_areas();
    let short_by = |v: usize| reach(foremost) - reach(v);
    let middle = middle(inside.iter().map(|&v| {
        let weight = areas[v] * nearness(short_by(v), TIP_MM);
        (vertices[v].coords, weight)
    }));
    let middle = middle.map_or(vertices[foremost], Point::from);
    let point = outward(surface, &middle, direction)?;
    let as_far = inside.iter().filter(|&&v| short_by(v) <= FLAT_MM);
    let as_far = as_far.map(|&v| (vertices[v], areas[v]));
    Some(Tip {
        foremost,
        spot: Spot::among(point, as_far),
    })
}

/// How much counts what falls short of an extreme: 1 at the extreme, falling to 0 at a depth.
pub(super) fn nearness(short_by: f64, depth: f64) -> f64 {
    (1.0 - short_by / depth).clamp(0.0, 1.0)
}

/// Weighted mean; `None` where nothing has a weight.
pub(super) fn middle<const D: usize>(
    parts: impl Iterator<Item = (nalgebra::SVector<f64, D>, f64)>,
) -> Option<nalgebra::SVector<f64, D>> {
    let (mut sum, mut total) = (nalgebra::SVector::zeros(), 0.0);
    for (at, weight) in parts {
        sum += at * weight;
        total += weight;
    }
    (total > 0.0).then(|| sum / total)
}

/// Where a line from within the bone leaves it; from a point outside, the nearest point of the surface.
pub(super) fn outward(surface: &Surface, from: &Point, direction: &Vector) -> Option<Point> {
    let ray = Ray {
        origin: *from,
        direction: *direction,
    };
    let first = surface.intersections(&ray).first().copied();
    match first.filter(|hit| !hit.entering) {
        Some(hit) => Some(ray.at(hit.t)),
        None => surface.closest_point(from).map(|(point, _)| point),
    }
}

/// The root of the mean of squares; 0 of none.
pub(super) fn rms(squares: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for square in squares {
        sum += square;
        count += 1;
    }
    (sum / count.max(1) as f64).sqrt()
}

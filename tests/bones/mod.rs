//! Bones as masks, and as the surfaces that thick slices of them leave.

// Each test program uses a part.
#![allow(dead_code)]

use nalgebra::Matrix3;
use pao_sim::anatomy::detect::{BoneSurfaces, Detected};
use pao_sim::anatomy::{Landmark, Side};
use pao_sim::geometry::{Point, Ray, Vector};
use pao_sim::volume::{Grid, Surface, Volume};

/// Masks of sacrum, left and right hip bone, left and right femur.
pub type Masks = [Volume<bool>; 5];

/// Surfaces of the masks, each slice the majority of `thickness` slices.
pub fn surfaces(masks: &Masks, thickness: usize) -> BoneSurfaces {
    let of = |n: usize| {
        let mask = thick(&masks[n], thickness);
        Surface::from_mask(&mask, |inside| inside, &Default::default())
    };
    BoneSurfaces {
        sacrum: of(0),
        hips: [of(1), of(2)],
        femurs: [of(3), of(4)],
    }
}

fn thick(mask: &Volume<bool>, thickness: usize) -> Volume<bool> {
    let slice = mask.grid.dims[0] * mask.grid.dims[1];
    let mut grid = mask.grid.clone();
    grid.origin = grid.point(0.0, 0.0, (thickness as f64 - 1.0) / 2.0);
    grid.dims[2] /= thickness;
    grid.spacing[2] *= thickness as f64;
    let data = (0..grid.len())
        .map(|offset| {
            let (k, in_slice) = (offset / slice, offset % slice);
            let inside = (k * thickness..(k + 1) * thickness)
                .filter(|k| mask.data[k * slice + in_slice])
                .count();
            2 * inside >= thickness
        })
        .collect();
    Volume::new(grid, data)
}

/// Masks of closed surfaces with voxels of 1 mm. The femora end 170 mm below their tops.
pub fn voxelized(bones: &BoneSurfaces) -> Masks {
    let femur = |side: Side| {
        let surface = bones.femur(side);
        let top = surface
            .vertices()
            .iter()
            .map(|p| p.z)
            .fold(f64::MIN, f64::max);
        mask(surface, top - 170.0)
    };
    [
        mask(&bones.sacrum, f64::MIN),
        mask(bones.hip(Side::Left), f64::MIN),
        mask(bones.hip(Side::Right), f64::MIN),
        femur(Side::Left),
        femur(Side::Right),
    ]
}

/// Each column of voxels is filled between where a line along z enters and leaves.
fn mask(surface: &Surface, lowest: f64) -> Volume<bool> {
    let first = *surface.vertices().first().expect("the bone has vertices");
    let (mut low, mut high) = (first, first);
    for p in surface.vertices() {
        low = low.inf(p);
        high = high.sup(p);
    }
    low.z = low.z.max(lowest);
    // Off the vertices' own round coordinates.
    let low = low - Vector::new(4.0137, 4.0291, 4.0);
    let dims = std::array::from_fn(|a| (high[a] - low[a]) as usize + 9);
    let grid = Grid::axis_aligned(dims, 1.0, low);
    let mut mask = Volume::filled(grid.clone(), false);
    for j in 0..dims[1] {
        for i in 0..dims[0] {
            let below = grid.center([i, j, 0]) - Vector::z() * 1000.0;
            let hits = surface.intersections(&Ray {
                origin: below,
                direction: Vector::z(),
            });
            let mut inside = 0;
            let mut next = hits.iter().peekable();
            for k in 0..dims[2] {
                while let Some(hit) = next.next_if(|hit| hit.t <= 1000.0 + k as f64) {
                    inside += if hit.entering { 1 } else { -1 };
                }
                mask.data[grid.offset(i, j, k)] = inside > 0;
            }
        }
    }
    mask
}

/// Distance (mm) of each landmark of the left from its right partner, after the mirror image of the
/// right ones was fitted to the left ones (least squares, rotation and translation), by
/// [`Landmark::ALL`].
pub fn asymmetry(found: &Detected) -> Vec<f64> {
    let at = |side: Side| -> Vec<Vector> {
        Landmark::ALL
            .into_iter()
            .map(|landmark| found.landmarks.get(landmark, side).unwrap().coords)
            .collect()
    };
    // Both sides at once, so that the mirror's plane is the pelvis' own.
    let (left, right) = (at(Side::Left), at(Side::Right));
    let flip = |v: &Vector| Vector::new(-v.x, v.y, v.z);
    let fixed: Vec<Vector> = left.iter().chain(&right).copied().collect();
    let moving: Vec<Vector> = right.iter().chain(&left).map(flip).collect();
    let n = fixed.len() as f64;
    let (a, b) = (
        fixed.iter().sum::<Vector>() / n,
        moving.iter().sum::<Vector>() / n,
    );
    let spread: Matrix3<f64> = fixed
        .iter()
        .zip(&moving)
        .map(|(f, m)| (f - a) * (m - b).transpose())
        .sum();
    let svd = spread.svd(true, true);
    let (u, vt) = (svd.u.unwrap(), svd.v_t.unwrap());
    let sign = (u * vt).determinant();
    let rotation = u * Matrix3::from_diagonal(&Vector::new(1.0, 1.0, sign)) * vt;
    fixed
        .iter()
        .zip(&moving)
        .take(left.len())
        .map(|(f, m)| (f - a - rotation * (m - b)).norm())
        .collect()
}

/// Spearman's rank correlation.
pub fn rank_correlation(a: &[f64], b: &[f64]) -> f64 {
    let ranks = |values: &[f64]| -> Vec<f64> {
        values
            .iter()
            .map(|v| {
                let below = values.iter().filter(|w| *w < v).count();
                let equal = values.iter().filter(|w| *w == v).count();
                below as f64 + (equal as f64 - 1.0) / 2.0
            })
            .collect()
    };
    let (a, b) = (ranks(a), ranks(b));
    let middle = (a.len() as f64 - 1.0) / 2.0;
    let sum = |x: &[f64], y: &[f64]| -> f64 {
        x.iter()
            .zip(y)
            .map(|(p, q)| (p - middle) * (q - middle))
            .sum()
    };
    sum(&a, &b) / (sum(&a, &a) * sum(&b, &b)).sqrt()
}

/// Mean and greatest distance (mm) of points from the nearest vertices of a line.
pub fn apart(points: &[Point], line: &[Point]) -> (f64, f64) {
    let distances = points.iter().map(|p| {
        let nearest = line.iter().map(|q| (q - p).norm());
        nearest.fold(f64::MAX, f64::min)
    });
    let (sum, most) = distances.fold((0.0, 0.0f64), |(sum, most), d| (sum + d, most.max(d)));
    (sum / points.len() as f64, most)
}

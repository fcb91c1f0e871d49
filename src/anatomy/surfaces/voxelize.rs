//! Which voxels lie inside a closed surface.

use crate::geometry::Point;
use crate::volume::{Grid, Surface};
use std::cmp::Ordering;

/// Coordinates are rounded to multiples of 2^-20 mm, far below any surface's accuracy, so that
/// every decision about a line and a triangle is made in integers, exactly.
const UNITS_PER_MM: f64 = (1u64 << 20) as f64;

/// A position in the plane across the scanlines, in units.
type Flat = [i64; 2];

/// Calls `inside(offset)` for every voxel of an axis-aligned grid whose centre lies inside the
/// closed surface.
///
/// Each row of voxels along i is one line; the surface's crossings with it are summed with their
/// direction (winding number), so overlapping parts of a surface count as inside. A line through an
/// edge or a vertex is decided as if it ran infinitesimally beside it, the same way for all
/// triangles (simulation of simplicity, Edelsbrunner and Muecke 1990): a closed surface is left as
/// often as it is entered, on every row.
///
/// # Panics
/// When the grid's axes are not the world's.
pub(super) fn for_each_inside(surface: &Surface, grid: &Grid, mut inside: impl FnMut(usize)) {
    assert_eq!(
        grid.direction,
        nalgebra::Matrix3::identity(),
        "rows must run along the world's x"
    );
    let [ni, nj, nk] = grid.dims;
    let row_at = |j: usize, k: usize| -> Flat {
        let p = grid.center([0, j, k]);
        [units(p.y), units(p.z)]
    };
    // (x in mm, +1 where the line enters the surface, -1 where it leaves) of each row.
    let mut crossings: Vec<Vec<(f64, i32)>> = vec![Vec::new(); nj * nk];
    for triangle in 0..surface.triangles().len() {
        let corners = surface.corners(triangle);
        let flat = corners.map(|p| [units(p.y), units(p.z)]);
        let rows = |axis: usize, count: usize| {
            let values =
                corners.map(|p| (p[axis + 1] - grid.origin[axis + 1]) / grid.spacing[axis + 1]);
            let low = values.iter().copied().fold(f64::MAX, f64::min) - 1e-3;
            let high = values.iter().copied().fold(f64::MIN, f64::max) + 1e-3;
            let first = low.ceil().max(0.0) as usize;
            let last = (high.floor() + 1.0).clamp(0.0, count as f64) as usize;
            first..last.max(first)
        };
        for k in rows(1, nk) {
            for j in rows(0, nj) {
                let at = row_at(j, k);
                if let Some(direction) = crossing(&flat, &at) {
                    crossings[k * nj + j]
                        .push((meeting(&corners, &grid.center([0, j, k])), direction));
                }
            }
        }
    }
    for (row, crossings) in crossings.iter_mut().enumerate() {
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut next = 0;
        let mut winding = 0;
        if crossings.is_empty() {
            continue;
        }
        for i in 0..ni {
            let x = grid.origin.x + i as f64 * grid.spacing[0];
            while next < crossings.len() && crossings[next].0 <= x {
                winding += crossings[next].1;
                next += 1;
            }
            if winding != 0 {
                inside(row * ni + i);
            }
        }
    }
}

fn units(mm: f64) -> i64 {
    (mm * UNITS_PER_MM).round() as i64
}

/// +1 where a line along +x through `at` enters the surface by this triangle, -1 where it leaves,
/// `None` where it passes by.
fn crossing(corners: &[Flat; 3], at: &Flat) -> Option<i32> {
    let side = |a: usize, b: usize| turn(&corners[a], &corners[b], at);
    let first = side(0, 1);
    if first == Ordering::Equal || first != side(1, 2) || first != side(2, 0) {
        return None;
    }
    // Anticlockwise in (y, z) means a normal along +x: the line leaves.
    Some(if first == Ordering::Greater { -1 } else { 1 })
}

/// On which side of the line from `a` to `b` the point lies: greater on the left. A point on the
/// line is moved by an infinitesimal step along the first axis and a far smaller one along the
/// second; equal only for a line without length.
fn turn(a: &Flat, b: &Flat, p: &Flat) -> Ordering {
    let wide = |v: i64| i128::from(v);
    let (dy, dz) = (wide(b[0] - a[0]), wide(b[1] - a[1]));
    let determinant = dy * wide(p[1] - a[1]) - dz * wide(p[0] - a[0]);
    determinant.cmp(&0).then(0.cmp(&dz)).then(dy.cmp(&0))
}

/// Where the line along x through `at` meets the triangle's plane. The line crosses the triangle,
/// so the value is kept within its corners, also where it is seen edge-on.
fn meeting(corners: &[Point; 3], at: &Point) -> f64 {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a));
    let low = a.x.min(b.x).min(c.x);
    let high = a.x.max(b.x).max(c.x);
    let x = a.x - (normal.y * (at.y - a.y) + normal.z * (at.z - a.z)) / normal.x;
    if x.is_nan() { low } else { x.clamp(low, high) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector;
    use crate::volume::surface_block::block;
    use crate::volume::{SurfaceParameters, Volume};

    fn filled(surface: &Surface, grid: &Grid) -> Vec<bool> {
        let mut mask = vec![false; grid.len()];
        for_each_inside(surface, grid, |offset| mask[offset] = true);
        mask
    }

    /// A box whose faces, edges and diagonals pass exactly through rows of voxel centres.
    fn cuboid(low: [f64; 3], high: [f64; 3]) -> Surface {
        let (vertices, triangles) = block(&low.into(), &high.into());
        Surface::new(vertices, triangles)
    }

    #[test]
    fn a_box_through_voxel_centres_is_half_open_and_exact() {
        let grid = Grid::axis_aligned([12, 12, 12], 1.0, Point::new(-5.0, -5.0, -5.0));
        let mask = filled(&cuboid([-2.0, -3.0, -1.0], [2.0, 1.0, 3.0]), &grid);
        // Every axis spans four voxels: neither more, for both faces, nor fewer, for none.
        assert_eq!(mask.iter().filter(|&&v| v).count(), 64);
        // Two boxes that share a face share no voxel and leave none out.
        let upper = filled(&cuboid([-2.0, -3.0, 3.0], [2.0, 1.0, 5.0]), &grid);
        assert!(mask.iter().zip(&upper).all(|(a, b)| !(a & b)));
        let whole = filled(&cuboid([-2.0, -3.0, -1.0], [2.0, 1.0, 5.0]), &grid);
        assert!((0..grid.len()).all(|o| whole[o] == (mask[o] | upper[o])));
    }

    #[test]
    fn half_voxels_count_as_they_should() {
        let grid = Grid::axis_aligned([6, 6, 6], 2.0, Point::new(0.0, 0.0, 0.0));
        let mask = filled(&cuboid([3.1, 3.1, 3.1], [6.1, 8.1, 5.9]), &grid);
        // Centres at 4, 6 | 4, 6, 8 | 4.
        let expected: Vec<usize> = [4, 6, 8]
            .iter()
            .flat_map(|&y| [4, 6].map(|x| grid.offset(x / 2, y / 2, 2)))
            .collect();
        let found: Vec<usize> = (0..grid.len()).filter(|&o| mask[o]).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn the_surface_of_a_mask_gives_the_mask_back() {
        let grid = Grid::axis_aligned([40, 36, 44], 1.0, Point::new(-20.0, 7.0, 100.0));
        let center = grid.point(19.4, 17.7, 21.2);
        let data = (0..grid.len())
            .map(|o| {
                let d = grid.center(grid.voxel(o)) - center;
                let ring = (d.x * d.x + d.y * d.y).sqrt() - 10.0;
                u8::from(ring * ring + d.z * d.z < 25.0)
            })
            .collect();
        let mask = Volume::new(grid.clone(), data);
        let parameters = SurfaceParameters {
            smoothing_voxels: 0.0,
            ..Default::default()
        };
        let surface = Surface::from_mask(&mask, |v| v == 1, &parameters);
        let back = filled(&surface, &grid);
        assert!((0..grid.len()).all(|o| back[o] == (mask.data[o] == 1)));
    }

    #[test]
    fn the_volume_of_a_ball_is_right_and_agrees_with_rays() {
        let grid = Grid::axis_aligned([50, 50, 50], 1.0, Point::new(0.0, 0.0, 0.0));
        let center = Point::new(24.3, 25.1, 24.8);
        let ball: Vec<u8> = (0..grid.len())
            .map(|o| u8::from((grid.center(grid.voxel(o)) - center).norm() < 20.0))
            .collect();
        let surface = Surface::from_mask(&Volume::new(grid, ball), |v| v == 1, &Default::default());
        // Of grids at 4 x 4 x 4 places within a voxel: one alone scatters by a thousandth (SD) about
        // the surface's volume, and this one by three.
        let ratios: Vec<f64> = (0..64)
            .map(|n| {
                let shift = [n % 4, n / 4 % 4, n / 16].map(|n| 0.83 / 4.0 * f64::from(n));
                let origin = Point::new(0.11 + shift[0], 0.07 + shift[1], 0.05 + shift[2]);
                let mask = filled(&surface, &Grid::axis_aligned([60, 60, 60], 0.83, origin));
                let voxels = mask.iter().filter(|&&v| v).count();
                voxels as f64 * 0.83_f64.powi(3) / surface.volume()
            })
            .collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        assert!((mean - 1.0).abs() < 3e-4, "ratio {mean}");
        let fine = Grid::axis_aligned([60, 60, 60], 0.83, Point::new(0.11, 0.07, 0.05));
        let mask = filled(&surface, &fine);
        for offset in (0..fine.len()).step_by(997) {
            let p = fine.center(fine.voxel(offset));
            if ((p - center).norm() - 20.0).abs() > 1.0 {
                assert_eq!(mask[offset], surface.contains(&p), "{p:?}");
            }
        }
    }

    #[test]
    fn overlapping_parts_are_inside() {
        let grid = Grid::axis_aligned([12, 8, 8], 1.0, Point::new(0.3, 0.2, 0.1));
        let a = cuboid([1.0, 1.0, 1.0], [6.0, 6.0, 6.0]);
        let b = a.transformed(&crate::geometry::Rigid::new(
            Vector::x() * 3.0,
            Vector::zeros(),
        ));
        let mut vertices = a.vertices().to_vec();
        vertices.extend(b.vertices());
        let mut triangles = a.triangles().to_vec();
        triangles.extend(b.triangles().iter().map(|t| t.map(|v| v + 8)));
        let both = filled(&Surface::new(vertices, triangles), &grid);
        let (one, two) = (filled(&a, &grid), filled(&b, &grid));
        assert!((0..grid.len()).all(|o| both[o] == (one[o] | two[o])));
    }
}

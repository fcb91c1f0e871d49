//! Distances of voxels from a surface they lie near.

use crate::volume::surface_query::closest_on_triangle;
use crate::volume::{Grid, Surface};
use rayon::prelude::*;

/// Exact distances of a grid's voxel centres from a surface, in a box of voxels around it.
pub(super) struct NearSurface {
    min: [usize; 3],
    dims: [usize; 3],
    /// mm; infinite beyond the reach.
    distance: Vec<f32>,
}

/// Distances up to `reach_mm` from an axis-aligned grid's voxel centres to `surface`. Each
/// triangle visits the voxels around it, which is far quicker than asking for every voxel's closest
/// triangle. Slices are independent, so the result does not depend on threads.
pub(super) fn near_surface(surface: &Surface, grid: &Grid, reach_mm: f64) -> NearSurface {
    let range = |low: f64, high: f64, axis: usize| {
        let index = |mm: f64| (mm - grid.origin[axis]) / grid.spacing[axis];
        let first = (index(low - reach_mm).ceil()).max(0.0) as usize;
        let end = (index(high + reach_mm).floor() + 1.0).clamp(0.0, grid.dims[axis] as f64);
        first..(end as usize).max(first)
    };
    let extent = |triangle: usize, axis: usize| {
        let values = surface.corners(triangle).map(|p| p[axis]);
        let low = values.into_iter().fold(f64::MAX, f64::min);
        let high = values.into_iter().fold(f64::MIN, f64::max);
        range(low, high, axis)
    };
    let whole: [std::ops::Range<usize>; 3] = std::array::from_fn(|axis| {
        let values = surface.vertices().iter().map(|p| p[axis]);
        let low = values.clone().fold(f64::MAX, f64::min);
        range(low, values.fold(f64::MIN, f64::max), axis)
    });
    let min = [whole[0].start, whole[1].start, whole[2].start];
    let dims = [whole[0].len(), whole[1].len(), whole[2].len()];
    let mut of_slice: Vec<Vec<usize>> = vec![Vec::new(); dims[2]];
    for triangle in 0..surface.triangles().len() {
        for k in extent(triangle, 2) {
            of_slice[k - min[2]].push(triangle);
        }
    }
    let mut distance = vec![f32::INFINITY; dims.iter().product()];
    if distance.is_empty() {
        return NearSurface {
            min,
            dims,
            distance,
        };
    }
    distance
        .par_chunks_mut(dims[0] * dims[1])
        .zip(of_slice)
        .enumerate()
        .for_each(|(slice, (values, triangles))| {
            for triangle in triangles {
                let corners = surface.corners(triangle);
                for j in extent(triangle, 1) {
                    for i in extent(triangle, 0) {
                        let p = grid.center([i, j, slice + min[2]]);
                        let d = (closest_on_triangle(&p, &corners) - p).norm();
                        let at = (j - min[1]) * dims[0] + i - min[0];
                        if d <= reach_mm && (d as f32) < values[at] {
                            values[at] = d as f32;
                        }
                    }
                }
            }
        });
    NearSurface {
        min,
        dims,
        distance,
    }
}

impl NearSurface {
    /// Each voxel of the box (i, j, k of the grid) with its distance (mm), infinite beyond the
    /// reach, in the order of memory.
    pub fn voxels(&self) -> impl IndexedParallelIterator<Item = ([usize; 3], f32)> + '_ {
        let [ni, nj, _] = self.dims;
        let [i, j, k] = self.min;
        let place = move |n: usize| [i + n % ni, j + n / ni % nj, k + n / (ni * nj)];
        self.distance
            .par_iter()
            .enumerate()
            .map(move |(n, &d)| (place(n), d))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::volume::Volume;

    #[test]
    fn distances_are_those_of_the_closest_points() {
        let grid = Grid::axis_aligned([40, 38, 36], 1.0, Point::new(-20.0, 3.0, 100.0));
        let center = grid.point(19.4, 18.7, 17.2);
        let ball = (0..grid.len())
            .map(|o| u8::from((grid.center(grid.voxel(o)) - center).norm() < 12.0))
            .collect();
        let surface = Surface::from_mask(
            &Volume::new(grid.clone(), ball),
            |v| v == 1,
            &Default::default(),
        );
        let mut seen = 0;
        let near: Vec<_> = near_surface(&surface, &grid, 3.0).voxels().collect();
        for (voxel, d) in near {
            let p = grid.center(voxel);
            let expected = (surface.closest_point(&p).unwrap().0 - p).norm();
            if expected < 2.999 {
                assert!((f64::from(d) - expected).abs() < 1e-5, "{voxel:?}");
                seen += 1;
            } else if expected > 3.001 {
                assert!(d.is_infinite(), "{voxel:?}");
            }
        }
        // A shell of 6 mm about a ball of 12 mm holds some 10900 voxels.
        assert!((10_000..12_000).contains(&seen), "{seen}");
    }
}

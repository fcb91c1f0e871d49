//! A grid's geometry and a grid of values.

use crate::geometry::{Point, Vector};
use nalgebra::{Affine3, Matrix3, Matrix4};

/// Where the voxels of a volume lie in the world (LPS, mm). Voxel (i, j, k) is the CENTRE of a
/// voxel; i varies fastest in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Number of voxels along i, j, k.
    pub dims: [usize; 3],
    /// Distance of neighbouring voxel centres along i, j, k in mm.
    pub spacing: [f64; 3],
    /// World position of the centre of voxel (0, 0, 0).
    pub origin: Point,
    /// Columns are the world directions (unit, orthogonal) of the axes i, j, k.
    pub direction: Matrix3<f64>,
}

impl Grid {
    /// A grid along the world's axes with cubic voxels.
    pub fn axis_aligned(dims: [usize; 3], spacing_mm: f64, origin: Point) -> Self {
        Self {
            dims,
            spacing: [spacing_mm; 3],
            origin,
            direction: Matrix3::identity(),
        }
    }

    /// Number of voxels.
    pub fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// True for a grid without voxels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position in memory of voxel (i, j, k).
    #[inline]
    pub fn offset(&self, i: usize, j: usize, k: usize) -> usize {
        (k * self.dims[1] + j) * self.dims[0] + i
    }

    /// The voxel (i, j, k) at a position in memory.
    #[inline]
    pub fn voxel(&self, offset: usize) -> [usize; 3] {
        let i = offset % self.dims[0];
        let rest = offset / self.dims[0];
        [i, rest % self.dims[1], rest / self.dims[1]]
    }

    /// World position (LPS, mm) of a continuous index.
    #[inline]
    pub fn point(&self, i: f64, j: f64, k: f64) -> Point {
        self.origin
            + self.direction
                * Vector::new(
                    i * self.spacing[0],
                    j * self.spacing[1],
                    k * self.spacing[2],
                )
    }

    /// World position of a voxel's centre.
    pub fn center(&self, voxel: [usize; 3]) -> Point {
        self.point(voxel[0] as f64, voxel[1] as f64, voxel[2] as f64)
    }

    /// Continuous index of a world position.
    #[inline]
    pub fn index(&self, point: &Point) -> Vector {
        let local = self.direction.transpose() * (point - self.origin);
        Vector::new(
            local.x / self.spacing[0],
            local.y / self.spacing[1],
            local.z / self.spacing[2],
        )
    }

    /// The nearest voxel to a world position, or `None` outside the grid.
    pub fn nearest(&self, point: &Point) -> Option<[usize; 3]> {
        let index = self.index(point);
        let mut voxel = [0; 3];
        for axis in 0..3 {
            let rounded = (index[axis] + 0.5).floor();
            if !(rounded >= 0.0 && rounded < self.dims[axis] as f64) {
                return None;
            }
            voxel[axis] = rounded as usize;
        }
        Some(voxel)
    }

    /// Maps world points to continuous indices.
    pub fn index_from_world(&self) -> Affine3<f64> {
        self.world_from_index().inverse()
    }

    /// Maps continuous indices to world points.
    pub fn world_from_index(&self) -> Affine3<f64> {
        let scale = Matrix3::from_diagonal(&Vector::from(self.spacing));
        let mut m = Matrix4::identity();
        m.fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&(self.direction * scale));
        m.fixed_view_mut::<3, 1>(0, 3)
            .copy_from(&self.origin.coords);
        Affine3::from_matrix_unchecked(m)
    }

    /// The grid of the voxels `min..=max` of this one.
    ///
    /// # Panics
    /// When the range is empty or leaves the grid.
    pub fn cropped(&self, min: [usize; 3], max: [usize; 3]) -> Self {
        assert!((0..3).all(|a| min[a] <= max[a] && max[a] < self.dims[a]));
        Self {
            dims: std::array::from_fn(|a| max[a] - min[a] + 1),
            origin: self.center(min),
            ..self.clone()
        }
    }
}

/// Values on a [`Grid`].
#[derive(Clone, Debug, PartialEq)]
pub struct Volume<T> {
    pub grid: Grid,
    /// `grid.len()` values, i fastest.
    pub data: Vec<T>,
}

impl<T: Copy> Volume<T> {
    /// A volume of one value.
    pub fn filled(grid: Grid, value: T) -> Self {
        let data = vec![value; grid.len()];
        Self { grid, data }
    }

    /// A volume of given values.
    ///
    /// # Panics
    /// When their number is not the grid's.
    pub fn new(grid: Grid, data: Vec<T>) -> Self {
        assert_eq!(grid.len(), data.len(), "one value per voxel");
        Self { grid, data }
    }

    /// The value of voxel (i, j, k).
    #[inline]
    pub fn at(&self, i: usize, j: usize, k: usize) -> T {
        self.data[self.grid.offset(i, j, k)]
    }

    /// The value of the voxel nearest to a world position, or `None` outside.
    #[inline]
    pub fn nearest(&self, point: &Point) -> Option<T> {
        self.grid.nearest(point).map(|[i, j, k]| self.at(i, j, k))
    }

    /// Every value mapped, on the same grid.
    pub fn map<U: Copy>(&self, f: impl Fn(T) -> U) -> Volume<U> {
        Volume {
            grid: self.grid.clone(),
            data: self.data.iter().map(|&v| f(v)).collect(),
        }
    }

    /// The voxels `min..=max` as a volume of their own.
    pub fn cropped(&self, min: [usize; 3], max: [usize; 3]) -> Self {
        let grid = self.grid.cropped(min, max);
        let mut data = Vec::with_capacity(grid.len());
        for k in min[2]..=max[2] {
            for j in min[1]..=max[1] {
                let row = self.grid.offset(min[0], j, k);
                data.extend_from_slice(&self.data[row..row + grid.dims[0]]);
            }
        }
        Self { grid, data }
    }

    /// The smallest box of voxels, as (min, max) both included, that holds every voxel for which
    /// `keep` is true, or `None` if there is none.
    pub fn bounds(&self, keep: impl Fn(T) -> bool) -> Option<([usize; 3], [usize; 3])> {
        let (mut min, mut max) = ([usize::MAX; 3], [0; 3]);
        for (offset, &value) in self.data.iter().enumerate() {
            if keep(value) {
                let voxel = self.grid.voxel(offset);
                for axis in 0..3 {
                    min[axis] = min[axis].min(voxel[axis]);
                    max[axis] = max[axis].max(voxel[axis]);
                }
            }
        }
        (min[0] != usize::MAX).then_some((min, max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn index_and_point_are_inverse_on_an_oblique_grid() {
        let grid = Grid {
            dims: [5, 6, 7],
            spacing: [0.5, 1.0, 2.0],
            origin: Point::new(-3.0, 8.0, 1.0),
            direction: *nalgebra::Rotation3::from_euler_angles(0.1, 0.2, 0.3).matrix(),
        };
        let p = grid.point(1.25, 3.5, 4.75);
        assert!((grid.index(&p) - Vector::new(1.25, 3.5, 4.75)).norm() < 1e-12);
        let q = grid.index_from_world() * p;
        assert!((q.coords - Vector::new(1.25, 3.5, 4.75)).norm() < 1e-12);
    }

    #[test]
    fn crop_keeps_places_and_values() {
        let grid = Grid::axis_aligned([4, 3, 2], 1.0, Point::origin());
        let volume = Volume::new(grid, (0..24).collect());
        let crop = volume.cropped([1, 1, 0], [2, 2, 1]);
        assert_eq!(crop.at(0, 0, 0), volume.at(1, 1, 0));
        assert_eq!(crop.grid.center([1, 1, 1]), volume.grid.center([2, 2, 1]));
        assert_eq!(
            volume.bounds(|v| v == 5 || v == 18),
            Some(([1, 1, 0], [2, 1, 1]))
        );
    }
}

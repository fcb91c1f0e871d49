//! A bone's attenuation volume, prepared for projection.

use super::footprint::{Hull, PixelRect};
use super::kernel::{KernelVolume, Projection};
use super::rays::IndexRays;
use super::slice::{Lattice, SliceStack};
use super::{AttenuationParameters, Camera, SimdLevel};
use crate::geometry::Rigid;
use crate::volume::{Grid, Volume};
use std::sync::OnceLock;

/// One object of a registration: linear attenuation per mm, zero outside the bone, with a border
/// of one zero voxel all round, in the world of the specimen's CT. Built once, then only read:
/// threads share it.
#[derive(Clone, Debug)]
pub struct BoneVolume {
    attenuation: Volume<f32>,
    hull: Hull,
    /// Voxels as the ray caster reads them, made when it first does.
    kernel: OnceLock<KernelVolume>,
    /// Voxels as slices across each axis, made when they are first resampled.
    stacks: [OnceLock<SliceStack>; 3],
    simd: SimdLevel,
}

impl BoneVolume {
    /// The bone of those voxels whose label `keep` accepts: its tight box, zero elsewhere, and one
    /// zero voxel around. `None` if no such voxel attenuates.
    ///
    /// # Panics
    /// When `ct` and `labels` lie on different grids.
    pub fn from_labels(
        ct: &Volume<i16>,
        labels: &Volume<u8>,
        keep: impl Fn(u8) -> bool,
        attenuation: &AttenuationParameters,
    ) -> Option<Self> {
        assert_eq!(ct.grid, labels.grid, "CT and labels must share one grid");
        let mut kept = [false; 256];
        for (label, kept) in kept.iter_mut().enumerate() {
            *kept = keep(label as u8);
        }
        let mu = |offset: usize| {
            if kept[usize::from(labels.data[offset])] {
                attenuation.mu(f32::from(ct.data[offset]))
            } else {
                0.0
            }
        };
        let (min, max) = occupied_box(&ct.grid, &mu)?;
        let mut bone = Volume::filled(bordered(&ct.grid.cropped(min, max)), 0.0);
        for k in min[2]..=max[2] {
            for j in min[1]..=max[1] {
                let source = ct.grid.offset(min[0], j, k);
                let row = bone.grid.offset(1, j - min[1] + 1, k - min[2] + 1);
                for i in 0..=max[0] - min[0] {
                    bone.data[row + i] = mu(source + i);
                }
            }
        }
        Some(Self::prepare(bone))
    }

    /// The bone of a given attenuation (per mm, none negative): its tight box and one zero voxel
    /// around. `None` if nothing attenuates.
    pub fn from_attenuation(attenuation: &Volume<f32>) -> Option<Self> {
        let (min, max) = occupied_box(&attenuation.grid, &|offset| attenuation.data[offset])?;
        let inner = attenuation.cropped(min, max);
        let mut bone = Volume::filled(bordered(&inner.grid), 0.0);
        let width = inner.grid.dims[0];
        for k in 0..inner.grid.dims[2] {
            for j in 0..inner.grid.dims[1] {
                let row = bone.grid.offset(1, j + 1, k + 1);
                bone.data[row..row + width]
                    .copy_from_slice(&inner.data[inner.grid.offset(0, j, k)..][..width]);
            }
        }
        Some(Self::prepare(bone))
    }

    fn prepare(attenuation: Volume<f32>) -> Self {
        Self {
            hull: Hull::of(&attenuation),
            kernel: OnceLock::new(),
            stacks: Default::default(),
            attenuation,
            simd: SimdLevel::current(),
        }
    }

    /// The same bone projected with another level of vector instructions than the process's.
    ///
    /// # Panics
    /// When the processor lacks the level.
    pub fn with_simd(mut self, level: SimdLevel) -> Self {
        self.simd = level.expect_here();
        self
    }

    /// Attenuation per mm, border included.
    pub fn attenuation(&self) -> &Volume<f32> {
        &self.attenuation
    }

    /// The pixels that the bone can darken, or `None` if there are none. Never too small; somewhat
    /// larger than the shadow.
    pub fn footprint(&self, camera: &Camera, camera_from_volume: &Rigid) -> Option<PixelRect> {
        self.hull.footprint(camera, camera_from_volume)
    }

    /// The level of vector instructions that the bone is projected with.
    pub fn simd(&self) -> SimdLevel {
        self.simd
    }

    pub(super) fn hull(&self) -> &Hull {
        &self.hull
    }

    /// The bone as slices across an axis of its volume.
    pub(super) fn stack(&self, axis: usize) -> &SliceStack {
        self.stacks[axis].get_or_init(|| SliceStack::new(&self.attenuation, axis))
    }

    /// The axis of the bone's volume that the principal ray follows most.
    pub(super) fn dominant_axis(&self, camera: &Camera, camera_from_volume: &Rigid) -> usize {
        let grid = &self.attenuation.grid;
        let rays = IndexRays::new(camera, camera_from_volume, grid);
        Lattice::dominant_axis(&rays, &grid.spacing)
    }

    /// Adds the bone's line integrals (of attenuation over mm, so without unit) to the pixels
    /// `rect` of `out`, a row-major image of the camera's size.
    ///
    /// Samples lie on planes parallel to the detector at depths `k * step_mm` from the source, k
    /// integer, whatever the volume: trilinear between voxel centres, zero outside the volume,
    /// each times the length of the ray between two planes (`super::reference` says why). A
    /// pixel's value does not depend on `rect`.
    ///
    /// # Panics
    /// When `out` is not of the camera's size, `rect` leaves the image, or `step_mm` is not
    /// positive.
    pub fn project_add(
        &self,
        camera: &Camera,
        camera_from_volume: &Rigid,
        step_mm: f64,
        rect: PixelRect,
        out: &mut [f32],
    ) {
        assert_eq!(out.len(), camera.width * camera.height, "image size");
        assert!(
            rect.x1 <= camera.width && rect.y1 <= camera.height,
            "{rect:?} leaves the image"
        );
        assert!(step_mm > 0.0, "step is {step_mm} mm; expected above 0");
        let rays = IndexRays::new(camera, camera_from_volume, &self.attenuation.grid);
        let kernel = self
            .kernel
            .get_or_init(|| KernelVolume::new(&self.attenuation));
        Projection::new(kernel, rays, step_mm, rect, camera.width).add(self.simd, out);
    }
}

/// The smallest box of voxels, (min, max) both included, that holds all attenuation.
fn occupied_box(grid: &Grid, mu: &impl Fn(usize) -> f32) -> Option<([usize; 3], [usize; 3])> {
    let [nx, ny, nz] = grid.dims;
    let (mut min, mut max) = ([usize::MAX; 3], [0; 3]);
    for k in 0..nz {
        for j in 0..ny {
            let row = grid.offset(0, j, k);
            let Some(left) = (0..nx).find(|&i| mu(row + i) > 0.0) else {
                continue;
            };
            let right = (left..nx)
                .rev()
                .find(|&i| mu(row + i) > 0.0)
                .unwrap_or(left);
            min = [min[0].min(left), min[1].min(j), min[2].min(k)];
            max = [max[0].max(right), max[1].max(j), max[2].max(k)];
        }
    }
    (min[0] != usize::MAX).then_some((min, max))
}

/// The grid with one more voxel on each side.
fn bordered(grid: &Grid) -> Grid {
    Grid {
        dims: grid.dims.map(|n| n + 2),
        origin: grid.point(-1.0, -1.0, -1.0),
        ..grid.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    #[test]
    fn the_box_is_tight_and_has_a_zero_border() {
        let grid = Grid {
            dims: [6, 5, 4],
            spacing: [0.5, 1.0, 2.0],
            origin: Point::new(-3.0, 8.0, 1.0),
            direction: *nalgebra::Rotation3::from_euler_angles(0.1, 0.2, 0.3).matrix(),
        };
        let ct = Volume::filled(grid.clone(), 870i16);
        let mut labels = Volume::filled(grid.clone(), 0u8);
        let places = [[0, 1, 3], [2, 1, 2], [1, 2, 3]];
        for [i, j, k] in places {
            labels.data[grid.offset(i, j, k)] = 2;
        }
        labels.data[grid.offset(5, 4, 0)] = 3;
        let p = AttenuationParameters::default();
        let bone = BoneVolume::from_labels(&ct, &labels, |l| l == 2, &p).unwrap();
        let mu = bone.attenuation();
        assert_eq!(mu.grid.dims, [5, 4, 4]);
        assert_eq!(mu.data.iter().filter(|&&v| v > 0.0).count(), 3);
        for [i, j, k] in places {
            let there = mu.nearest(&grid.center([i, j, k])).unwrap();
            assert_eq!(there, p.mu(870.0));
        }
        assert!(BoneVolume::from_labels(&ct, &labels, |l| l == 9, &p).is_none());
        let again = BoneVolume::from_attenuation(mu).unwrap();
        assert_eq!(again.attenuation().data, mu.data);
        assert!((again.attenuation().grid.origin - mu.grid.origin).norm() < 1e-12);
    }
}

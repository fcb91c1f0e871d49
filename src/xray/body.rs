//! The attenuation of a whole body, prepared for radiographs.

use super::footprint::PixelRect;
use super::kernel::{KernelVolume, Projection};
use super::rays::IndexRays;
use super::{Camera, SimdLevel};
use crate::geometry::Rigid;
use crate::image::Image;
use crate::volume::{Grid, Volume};
use rayon::prelude::*;
use std::ops::Range;

/// A volume of linear attenuation of any size, ready for full radiographs. It is the sum of parts
/// that the bones' kernels can follow: blocks that are not too large, and what metal attenuates beyond
/// all tissue. Interpolation is linear and each part has a border of zeros, so seams leave no trace.
#[derive(Clone, Debug)]
pub struct BodyVolume {
    /// Each with its border.
    parts: Vec<(Grid, KernelVolume)>,
    simd: SimdLevel,
}

/// Attenuation per mm that 16 bits of tissue reach to: the densest bone of a CT has 0.0859. One unit is
/// a tenth of a Hounsfield unit by [`super::AttenuationParameters`], so a CT is represented exactly
/// and wires change no voxel but their own.
const TISSUE: f32 = 32_767.0 * 2.68275e-6;

/// Rows of pixels that one thread does at a time: many enough that neighbouring rays share the
/// cache, few enough that threads end together. A multiple of the kernels' tiles.
const BAND: usize = 16;

impl BodyVolume {
    /// Of attenuation per mm, none negative. Up to 0.0879 it is rounded to 2.7e-6, the rest to
    /// 1/32767 of the largest.
    pub fn new(attenuation: &Volume<f32>) -> Self {
        Self::in_blocks(attenuation, KernelVolume::LARGEST - 2)
    }

    /// With blocks of at most `edge` voxels a side.
    fn in_blocks(attenuation: &Volume<f32>, edge: usize) -> Self {
        let mut parts = Vec::new();
        for block in blocks(attenuation.grid.dims, edge) {
            let (mut metal, mut densest) = (None, 0.0f32);
            let [_, rows, slices] = &block;
            for (j, k) in slices
                .clone()
                .flat_map(|k| rows.clone().map(move |j| (j, k)))
            {
                let row = attenuation.grid.offset(0, j, k);
                for i in block[0].clone() {
                    let value = attenuation.data[row + i];
                    densest = densest.max(value);
                    if value > TISSUE {
                        widen(&mut metal, [i, j, k]);
                    }
                }
            }
            let part = |value: f32| value.min(TISSUE);
            if densest > 0.0 {
                parts.push(KernelVolume::bordered(attenuation, &block, part, TISSUE));
            }
            let part = |value: f32| (value - TISSUE).max(0.0);
            if let Some(metal) = metal {
                let largest = part(densest);
                parts.push(KernelVolume::bordered(attenuation, &metal, part, largest));
            }
        }
        Self {
            parts,
            simd: SimdLevel::current(),
        }
    }

    /// The same body with another level of vector instructions than the process's.
    ///
    /// # Panics
    /// When the processor lacks the level.
    pub fn with_simd(mut self, level: SimdLevel) -> Self {
        self.simd = level.expect_here();
        self
    }

    /// Line integrals of attenuation (over mm, so without unit) along the rays to all pixels, by the
    /// sampling rule of [`super::reference`] on the volume with a border of one zero voxel. Rows are
    /// done in parallel; neither threads nor the level of vector instructions change a bit.
    ///
    /// # Panics
    /// When `step_mm` is not positive.
    pub fn line_integrals(
        &self,
        camera: &Camera,
        camera_from_volume: &Rigid,
        step_mm: f64,
    ) -> Image<f32> {
        assert!(step_mm > 0.0, "step is {step_mm} mm; expected above 0");
        let width = camera.width;
        let mut image = Image::filled(width, camera.height, 0.0f32);
        for (grid, kernel) in &self.parts {
            let rays = IndexRays::new(camera, camera_from_volume, grid);
            image
                .data
                .par_chunks_mut((BAND * width).max(1))
                .enumerate()
                .for_each(|(band, rows)| {
                    let rect = PixelRect {
                        x0: 0,
                        y0: band * BAND,
                        x1: width,
                        y1: band * BAND + rows.len() / width,
                    };
                    Projection::new(kernel, rays, step_mm, rect, width)
                        .starting_at(rect.y0)
                        .add(self.simd, rows);
                });
        }
        image
    }
}

/// Boxes of voxels of nearly equal size that together fill a grid.
fn blocks(dims: [usize; 3], edge: usize) -> Vec<[Range<usize>; 3]> {
    let counts = dims.map(|n| n.div_ceil(edge));
    let range = |axis: usize, number: usize| {
        let end = |number: usize| dims[axis] * number / counts[axis];
        end(number)..end(number + 1)
    };
    (0..counts.iter().product())
        .map(|n| {
            let (x, y, z) = (
                n % counts[0],
                n / counts[0] % counts[1],
                n / (counts[0] * counts[1]),
            );
            [range(0, x), range(1, y), range(2, z)]
        })
        .collect()
}

/// Makes a box hold one more voxel.
fn widen(held: &mut Option<[Range<usize>; 3]>, voxel: [usize; 3]) {
    let held = held.get_or_insert_with(|| voxel.map(|n| n..n + 1));
    for (range, n) in held.iter_mut().zip(voxel) {
        *range = range.start.min(n)..range.end.max(n + 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, Vector};
    use crate::xray::reference;

    /// Noise up to the very border, a piece of metal, an air-filled hole.
    fn body() -> Volume<f32> {
        let grid = Grid {
            dims: [34, 23, 29],
            spacing: [2.1, 3.0, 2.6],
            origin: Point::new(-40.0, -30.0, -860.0),
            direction: *nalgebra::Rotation3::from_euler_angles(0.1, -0.2, 0.3).matrix(),
        };
        let data = (0..grid.len())
            .map(|offset| {
                let [i, j, k] = grid.voxel(offset);
                match (i, j, k) {
                    (20..22, 5..17, 9..11) => 0.3,
                    (4..16, 3..14, 8..22) => 0.0,
                    _ => 0.004 + ((offset * 7919) % 101) as f32 * 1e-4,
                }
            })
            .collect();
        Volume::new(grid, data)
    }

    /// The same volume with a border of one zero voxel.
    fn bordered(volume: &Volume<f32>) -> Volume<f32> {
        let old = &volume.grid;
        let grid = Grid {
            dims: old.dims.map(|n| n + 2),
            origin: old.point(-1.0, -1.0, -1.0),
            ..old.clone()
        };
        let mut larger = Volume::filled(grid, 0.0);
        for (offset, &value) in volume.data.iter().enumerate() {
            let [i, j, k] = old.voxel(offset).map(|n| n + 1);
            let at = larger.grid.offset(i, j, k);
            larger.data[at] = value;
        }
        larger
    }

    /// A detector whose rows are no multiple of the bands, nor its columns of the tiles.
    fn view() -> (Camera, Rigid) {
        let mut camera = Camera::centered(50, 5.0, 1020.0);
        camera.height = 45;
        let pose = Rigid::new(Vector::new(3.0, -20.0, 60.0), Vector::new(0.05, -0.1, 0.2));
        (camera, pose)
    }

    #[test]
    fn lines_agree_with_the_plain_caster_at_every_level_and_in_any_blocks() {
        let volume = body();
        let (camera, pose) = view();
        let plain = reference::line_integrals(&bordered(&volume), &camera, &pose, 1.3);
        let largest = plain.data.iter().fold(0.0f64, |a, &b| a.max(b));
        assert!(largest > 2.0, "{largest}");
        for edge in [100, 34, 12, 5] {
            let body = BodyVolume::in_blocks(&volume, edge);
            let image = |level| {
                let body = body.clone().with_simd(level);
                body.line_integrals(&camera, &pose, 1.3)
            };
            let portable = image(SimdLevel::Portable);
            for (a, b) in portable.data.iter().zip(&plain.data) {
                assert!((f64::from(*a) - b).abs() < 5e-5, "{edge}: {a} {b}");
            }
            for level in SimdLevel::available() {
                assert_eq!(image(level), portable, "{} {edge}", level.name());
            }
        }
    }

    #[test]
    fn metal_changes_no_ray_that_passes_it_by() {
        let (camera, pose) = view();
        let with = body();
        let without = with.map(|v| if v > TISSUE { 0.02 } else { v });
        let image = |volume| BodyVolume::new(volume).line_integrals(&camera, &pose, 1.0);
        let (with, without) = (image(&with), image(&without));
        let changed = std::iter::zip(&with.data, &without.data).filter(|(a, b)| a != b);
        // The metal, a voxel of blur around it included, is 10 x 37 x 9 mm large and magnified
        // 1.2 times; pixels have 5 mm.
        let changed = changed.count();
        assert!((10..100).contains(&changed), "{changed}");
    }

    #[test]
    fn threads_change_nothing() {
        let (camera, pose) = view();
        let image = || BodyVolume::new(&body()).line_integrals(&camera, &pose, 1.0);
        let one = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        let three = rayon::ThreadPoolBuilder::new()
            .num_threads(3)
            .build()
            .unwrap();
        assert_eq!(one.install(image), three.install(image));
    }

    #[test]
    fn nothing_but_air_darkens_nothing() {
        let (camera, pose) = view();
        let air = Volume::filled(body().grid, 0.0);
        let image = BodyVolume::new(&air).line_integrals(&camera, &pose, 1.0);
        assert!(image.data.iter().all(|&v| v == 0.0));
    }
}

//! What the kernels of all levels work on.

use super::KernelVolume;
use super::fixed::{BITS, FixedRays, TILE, WEIGHT_BITS, WEIGHT_ONE};
use crate::geometry::Vector;
use crate::image::PixelRect;
use crate::simd::SimdLevel;
use crate::xray::rays::IndexRays;

/// One projection of one volume.
pub(crate) struct Projection<'a> {
    pub volume: &'a KernelVolume,
    pub rays: IndexRays,
    pub fixed: FixedRays,
    pub step_mm: f64,
    pub rect: PixelRect,
    /// Columns of the image.
    width: usize,
    /// The row of the image that the output begins with.
    first_row: usize,
    /// The last index along each axis, in fixed point.
    pub last: [i32; 3],
    /// How far a sample is shifted right so that the sum of a ray's samples fits 31 bits.
    pub shift: u32,
    /// Depth of the volume's corner that lies farthest from the source, at most the detector's.
    pub farthest_mm: f64,
    /// One unit of such a sum times the step.
    unit: f32,
}

impl<'a> Projection<'a> {
    pub fn new(
        volume: &'a KernelVolume,
        rays: IndexRays,
        step_mm: f64,
        rect: PixelRect,
        width: usize,
    ) -> Self {
        // Samples of a ray inside the volume: its diagonal, with the ray's index per depth as the
        // speed. The bound need not be tight: each factor of two costs a bit of some 20.
        let slowest = rays.axis.norm() * 0.5 * step_mm;
        let diagonal = Vector::from(volume.dims.map(|n| n as f64)).norm();
        let most = (diagonal / slowest).ceil().clamp(1.0, 1e9) as u32;
        let shift = (32 - most.leading_zeros()).saturating_sub(31 - 2 * WEIGHT_BITS);
        Self {
            volume,
            farthest_mm: rays.farthest_mm(volume.dims),
            fixed: FixedRays::new(&rays, step_mm),
            rays,
            step_mm,
            rect,
            width,
            first_row: 0,
            last: volume.dims.map(|n| ((n - 1) as i32) << BITS),
            shift,
            unit: volume.unit * step_mm as f32 * (1u64 << shift) as f32 / WEIGHT_ONE as f32,
        }
    }

    /// The same projection for an output that holds the image from this row on.
    pub fn starting_at(self, first_row: usize) -> Self {
        Self { first_row, ..self }
    }

    /// The place of a pixel in the output.
    #[inline(always)]
    pub fn place(&self, u: usize, v: usize) -> usize {
        (v - self.first_row) * self.width + u
    }

    /// What a pixel's sum of shifted samples is to be multiplied by.
    #[inline(always)]
    pub fn scale(&self, u: usize, v: usize) -> f32 {
        self.unit * self.rays.length_per_depth(u, v) as f32
    }

    /// Adds the sums of the rays of a tile, row after row, to those of its pixels that lie in
    /// `rect`.
    #[cfg(target_arch = "x86_64")]
    #[inline(always)]
    pub fn add_tile_sums(&self, u: usize, v: usize, sums: &[i32; TILE * TILE], out: &mut [f32]) {
        for y in v.max(self.rect.y0)..(v + TILE).min(self.rect.y1) {
            for x in u.max(self.rect.x0)..(u + TILE).min(self.rect.x1) {
                let sum = sums[(y - v) * TILE + x - u];
                out[self.place(x, y)] += sum as f32 * self.scale(x, y);
            }
        }
    }

    /// The samples `first..end` of the ray with this slope that lie in the volume's box widened by
    /// `margin` voxels, or `None` if there are none.
    #[inline(always)]
    pub fn samples(&self, slope: Vector, margin: f64) -> Option<(u32, u32)> {
        let min = Vector::repeat(-margin);
        let max = Vector::from(self.volume.dims.map(|n| n as f64 - 1.0 + margin));
        let (enter, leave) = self.rays.clip(&slope, &min, &max)?;
        let first = (enter / self.step_mm).ceil() as u32;
        let end = (leave / self.step_mm).floor() as u32 + 1;
        (first < end).then_some((first, end))
    }

    /// Adds the line integrals of `rect` to `out`.
    pub fn add(&self, level: SimdLevel, out: &mut [f32]) {
        match level {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: a level above portable is only given where the processor has it.
            SimdLevel::Avx512 => unsafe { super::avx512::project_add(self, out) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above.
            SimdLevel::Avx2 => unsafe { super::avx2::project_add(self, out) },
            _ => super::portable::project_add(self, out),
        }
    }
}

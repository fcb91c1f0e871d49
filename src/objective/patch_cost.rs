//! The cost of each patch of one gradient direction.

use super::lanes::{Lanes, LanesWork};
#[cfg(doc)]
use super::patch_sums::PADDING;
use super::patch_sums::PatchSums;
use crate::image::PixelRect;

/// Smallest standard deviation of a patch's gradients (facts 2.2, item 3); the unit is that of
/// line integrals.
pub(super) const SD_FLOOR: f64 = 1e-6;

/// One gradient direction of a fixed image, with the statistics of its patches.
#[derive(Clone, Debug)]
pub(super) struct FixedGradient {
    /// The gradient image, row-major.
    pub values: Vec<f32>,
    /// For each centre, row after row, the patch's mean.
    means: Vec<f64>,
    /// For each centre, 1 / (n SD) for a patch of n pixels.
    scales: Vec<f32>,
}

/// Prepares the fixed image's part of every patch of a gradient image, which comes with
/// [`PADDING`] values after its last pixel.
pub(super) struct PrepareFixed<'a> {
    pub sums: &'a mut PatchSums,
    pub values: Vec<f32>,
}

impl LanesWork for PrepareFixed<'_> {
    type Output = FixedGradient;

    #[inline(always)]
    fn run<L: Lanes>(self) -> FixedGradient {
        let Self { sums, values } = self;
        let centers = sums.all_centers();
        let n = sums.patch_pixels();
        let count = centers.width() * centers.height();
        let (mut means, mut scales) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for y in centers.y0..centers.y1 {
            let [sum, squares, _] = sums.sum_row::<L>(&values, &values, centers, y);
            for (&sum, &squares) in sum.iter().zip(squares) {
                let mean = sum / n;
                let variance = (squares - sum * mean) / (n - 1.0);
                let sd = variance.max(0.0).sqrt().max(SD_FLOOR);
                means.push(mean);
                scales.push((1.0 / (n * sd)) as f32);
            }
        }
        FixedGradient {
            values,
            means,
            scales,
        }
    }
}

/// Adding and subtracting this rounds a number of small size to a multiple of 2^-30.
const ROUNDER: f64 = 1.5 * (1u64 << 22) as f64;

/// Sums the costs of the patches around `centers`, each rounded to a multiple of 2^-30: sums of
/// fewer than 2^22 of them are exact, in any order.
pub(super) struct SumOfCosts<'a> {
    pub sums: &'a mut PatchSums,
    /// Scratch of one row.
    pub row: &'a mut [f64],
    /// The moving gradient, with [`PADDING`] values after its last pixel.
    pub moving: &'a [f32],
    pub fixed: &'a FixedGradient,
    pub centers: PixelRect,
    /// If given, each patch's cost is added to its value here, one for each patch of the image.
    pub map: Option<&'a mut [f64]>,
}

impl LanesWork for SumOfCosts<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(mut self) -> f64 {
        let (centers, all) = (self.centers, self.sums.all_centers());
        let n = self.sums.patch_pixels();
        let (per_pixel, per_freedom) = (1.0 / n, 1.0 / (n - 1.0));
        let count = centers.width();
        let row = &mut self.row[..count];
        let mut total = 0.0;
        for y in centers.y0..centers.y1 {
            let [sum, squares, products] =
                self.sums
                    .sum_row::<L>(self.moving, &self.fixed.values, centers, y);
            let first = (y - all.y0) * all.width() + centers.x0 - all.x0;
            let means = &self.fixed.means[first..first + count];
            let scales = &self.fixed.scales[first..first + count];
            let (sum, squares, products) = (&sum[..count], &squares[..count], &products[..count]);
            for (i, cost) in row.iter_mut().enumerate() {
                let covariance = products[i] - sum[i] * means[i];
                let variance = (squares[i] - sum[i] * sum[i] * per_pixel) * per_freedom;
                let sd = (variance.max(0.0) as f32).sqrt().max(SD_FLOOR as f32);
                let ncc = covariance as f32 * scales[i] / sd;
                *cost = (1.0 - f64::from(ncc)) + ROUNDER - ROUNDER;
            }
            total += sum_by_lanes(row);
            if let Some(map) = &mut self.map {
                for (m, &cost) in map[first..first + count].iter_mut().zip(row.iter()) {
                    *m += cost;
                }
            }
        }
        total
    }
}

/// The sum in an order that vector instructions can follow.
#[inline(always)]
fn sum_by_lanes(values: &[f64]) -> f64 {
    let mut lanes = [0.0; 16];
    let chunks = values.chunks_exact(16);
    let rest: f64 = chunks.remainder().iter().sum();
    for chunk in chunks {
        for (lane, &value) in lanes.iter_mut().zip(chunk) {
            *lane += value;
        }
    }
    rest + lanes.iter().sum::<f64>()
}

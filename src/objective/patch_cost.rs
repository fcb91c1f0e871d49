//! The cost of each patch of one gradient direction.

use super::patch_sums::PatchSums;
use crate::image::PixelRect;
use crate::simd::for_simd_level;

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

for_simd_level! {
    /// The fixed image's part of every patch.
    pub(super) fn fixed_gradient(sums: &mut PatchSums, values: Vec<f32>) -> FixedGradient
        = fixed_gradient_loops;
}

#[inline(always)]
fn fixed_gradient_loops(sums: &mut PatchSums, values: Vec<f32>) -> FixedGradient {
    let centers = sums.all_centers();
    let n = sums.patch_pixels();
    let count = centers.width() * centers.height();
    let (mut means, mut scales) = (Vec::with_capacity(count), Vec::with_capacity(count));
    sums.for_each_row(&values, &values, centers, |_, [sum, squares, _]| {
        for (&sum, &squares) in sum.iter().zip(squares) {
            let mean = sum / n;
            let variance = (squares - sum * mean) / (n - 1.0);
            let sd = variance.max(0.0).sqrt().max(SD_FLOOR);
            means.push(mean);
            scales.push((1.0 / (n * sd)) as f32);
        }
    });
    FixedGradient {
        values,
        means,
        scales,
    }
}

/// Adding and subtracting this rounds a number of small size to a multiple of 2^-30.
const ROUNDER: f64 = 1.5 * (1u64 << 22) as f64;

for_simd_level! {
    /// The sum of the costs of the patches around `centers`, each rounded to a multiple of 2^-30:
    /// sums of fewer than 2^22 of them are exact, in any order. `map`, if given, holds one value
    /// for each patch of the image, to which its cost is added; `row` is scratch of one row.
    pub(super) fn sum_of_costs(
        sums: &mut PatchSums,
        row: &mut [f64],
        moving: &[f32],
        fixed: &FixedGradient,
        centers: PixelRect,
        map: Option<&mut [f64]>,
    ) -> f64 = sum_of_costs_loops;
}

#[inline(always)]
fn sum_of_costs_loops(
    sums: &mut PatchSums,
    row: &mut [f64],
    moving: &[f32],
    fixed: &FixedGradient,
    centers: PixelRect,
    mut map: Option<&mut [f64]>,
) -> f64 {
    let all = sums.all_centers();
    let n = sums.patch_pixels();
    let (per_pixel, per_freedom) = (1.0 / n, 1.0 / (n - 1.0));
    let count = centers.width();
    let row = &mut row[..count];
    let mut total = 0.0;
    sums.for_each_row(
        moving,
        &fixed.values,
        centers,
        |y, [sum, squares, products]| {
            let first = (y - all.y0) * all.width() + centers.x0 - all.x0;
            let means = &fixed.means[first..first + count];
            let scales = &fixed.scales[first..first + count];
            for (i, cost) in row.iter_mut().enumerate() {
                let covariance = products[i] - sum[i] * means[i];
                let variance = (squares[i] - sum[i] * sum[i] * per_pixel) * per_freedom;
                let sd = (variance.max(0.0) as f32).sqrt().max(SD_FLOOR as f32);
                let ncc = covariance as f32 * scales[i] / sd;
                *cost = (1.0 - f64::from(ncc)) + ROUNDER - ROUNDER;
            }
            total += sum_by_lanes(row);
            if let Some(map) = map.as_deref_mut() {
                for (m, &cost) in map[first..first + count].iter_mut().zip(row.iter()) {
                    *m += cost;
                }
            }
        },
    );
    total
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

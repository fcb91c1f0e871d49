//! The similarity written down as defined (facts 2.2), slow and without any shared sums: what the
//! fast one is tested against.

use crate::image::Image;
use crate::image::filter::{GaussianKernel, gaussian, sobel_x, sobel_y};

/// Patch gradient NCC of two images for patches of 2 `radius` + 1 pixels a side.
pub fn similarity(fixed: &Image<f32>, moving: &Image<f32>, radius: usize) -> f64 {
    let kernel = GaussianKernel::with_width(5, 1.1);
    let (fixed, moving) = (gaussian(fixed, &kernel), gaussian(moving, &kernel));
    let x = mean_patch_cost(&sobel_x(&fixed), &sobel_x(&moving), radius);
    let y = mean_patch_cost(&sobel_y(&fixed), &sobel_y(&moving), radius);
    0.5 * (x + y)
}

/// Mean over all patches of 1 - NCC.
pub fn mean_patch_cost(fixed: &Image<f32>, moving: &Image<f32>, radius: usize) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for y in radius..fixed.height - radius {
        for x in radius..fixed.width - radius {
            sum += patch_cost(&patch(fixed, x, y, radius), &patch(moving, x, y, radius));
            count += 1;
        }
    }
    sum / f64::from(count)
}

fn patch(image: &Image<f32>, x: usize, y: usize, radius: usize) -> Vec<f64> {
    (y - radius..=y + radius)
        .flat_map(|v| (x - radius..=x + radius).map(move |u| f64::from(image.at(u, v))))
        .collect()
}

/// 1 - NCC with the SD of n - 1, floored, and the sum divided by n (facts 2.2, items 3 and 4).
pub fn patch_cost(fixed: &[f64], moving: &[f64]) -> f64 {
    let n = fixed.len() as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (mean_f, mean_m) = (mean(fixed), mean(moving));
    let sd = |v: &[f64], mean: f64| {
        let squares: f64 = v.iter().map(|x| (x - mean).powi(2)).sum();
        (squares / (n - 1.0)).sqrt().max(1e-6)
    };
    let products: f64 = fixed
        .iter()
        .zip(moving)
        .map(|(f, m)| (f - mean_f) * (m - mean_m))
        .sum();
    1.0 - products / (n * sd(fixed, mean_f) * sd(moving, mean_m))
}

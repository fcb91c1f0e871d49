//! Fluoroscopy before registration: from photon counts to reduced images of line integrals
//! (DESIGN section 3; facts 2.3).

use super::Camera;
use crate::image::Image;
use crate::image::filter::{GaussianKernel, replicate_ends, smooth_column_wise};
use crate::simd::{SimdLevel, for_simd_level};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// What is done to a fluoroscopic image before registration, in this order: crop, logarithm,
/// Gaussian, reduction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PyramidParameters {
    /// Pixels cut off on each side of the full image. Default 50.
    pub crop_px: usize,
    /// Standard deviation of the Gaussian before a reduction by f, in pixels of the reduced image:
    /// this over f pixels of the full one. Default 0.5, so 4 px at 1/8 and 2 px at 1/4.
    pub sigma_px: f64,
}

impl Default for PyramidParameters {
    fn default() -> Self {
        Self {
            crop_px: 50,
            sigma_px: 0.5,
        }
    }
}

impl PyramidParameters {
    /// Fields out of range, each with what is wrong and what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        if !(self.sigma_px > 0.0 && self.sigma_px.is_finite()) {
            problems.push((
                "sigma_px".to_string(),
                format!("is {}; expected above 0", self.sigma_px),
            ));
        }
        problems
    }
}

/// Why an image cannot be reduced.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PyramidError {
    #[error(
        "the image has {width} x {height} pixels but its camera {camera_width} x \
         {camera_height}; expected the same"
    )]
    CameraSize {
        width: usize,
        height: usize,
        camera_width: usize,
        camera_height: usize,
    },
    #[error(
        "nothing is left of {width} x {height} pixels cropped by {crop_px} on each side and \
         reduced by a factor of {factor}: expected a smaller `crop_px` and a factor in (0, 1]"
    )]
    NothingLeft {
        width: usize,
        height: usize,
        crop_px: usize,
        factor: f64,
    },
    #[error("no pixel of the cropped image counts a photon: there is nothing to register")]
    Dark,
    #[error("`{field}` {message}")]
    Parameter { field: String, message: String },
}

/// The image of line integrals reduced by `factor` (1/8, say) and its camera.
///
/// Counts I become -ln(I / I0) with I0 the highest count, so the lowest value is 0; a pixel
/// without photons takes the smallest positive count. The constant I0 does not matter to
/// gradients. Pixel i of the result lies at i / `factor` of the cropped image, linearly between
/// its smoothed pixels where that is no whole number; the result's camera is
/// `camera.cropped(crop_px).reduced(factor)`.
///
/// # Errors
/// When sizes do not fit, nothing is left after cropping, every count is zero, or a parameter is
/// out of range.
pub fn level(
    counts: &Image<u16>,
    camera: &Camera,
    factor: f64,
    parameters: &PyramidParameters,
) -> Result<(Image<f32>, Camera), PyramidError> {
    let cropped = line_integrals(counts, camera, factor, parameters)?;
    let reduced_camera = camera.cropped(parameters.crop_px).reduced(factor);
    let image = reduce_to(
        SimdLevel::current(),
        &cropped,
        &GaussianKernel::with_sigma(parameters.sigma_px / factor),
        factor,
        (reduced_camera.width, reduced_camera.height),
    );
    Ok((image, reduced_camera))
}

/// The cropped image's -ln(I / I0), after all checks.
fn line_integrals(
    counts: &Image<u16>,
    camera: &Camera,
    factor: f64,
    parameters: &PyramidParameters,
) -> Result<Image<f32>, PyramidError> {
    if let Some((field, message)) = parameters.problems().into_iter().next() {
        return Err(PyramidError::Parameter { field, message });
    }
    let (width, height) = (counts.width, counts.height);
    if (width, height) != (camera.width, camera.height) {
        return Err(PyramidError::CameraSize {
            width,
            height,
            camera_width: camera.width,
            camera_height: camera.height,
        });
    }
    let crop_px = parameters.crop_px;
    let left = |size: usize| size.saturating_sub(2 * crop_px) as f64;
    let smallest = left(width).min(left(height)) * factor;
    if !(factor > 0.0 && factor <= 1.0 && (smallest + 0.5).floor() >= 1.0) {
        return Err(PyramidError::NothingLeft {
            width,
            height,
            crop_px,
            factor,
        });
    }
    let rows = || (crop_px..height - crop_px).map(|y| &counts.row(y)[crop_px..width - crop_px]);
    let positive = || rows().flatten().copied().filter(|&count| count > 0);
    let (Some(lowest), Some(highest)) = (positive().min(), positive().max()) else {
        return Err(PyramidError::Dark);
    };
    // Counts repeat, so a logarithm for each possible one is cheaper than one for each pixel.
    let logarithms: Vec<f32> = (0..=highest)
        .map(|count| (f64::from(highest) / f64::from(count.max(lowest))).ln() as f32)
        .collect();
    Ok(Image::new(
        width - 2 * crop_px,
        height - 2 * crop_px,
        rows()
            .flatten()
            .map(|&count| logarithms[usize::from(count)])
            .collect(),
    ))
}

/// The pixels around position i / factor and the weight of the second.
fn neighbours(i: usize, factor: f64, size: usize) -> (usize, usize, f32) {
    let position = (i as f64 / factor).min(size as f64 - 1.0);
    let first = position.floor();
    let second = (first as usize + 1).min(size - 1);
    (first as usize, second, (position - first) as f32)
}

for_simd_level! {
    /// Smooths and samples: only the rows and columns that are sampled are smoothed.
    fn reduce_to(
        image: &Image<f32>,
        kernel: &GaussianKernel,
        factor: f64,
        size: (usize, usize),
    ) -> Image<f32> = reduce_loops;
}

#[inline(always)]
fn reduce_loops(
    image: &Image<f32>,
    kernel: &GaussianKernel,
    factor: f64,
    (width, height): (usize, usize),
) -> Image<f32> {
    let radius = kernel.radius();
    let mut reduced = Image::filled(width, height, 0.0);
    let mut padded = vec![0.0; image.width + 2 * radius];
    let mut second_row = vec![0.0; image.width];
    for (y, out) in reduced.data.chunks_exact_mut(width).enumerate() {
        let (above, below, weight) = neighbours(y, factor, image.height);
        let row = &mut padded[radius..radius + image.width];
        smooth_column_wise(image, kernel, above, row);
        if weight > 0.0 {
            smooth_column_wise(image, kernel, below, &mut second_row);
            for (a, &b) in row.iter_mut().zip(&second_row) {
                *a += weight * (b - *a);
            }
        }
        replicate_ends(&mut padded, radius);
        let smooth_at = |x: usize| {
            let center = x + radius;
            let mut sum = kernel.half()[0] * padded[center];
            for (distance, &tap) in kernel.half().iter().enumerate().skip(1) {
                sum += tap * (padded[center - distance] + padded[center + distance]);
            }
            sum
        };
        for (x, o) in out.iter_mut().enumerate() {
            let (left, right, weight) = neighbours(x, factor, image.width);
            *o = smooth_at(left);
            if weight > 0.0 {
                *o += weight * (smooth_at(right) - *o);
            }
        }
    }
    reduced
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::filter::gaussian;

    fn counts(width: usize, height: usize, value: impl Fn(usize, usize) -> f64) -> Image<u16> {
        let data = (0..width * height).map(|i| value(i % width, i / width).round() as u16);
        Image::new(width, height, data.collect())
    }

    fn camera(width: usize, height: usize) -> Camera {
        Camera {
            width,
            height,
            ..Camera::cios_fusion()
        }
    }

    #[test]
    fn the_paper_s_levels() {
        let full = Camera::cios_fusion();
        let image = Image::filled(1536, 1536, 700u16);
        for (factor, size) in [(0.125, 180), (0.25, 359)] {
            let (reduced, reduced_camera) =
                level(&image, &full, factor, &PyramidParameters::default()).unwrap();
            assert_eq!((reduced.width, reduced.height), (size, size));
            assert_eq!((reduced_camera.width, reduced_camera.height), (size, size));
            assert!((reduced_camera.principal.x - 717.5 * factor).abs() < 1e-9);
            assert!(reduced.data.iter().all(|&v| v == 0.0));
        }
    }

    #[test]
    fn pixel_i_lies_at_i_over_f_of_the_cropped_image() {
        // Line integrals that are linear in the position come through smoothing unchanged, away
        // from the border; counts are large, so that rounding them is harmless.
        let slope = (2e-3, -3e-3);
        let line = |x: f64, y: f64| slope.0 * x + slope.1 * y;
        let image = counts(300, 260, |x, y| {
            20_000.0 * (-line(x as f64, y as f64)).exp()
        });
        let camera = camera(300, 260);
        for (factor, crop_px) in [(0.125, 0), (0.125, 10), (0.25, 7), (0.3, 0), (1.0, 3)] {
            let parameters = PyramidParameters {
                crop_px,
                ..PyramidParameters::default()
            };
            let cropped = line_integrals(&image, &camera, factor, &parameters).unwrap();
            let shift = f64::from(cropped.at(100, 100)) - line(100.0, 100.0);
            let (reduced, _) = level(&image, &camera, factor, &parameters).unwrap();
            let margin = (24.0 * factor).ceil() as usize;
            for y in margin..reduced.height - margin {
                for x in margin..reduced.width - margin {
                    let expected = shift + line(x as f64 / factor, y as f64 / factor);
                    let got = f64::from(reduced.at(x, y));
                    assert!(
                        (got - expected).abs() < 2e-4,
                        "({x}, {y}) at {factor}: {got} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn equals_the_whole_image_smoothed_and_sampled() {
        let image = counts(90, 70, |x, y| (1 + (x * 7919 + y * 104_729) % 2000) as f64);
        let parameters = PyramidParameters {
            crop_px: 5,
            ..PyramidParameters::default()
        };
        let (reduced, _) = level(&image, &camera(90, 70), 0.25, &parameters).unwrap();
        let smooth = gaussian(
            &line_integrals(&image, &camera(90, 70), 0.25, &parameters).unwrap(),
            &GaussianKernel::with_sigma(2.0),
        );
        assert_eq!((reduced.width, reduced.height), (20, 15));
        for y in 0..15 {
            for x in 0..20 {
                assert_eq!(reduced.at(x, y), smooth.at(4 * x, 4 * y));
            }
        }
    }

    #[test]
    fn no_photon_takes_the_smallest_positive_count() {
        let image = counts(40, 40, |x, y| match (x + 3 * y) % 7 {
            0 => 0.0,
            1 => 3.0,
            k => 500.0 + k as f64,
        });
        let parameters = PyramidParameters {
            crop_px: 0,
            ..PyramidParameters::default()
        };
        let values = line_integrals(&image, &camera(40, 40), 0.5, &parameters).unwrap();
        for (value, &count) in values.data.iter().zip(&image.data) {
            let expected = (506.0 / f64::from(count.max(3))).ln() as f32;
            assert_eq!(*value, expected, "count {count}");
        }
    }

    #[test]
    fn brighter_exposure_only_shifts_the_values() {
        let image = |exposure: f64| {
            counts(100, 100, |x, y| {
                exposure * (1.0 + ((x * 7919 + y * 104_729) % 97) as f64)
            })
        };
        let parameters = PyramidParameters {
            crop_px: 2,
            ..PyramidParameters::default()
        };
        let reduced = |exposure: f64| {
            level(&image(exposure), &camera(100, 100), 0.25, &parameters)
                .unwrap()
                .0
        };
        let (a, b) = (reduced(1.0), reduced(50.0));
        for (a, b) in a.data.iter().zip(&b.data) {
            assert!((a - b).abs() < 1e-5);
        }
    }

    #[test]
    fn unfit_images_are_refused() {
        let p = PyramidParameters::default();
        let bright = Image::filled(120, 120, 9u16);
        let error =
            |image: &Image<u16>, camera, factor| level(image, &camera, factor, &p).unwrap_err();
        let size = error(&bright, camera(120, 121), 0.25);
        assert!(matches!(size, PyramidError::CameraSize { .. }));
        for factor in [0.0, 0.02, 1.5, f64::NAN] {
            let nothing = error(&bright, camera(120, 120), factor);
            assert!(
                matches!(nothing, PyramidError::NothingLeft { .. }),
                "{factor}"
            );
        }
        let small = error(&Image::filled(90, 120, 9u16), camera(90, 120), 0.25);
        assert!(matches!(small, PyramidError::NothingLeft { .. }));
        let dark = error(&Image::filled(120, 120, 0u16), camera(120, 120), 0.25);
        assert_eq!(dark, PyramidError::Dark);
    }
}

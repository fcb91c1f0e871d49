//! Patch gradient NCC between a fixed image and projections.

use super::comparison::Comparison;
use super::lanes::with_lanes;
use super::patch_cost::{FixedGradient, PrepareFixed};
use super::patch_sums::{PADDING, PatchSums};
use crate::image::Image;
use crate::image::filter::GaussianKernel;
use crate::image::gradient::{MAX_RADIUS, SmoothGradient};
use crate::simd::SimdLevel;
use crate::xray::Camera;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// How two images are compared (the paper's supplement on registration; facts 2.2).
///
/// In this order: both images are smoothed by a Gaussian and derived by the 3 x 3 Sobel operator
/// along x and along y, the border replicated. For each direction and each square patch of n
/// pixels that lies in the image (stride 1), with means and with standard deviations of n - 1
/// degrees of freedom that are at least 10^-6,
///
/// cost = 1 - sum (m - mean m) (f - mean f) / (n SD_m SD_f),
///
/// so that the best cost is 1/n (not 0: the sum is divided by n, the variances by n - 1, as in the
/// authors' code), and a patch without any contrast costs exactly 1. The similarity is the mean
/// over patches and over both directions; lower is better, range [1/n, 2 - 1/n].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SimilarityParameters {
    /// Side of a patch in pixels of the full image, odd; a patch of the image reduced by f has
    /// 2 round(f (side - 1) / 2) + 1 pixels. Default 83: 11 at 1/8 and 21 at 1/4.
    pub patch_diameter_px: usize,
    /// Taps of the Gaussian, in pixels of the reduced image: odd, 1 to 9. Default 5.
    pub gaussian_width_px: usize,
    /// Standard deviation of the Gaussian in pixels of the reduced image. Default 1.1.
    pub gaussian_sigma_px: f64,
}

impl Default for SimilarityParameters {
    fn default() -> Self {
        Self {
            patch_diameter_px: 83,
            gaussian_width_px: 5,
            gaussian_sigma_px: 1.1,
        }
    }
}

impl SimilarityParameters {
    /// Fields out of range, each with what is wrong and what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        let mut check = |good: bool, field: &str, message: String| {
            if !good {
                problems.push((field.to_string(), message));
            }
        };
        check(
            self.patch_diameter_px % 2 == 1 && self.patch_diameter_px >= 3,
            "patch_diameter_px",
            format!(
                "is {}; expected an odd number of 3 or more",
                self.patch_diameter_px
            ),
        );
        let widest = 2 * MAX_RADIUS + 1;
        check(
            self.gaussian_width_px % 2 == 1 && self.gaussian_width_px <= widest,
            "gaussian_width_px",
            format!(
                "is {}; expected an odd number from 1 to {widest}",
                self.gaussian_width_px
            ),
        );
        check(
            self.gaussian_sigma_px > 0.0 && self.gaussian_sigma_px.is_finite(),
            "gaussian_sigma_px",
            format!("is {}; expected above 0", self.gaussian_sigma_px),
        );
        problems
    }

    /// Radius of a patch in the image reduced by `factor`, in pixels.
    pub fn patch_radius_px(&self, factor: f64) -> usize {
        (factor * (self.patch_diameter_px as f64 - 1.0) / 2.0).round() as usize
    }
}

/// Why a fixed image cannot be compared.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FixedViewError {
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
        "a patch has {diameter} x {diameter} pixels and the image {width} x {height}; expected a \
         patch of 3 or more pixels a side that fits into the image: change `patch_diameter_px` \
         or the reduction of the image"
    )]
    PatchSize {
        diameter: usize,
        width: usize,
        height: usize,
    },
    #[error(
        "pixel ({x}, {y}) of the image is {value}; expected finite line integrals: look at the \
         fluoroscopy's counts"
    )]
    NotFinite { x: usize, y: usize, value: f32 },
    #[error("`{field}` {message}")]
    Parameter { field: String, message: String },
}

/// A fixed image with all that its comparison with any projection needs: computed once, shared by
/// scorers.
#[derive(Clone, Debug)]
pub struct FixedView {
    camera: Camera,
    image: Image<f32>,
    pub(super) radius: usize,
    pub(super) kernel: GaussianKernel,
    /// Along x, then along y.
    pub(super) gradients: [FixedGradient; 2],
}

impl FixedView {
    /// Prepares a log-corrected image (of any constant offset), reduced by `factor` with its
    /// `camera`, for patches of `patch_diameter_px` pixels of the full image and the paper's
    /// smoothing.
    ///
    /// # Errors
    /// When the image is not of the camera's size, is not finite, or holds no patch.
    pub fn new(
        image: Image<f32>,
        camera: Camera,
        patch_diameter_px: usize,
        factor: f64,
    ) -> Result<Self, FixedViewError> {
        let parameters = SimilarityParameters {
            patch_diameter_px,
            ..SimilarityParameters::default()
        };
        Self::with_parameters(image, camera, factor, &parameters)
    }

    /// The same with all parameters given.
    ///
    /// # Errors
    /// As [`Self::new`], and when a parameter is out of range.
    pub fn with_parameters(
        image: Image<f32>,
        camera: Camera,
        factor: f64,
        parameters: &SimilarityParameters,
    ) -> Result<Self, FixedViewError> {
        if let Some((field, message)) = parameters.problems().into_iter().next() {
            return Err(FixedViewError::Parameter { field, message });
        }
        let (width, height) = (image.width, image.height);
        if (width, height) != (camera.width, camera.height) {
            return Err(FixedViewError::CameraSize {
                width,
                height,
                camera_width: camera.width,
                camera_height: camera.height,
            });
        }
        let radius = parameters.patch_radius_px(factor);
        let diameter = 2 * radius + 1;
        if radius == 0 || diameter > width || diameter > height {
            return Err(FixedViewError::PatchSize {
                diameter,
                width,
                height,
            });
        }
        if let Some(i) = image.data.iter().position(|v| !v.is_finite()) {
            return Err(FixedViewError::NotFinite {
                x: i % width,
                y: i / width,
                value: image.data[i],
            });
        }
        let kernel =
            GaussianKernel::with_width(parameters.gaussian_width_px, parameters.gaussian_sigma_px);
        let level = SimdLevel::current();
        let mut sums = PatchSums::new(width, height, radius);
        let gradients = SmoothGradient::of_image(level, &image, kernel.clone()).map(|gradient| {
            let mut values = gradient.data;
            values.extend([0.0; PADDING]);
            let sums = &mut sums;
            with_lanes(level, PrepareFixed { sums, values })
        });
        Ok(Self {
            camera,
            image,
            radius,
            kernel,
            gradients,
        })
    }

    /// The camera of the image.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The image as given.
    pub fn image(&self) -> &Image<f32> {
        &self.image
    }

    /// Side of a patch in pixels of this image.
    pub fn patch_diameter_px(&self) -> usize {
        2 * self.radius + 1
    }

    /// The similarity of one whole projection (of the camera's size), lower is better. Allocates;
    /// a [`Comparison`] does not.
    ///
    /// # Panics
    /// When the projection is not of the camera's size.
    pub fn similarity(&self, projection: &Image<f32>) -> f64 {
        Comparison::new(self, SimdLevel::current()).similarity(self, &projection.data)
    }

    /// Number of patch costs that the similarity averages: both directions of all patches.
    pub(super) fn costs(&self) -> f64 {
        let patches =
            (self.camera.width - 2 * self.radius) * (self.camera.height - 2 * self.radius);
        2.0 * patches as f64
    }
}

#[cfg(test)]
mod tests {
    use super::super::direct;
    use super::*;
    use proptest::prelude::*;

    /// Smooth blobs of given seed on zero, and whether the right third is left empty.
    fn blobs(width: usize, height: usize, seed: u32, empty_right: bool) -> Image<f32> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        let mut image = Image::filled(width, height, 0.0f32);
        let right = if empty_right { width * 2 / 3 } else { width };
        for _ in 0..12 {
            let (cx, cy) = (next() * width as f64, next() * height as f64);
            let (size, height_of) = (2.0 + 8.0 * next(), 3.0 * next());
            for y in 0..height {
                for x in 0..right {
                    let d = (x as f64 - cx).hypot(y as f64 - cy) / size;
                    image.data[y * width + x] += (height_of * (1.0 - d * d).max(0.0)) as f32;
                }
            }
        }
        image
    }

    fn camera(width: usize, height: usize) -> Camera {
        Camera {
            width,
            height,
            ..Camera::centered(width, 1.552, 1020.0)
        }
    }

    fn view(image: &Image<f32>, diameter: usize) -> FixedView {
        FixedView::new(
            image.clone(),
            camera(image.width, image.height),
            diameter,
            1.0,
        )
        .unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn agrees_with_the_definition(
            seed in any::<u32>(),
            radius in 1usize..9,
            (width, height) in (24usize..60, 24usize..60),
            empty_right in any::<bool>(),
            offset in -5.0f32..5.0,
        ) {
            let mut fixed = blobs(width, height, seed, false);
            for (i, v) in fixed.data.iter_mut().enumerate() {
                *v += offset + 0.01 * (i * 7919 % 101) as f32;
            }
            let moving = blobs(width, height, seed ^ 77, empty_right);
            let got = view(&fixed, 2 * radius + 1).similarity(&moving);
            let expected = direct::similarity(&fixed, &moving, radius);
            prop_assert!((got - expected).abs() < 1e-7, "{} {}", got, expected);
        }
    }

    #[test]
    fn one_image_with_itself_costs_one_over_n() {
        let image = blobs(50, 40, 5, false);
        let mut textured = image.clone();
        for (i, v) in textured.data.iter_mut().enumerate() {
            *v += 0.1 * (i * 7919 % 101) as f32;
        }
        let n = 121.0;
        let cost = view(&textured, 11).similarity(&textured);
        assert!((cost - 1.0 / n).abs() < 1e-7, "{cost}");
        let negative = Image::new(50, 40, textured.data.iter().map(|v| -2.0 * v).collect());
        let cost = view(&textured, 11).similarity(&negative);
        assert!((cost - (2.0 - 1.0 / n)).abs() < 1e-7, "{cost}");
    }

    #[test]
    fn a_projection_without_contrast_costs_exactly_one() {
        let fixed = view(&blobs(40, 40, 9, false), 11);
        for value in [0.0, 3.7] {
            assert_eq!(fixed.similarity(&Image::filled(40, 40, value)), 1.0);
        }
    }

    #[test]
    fn an_offset_of_the_fixed_image_does_not_matter() {
        let (a, moving) = (blobs(60, 60, 3, false), blobs(60, 60, 4, true));
        let b = Image::new(60, 60, a.data.iter().map(|v| v + 7.6).collect());
        let difference = view(&a, 11).similarity(&moving) - view(&b, 11).similarity(&moving);
        assert!(difference.abs() < 1e-5, "{difference}");
    }

    #[test]
    fn the_paper_s_patches() {
        let p = SimilarityParameters::default();
        assert_eq!((p.patch_radius_px(0.125), p.patch_radius_px(0.25)), (5, 10));
        assert!(p.problems().is_empty());
        let bad = SimilarityParameters {
            patch_diameter_px: 10,
            gaussian_width_px: 11,
            gaussian_sigma_px: 0.0,
        };
        let fields: Vec<_> = bad.problems().into_iter().map(|(f, _)| f).collect();
        assert_eq!(
            fields,
            [
                "patch_diameter_px",
                "gaussian_width_px",
                "gaussian_sigma_px"
            ]
        );
    }

    #[test]
    fn unfit_images_are_refused() {
        let image = blobs(20, 20, 1, false);
        let fit = |image: &Image<f32>, camera, diameter| {
            FixedView::new(image.clone(), camera, diameter, 1.0).unwrap_err()
        };
        let camera_error = fit(&image, camera(20, 21), 5);
        assert!(matches!(camera_error, FixedViewError::CameraSize { .. }));
        let patch_error = fit(&image, camera(20, 20), 21);
        assert!(matches!(patch_error, FixedViewError::PatchSize { .. }));
        let mut broken = image.clone();
        broken.data[43] = f32::NAN;
        let message = fit(&broken, camera(20, 20), 5).to_string();
        assert!(message.contains("pixel (3, 2)"), "{message}");
    }
}

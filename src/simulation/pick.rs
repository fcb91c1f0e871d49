//! The simulated pick of the initialization landmark (paper, section "Simulation Study").

use crate::geometry::{Pixel, Point, Vector};
use crate::random::Stream;
use rand_distr::{Distribution, StandardNormal, UnitCircle, UnitSphere};
use serde::{Deserialize, Serialize};

/// How far a person's pick lies from the landmark.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PickParameters {
    /// SD of the 3D offset's length: |N(0, sd)| mm along a uniform direction.
    pub point_sd_mm: f64,
    /// SD of the 2D offset's length: |N(0, sd)| pixels of the full, uncropped image along a uniform
    /// direction.
    pub pixel_sd_px: f64,
}

impl Default for PickParameters {
    fn default() -> Self {
        Self {
            point_sd_mm: 3.0,
            pixel_sd_px: 7.5,
        }
    }
}

impl PickParameters {
    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        if !(0.0..=100.0).contains(&self.point_sd_mm) {
            let message = format!("is {}; expected 0 to 100 mm", self.point_sd_mm);
            problems.push(("point_sd_mm".into(), message));
        }
        if !(0.0..=500.0).contains(&self.pixel_sd_px) {
            let message = format!("is {}; expected 0 to 500 pixels", self.pixel_sd_px);
            problems.push(("pixel_sd_px".into(), message));
        }
        problems
    }
}

/// A landmark as a person picked it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pick {
    /// In the CT: the specimen's world (LPS, mm).
    pub point: Point,
    /// In the first view: pixels of the full, uncropped image.
    pub pixel: Pixel,
}

impl Pick {
    /// Draws a pick of the landmark at `point` (world) and `pixel` (its true projection).
    pub fn sample(
        point: &Point,
        pixel: &Pixel,
        parameters: &PickParameters,
        stream: &mut Stream,
    ) -> Self {
        let direction: [f64; 3] = UnitSphere.sample(stream);
        let length: f64 = StandardNormal.sample(stream);
        let offset = Vector::from(direction) * (length.abs() * parameters.point_sd_mm);
        let direction: [f64; 2] = UnitCircle.sample(stream);
        let length: f64 = StandardNormal.sample(stream);
        let shift = nalgebra::Vector2::from(direction) * (length.abs() * parameters.pixel_sd_px);
        Self {
            point: point + offset,
            pixel: pixel + shift,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

    #[test]
    fn offsets_have_folded_normal_lengths_and_no_preferred_direction() {
        let (point, pixel) = (Point::new(10.0, -20.0, 30.0), Pixel::new(700.0, 900.0));
        let mut s = stream(1, Purpose::Pick, "test");
        let n = 20_000;
        let (mut mean3, mut mean2) = (Vector::zeros(), nalgebra::Vector2::zeros());
        let (mut squares, mut lengths) = ([0.0; 2], [0.0; 2]);
        for _ in 0..n {
            let pick = Pick::sample(&point, &pixel, &PickParameters::default(), &mut s);
            let (a, b) = (pick.point - point, pick.pixel - pixel);
            mean3 += a / n as f64;
            mean2 += b / n as f64;
            for (k, length) in [a.norm(), b.norm()].into_iter().enumerate() {
                squares[k] += length * length / n as f64;
                lengths[k] += length / n as f64;
            }
        }
        // E|N(0, s)| = s sqrt(2 / pi) and E N(0, s)^2 = s^2; tolerances are six standard errors.
        for (k, sd) in [3.0, 7.5].into_iter().enumerate() {
            let expected = sd * (2.0 / std::f64::consts::PI).sqrt();
            assert!((lengths[k] - expected).abs() < 6.0 * 0.603 * sd / (n as f64).sqrt());
            assert!((squares[k] / (sd * sd) - 1.0).abs() < 6.0 * (2.0 / n as f64).sqrt());
        }
        assert!(mean3.norm() < 6.0 * 3.0 / (n as f64).sqrt(), "{mean3}");
        assert!(mean2.norm() < 6.0 * 7.5 / (n as f64).sqrt(), "{mean2}");
    }

    #[test]
    fn without_noise_the_pick_is_the_landmark() {
        let parameters = PickParameters {
            point_sd_mm: 0.0,
            pixel_sd_px: 0.0,
        };
        let (point, pixel) = (Point::new(1.0, 2.0, 3.0), Pixel::new(4.0, 5.0));
        let mut s = stream(1, Purpose::Pick, "test");
        let pick = Pick::sample(&point, &pixel, &parameters, &mut s);
        assert_eq!(pick, Pick { point, pixel });
    }
}

//! Hounsfield values of a bone by depth below its surface.

use super::parameters::SurfacesParameters;
use statrs::function::erf::{erf, erf_inv};

/// Tissue of a bone at one place.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoneTissue {
    pub cortical_hu: f64,
    /// Thickness of the cortical shell (mm).
    pub cortical_mm: f64,
    /// What lies inside the shell (HU).
    pub inner_hu: f64,
}

/// A shell of cortical bone around an inner tissue, seen through the scanner's blur.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthProfile {
    blur_mm: f64,
    surface_hu: f64,
    around_hu: f64,
}

impl DepthProfile {
    pub fn new(parameters: &SurfacesParameters) -> Self {
        Self {
            blur_mm: parameters.blur_mm,
            surface_hu: parameters.surface_hu,
            around_hu: parameters.muscle_hu,
        }
    }

    /// What the bone adds to soft tissue (HU), `depth_mm` below the given surface (negative
    /// outside).
    ///
    /// The blurred edge of a shell is a normal distribution function. The given surface is where a
    /// threshold cuts that edge, so the shell itself begins deeper by the distance over which the
    /// edge rises from the threshold to its half.
    pub fn excess_hu(&self, depth_mm: f64, tissue: &BoneTissue) -> f64 {
        let step = tissue.cortical_hu - self.around_hu;
        let at_surface = ((self.surface_hu - self.around_hu) / step).clamp(0.01, 0.5);
        let begin = -self.blur_mm * normal_quantile(at_surface);
        let edge = |at: f64| normal((depth_mm - at) / self.blur_mm);
        step * edge(begin)
            - (tissue.cortical_hu - tissue.inner_hu) * edge(begin + tissue.cortical_mm)
    }

    /// Farther outside the surface than this a bone adds nothing (mm).
    pub fn reach_mm(&self) -> f64 {
        3.0 * self.blur_mm
    }
}

fn normal(x: f64) -> f64 {
    0.5 * (1.0 + erf(x / std::f64::consts::SQRT_2))
}

fn normal_quantile(p: f64) -> f64 {
    std::f64::consts::SQRT_2 * erf_inv(2.0 * p - 1.0)
}

/// 0 below `from`, 1 above `to`, smooth between.
pub(super) fn smooth_step(from: f64, to: f64, value: f64) -> f64 {
    let t = ((value - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_profile_passes_the_threshold_at_the_surface_and_ends_inside() {
        let p = SurfacesParameters::default();
        let profile = DepthProfile::new(&p);
        // A thick shell: the inner tissue plays no part at the surface.
        let tissue = BoneTissue {
            cortical_hu: 1200.0,
            cortical_mm: 8.0,
            inner_hu: 100.0,
        };
        let hu = |depth: f64| p.muscle_hu + profile.excess_hu(depth, &tissue);
        assert!((hu(0.0) - p.surface_hu).abs() < 1.0, "{}", hu(0.0));
        assert!((hu(5.0) - 1200.0).abs() < 3.0);
        assert!((hu(20.0) - 100.0).abs() < 1e-6);
        assert!((hu(-profile.reach_mm()) - p.muscle_hu).abs() < 1.0);
    }

    #[test]
    fn blur_keeps_the_amount_of_bone() {
        let p = SurfacesParameters::default();
        let profile = DepthProfile::new(&p);
        let tissue = BoneTissue {
            cortical_hu: 1100.0,
            cortical_mm: 1.5,
            inner_hu: p.muscle_hu,
        };
        let sum: f64 = (-1000..3000)
            .map(|n| profile.excess_hu(f64::from(n) * 0.01, &tissue) * 0.01)
            .sum();
        assert!((sum - (1100.0 - p.muscle_hu) * 1.5).abs() < 0.01, "{sum}");
    }
}

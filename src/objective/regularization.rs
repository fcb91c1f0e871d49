//! Penalties on implausible poses: negative log densities of pose magnitudes, zero at the stage's
//! start (the paper's supplement, "Intraoperative Registration"; facts 2.6).

use crate::geometry::{Rigid, Vector, euler, se3};

/// A penalty on the movement of one object away from a stage's start.
#[derive(Clone, Debug, PartialEq)]
pub enum Regularization {
    /// Single views: independent zero-mean normals on the Euler angles of `R = Rz Ry Rx` and on
    /// the translation components, in camera-aligned axes.
    Components {
        /// Standard deviations of the angles about x, y, z (rad).
        rotation_sd: Vector,
        /// Standard deviations of the translations along x, y, z (mm).
        translation_sd: Vector,
    },
    /// Multiple views: folded normals with mu = sigma on the rotation angle and the translation
    /// norm.
    Magnitudes {
        /// mu = sigma of the rotation angle (rad).
        rotation: f64,
        /// mu = sigma of the translation (mm).
        translation: f64,
    },
}

impl Regularization {
    /// `-ln(p(motion) / p(identity))` for a movement from the stage's start.
    pub fn cost(&self, motion: &Rigid) -> f64 {
        match self {
            Self::Components {
                rotation_sd,
                translation_sd,
            } => {
                let angles = euler::to_zyx(&motion.rotation).component_div(rotation_sd);
                let shifts = motion.translation.vector.component_div(translation_sd);
                0.5 * (angles.norm_squared() + shifts.norm_squared())
            }
            Self::Magnitudes {
                rotation,
                translation,
            } => {
                folded_normal(se3::rotation_angle(&motion.rotation), *rotation)
                    + folded_normal(motion.translation.vector.norm(), *translation)
            }
        }
    }
}

/// `-ln(p(x) / p(0))` of the folded normal with mu = sigma, for x >= 0.
fn folded_normal(x: f64, mu: f64) -> f64 {
    // p(x) is proportional to exp(-(t-1)^2/2) + exp(-(t+1)^2/2) with t = x / mu, so the ratio to
    // p(0) is exp(-t^2/2) cosh(t); ln cosh is written so that it does not overflow.
    let t = (x / mu).abs();
    0.5 * t * t - (t + (0.5 * (1.0 + (-2.0 * t).exp())).ln())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    #[test]
    fn folded_normal_rises_as_published() {
        // facts 2.6: 0.066 at mu, 0.675 at 2 mu, 2.19 at 3 mu.
        for (t, expected) in [(0.0, 0.0), (1.0, 0.066), (2.0, 0.675), (3.0, 2.19)] {
            assert!(
                (folded_normal(t * 7.5, 7.5) - expected).abs() < 5e-3,
                "at {t} mu"
            );
        }
        assert!(folded_normal(1e6, 1.0).is_finite());
    }

    #[test]
    fn components_are_half_squared_z_scores() {
        let penalty = Regularization::Components {
            rotation_sd: Vector::repeat(0.1),
            translation_sd: Vector::new(20.0, 20.0, 100.0),
        };
        let motion = Rigid::translation(20.0, 0.0, -100.0);
        assert!((penalty.cost(&motion) - 1.0).abs() < 1e-12);
        let turned = se3::exp(&Vector6::new(0.0, 0.2, 0.0, 0.0, 0.0, 0.0));
        assert!((penalty.cost(&turned) - 2.0).abs() < 1e-12);
    }
}

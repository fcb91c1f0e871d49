//! The exponential map of SE(3) and its inverse.
//!
//! A twist is `(wx, wy, wz, vx, vy, vz)`: rotation vector in radians, then the translational
//! part in mm that the V-matrix maps to the translation (the paper's section on registration;
//! facts 2.5).

use super::{Rigid, Vector};
use nalgebra::{Matrix3, Translation3, UnitQuaternion, Vector6};

/// Below this angle (rad) the series expansions are exact to rounding.
const SMALL_ANGLE: f64 = 1e-4;

/// exp: se(3) -> SE(3).
pub fn exp(twist: &Vector6<f64>) -> Rigid {
    let w = Vector::new(twist[0], twist[1], twist[2]);
    let v = Vector::new(twist[3], twist[4], twist[5]);
    Rigid::from_parts(
        Translation3::from(v_matrix(&w) * v),
        UnitQuaternion::from_scaled_axis(w),
    )
}

/// log: SE(3) -> se(3), with a rotation angle in [0, pi].
pub fn log(motion: &Rigid) -> Vector6<f64> {
    let w = rotation_vector(&motion.rotation);
    let v = v_matrix(&w)
        .try_inverse()
        .expect("the V-matrix is regular for angles up to pi")
        * motion.translation.vector;
    Vector6::new(w.x, w.y, w.z, v.x, v.y, v.z)
}

/// The rotation vector (axis times angle in [0, pi], rad), accurate for tiny angles and near pi.
pub fn rotation_vector(rotation: &UnitQuaternion<f64>) -> Vector {
    let q = if rotation.w < 0.0 {
        -rotation.into_inner()
    } else {
        rotation.into_inner()
    };
    let sine = q.imag().norm();
    if sine < 1e-300 {
        return Vector::zeros();
    }
    q.imag() * (2.0 * sine.atan2(q.w) / sine)
}

/// The rotation angle in [0, pi] rad, by atan2: no loss of digits for small angles.
pub fn rotation_angle(rotation: &UnitQuaternion<f64>) -> f64 {
    2.0 * rotation.imag().norm().atan2(rotation.w.abs())
}

fn v_matrix(w: &Vector) -> Matrix3<f64> {
    let angle = w.norm();
    let hat = w.cross_matrix();
    let (b, c) = if angle < SMALL_ANGLE {
        (
            0.5 - angle * angle / 24.0,
            1.0 / 6.0 - angle * angle / 120.0,
        )
    } else {
        let a2 = angle * angle;
        (
            (1.0 - angle.cos()) / a2,
            (angle - angle.sin()) / (a2 * angle),
        )
    };
    Matrix3::identity() + hat * b + hat * hat * c
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix4;
    use proptest::prelude::*;

    /// The defining power series of the 4 x 4 matrix exponential.
    fn exp_by_series(twist: &Vector6<f64>) -> Matrix4<f64> {
        let w = Vector::new(twist[0], twist[1], twist[2]).cross_matrix();
        let mut a = Matrix4::zeros();
        a.fixed_view_mut::<3, 3>(0, 0).copy_from(&w);
        for i in 0..3 {
            a[(i, 3)] = twist[3 + i];
        }
        let (mut sum, mut term) = (Matrix4::identity(), Matrix4::identity());
        for n in 1..60 {
            term = term * a / n as f64;
            sum += term;
        }
        sum
    }

    proptest! {
        #[test]
        fn exp_is_the_matrix_exponential(t in prop::array::uniform6(-2.0..2.0f64)) {
            let twist = Vector6::from(t);
            let difference = exp(&twist).to_homogeneous() - exp_by_series(&twist);
            prop_assert!(difference.abs().max() < 1e-11);
        }

        #[test]
        fn log_inverts_exp(t in prop::array::uniform6(-1.7..1.7f64), scale in 0.0..1.0f64) {
            let twist = Vector6::from(t) * scale.powi(4);
            prop_assert!((log(&exp(&twist)) - twist).norm() < 1e-9);
        }
    }

    #[test]
    fn tiny_angles_keep_their_digits() {
        let q = UnitQuaternion::from_scaled_axis(Vector::new(0.0, 3e-9, 0.0));
        assert!((rotation_angle(&q) - 3e-9).abs() < 1e-20);
    }
}

//! Euler angles about the three coordinate axes.

use super::Vector;
use nalgebra::{Rotation3, UnitQuaternion};

/// The rotation `Rx(a.x) * Ry(a.y) * Rz(a.z)` (DESIGN section 3, movement and error of a pose).
/// Angles in radians.
pub fn from_xyz(angles: &Vector) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector::x_axis(), angles.x)
        * UnitQuaternion::from_axis_angle(&Vector::y_axis(), angles.y)
        * UnitQuaternion::from_axis_angle(&Vector::z_axis(), angles.z)
}

/// The angles of `R = Rx Ry Rz` in radians; x and z in (-pi, pi], y in [-pi/2, pi/2].
pub fn to_xyz(rotation: &UnitQuaternion<f64>) -> Vector {
    let r: Rotation3<f64> = (*rotation).into();
    let m = r.matrix();
    let cos_y = m[(0, 0)].hypot(m[(0, 1)]);
    Vector::new(
        (-m[(1, 2)]).atan2(m[(2, 2)]),
        m[(0, 2)].atan2(cos_y),
        (-m[(0, 1)]).atan2(m[(0, 0)]),
    )
}

/// The angles of `R = Rz Ry Rx` in radians, as (x, y, z): the decomposition that regularizes
/// the single-view stages (facts 2.6).
pub fn to_zyx(rotation: &UnitQuaternion<f64>) -> Vector {
    let r: Rotation3<f64> = (*rotation).into();
    let m = r.matrix();
    let cos_y = m[(0, 0)].hypot(m[(1, 0)]);
    Vector::new(
        m[(2, 1)].atan2(m[(2, 2)]),
        (-m[(2, 0)]).atan2(cos_y),
        m[(1, 0)].atan2(m[(0, 0)]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn xyz_comes_back(x in -3.0..3.0f64, y in -1.5..1.5f64, z in -3.0..3.0f64) {
            let a = Vector::new(x, y, z);
            prop_assert!((to_xyz(&from_xyz(&a)) - a).norm() < 1e-9);
        }

        #[test]
        fn zyx_comes_back(x in -3.0..3.0f64, y in -1.5..1.5f64, z in -3.0..3.0f64) {
            let r = UnitQuaternion::from_axis_angle(&Vector::z_axis(), z)
                * UnitQuaternion::from_axis_angle(&Vector::y_axis(), y)
                * UnitQuaternion::from_axis_angle(&Vector::x_axis(), x);
            prop_assert!((to_zyx(&r) - Vector::new(x, y, z)).norm() < 1e-9);
        }
    }
}

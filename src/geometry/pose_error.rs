//! The fragment's movement from estimated poses, and how far a pose is from the truth.

use super::{Rigid, Vector, euler, se3};

/// The fragment's movement in the APP: `app_from_volume * volume_from_camera(pelvis) *
/// camera_from_volume(fragment) * volume_from_app`. It maps a point of the fragment before its
/// relocation to the same point after it. Eq. 2 as printed is the inverse (DESIGN section 3).
pub fn fragment_movement(
    app_from_volume: &Rigid,
    camera_from_pelvis: &Rigid,
    camera_from_fragment: &Rigid,
) -> Rigid {
    app_from_volume
        * camera_from_pelvis.inverse()
        * camera_from_fragment
        * app_from_volume.inverse()
}

/// What remains of `estimated * inverse(truth)`, both movements in the APP. In the APP x = LR,
/// y = IS and z = AP. Components are signed; tables take their absolute values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseError {
    /// Total rotation angle in degrees, in [0, 180].
    pub rotation_deg: f64,
    /// Angles of `Rx Ry Rz` in degrees: about LR, IS and AP.
    pub rotation_axes_deg: Vector,
    /// Length of the translation in mm.
    pub translation_mm: f64,
    /// Components of the translation in mm: along LR, IS and AP.
    pub translation_axes_mm: Vector,
}

impl PoseError {
    /// The error of one movement against the true one.
    pub fn between(estimated: &Rigid, truth: &Rigid) -> Self {
        Self::of(&(estimated * truth.inverse()))
    }

    /// The same decomposition of any rigid transform, a movement itself for instance.
    pub fn of(difference: &Rigid) -> Self {
        let translation = difference.translation.vector;
        Self {
            rotation_deg: se3::rotation_angle(&difference.rotation).to_degrees(),
            rotation_axes_deg: euler::to_xyz(&difference.rotation).map(f64::to_degrees),
            translation_mm: translation.norm(),
            translation_axes_mm: translation,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use proptest::prelude::*;

    fn rigid(t: [f64; 3], r: [f64; 3]) -> Rigid {
        Rigid::new(Vector::from(t), Vector::from(r))
    }

    #[test]
    fn a_moved_fragment_seen_by_a_camera_gives_its_movement() {
        let app_from_volume = rigid([80.0, -20.0, 5.0], [0.3, -0.2, 0.1]);
        let camera_from_pelvis = rigid([-3.0, 12.0, -800.0], [0.1, 2.0, -0.4]);
        let movement = rigid([-2.0, -1.5, 2.5], [0.2, 0.05, -0.3]);
        // A fragment point p of the CT lies, once moved, at volume_from_app * movement *
        // app_from_volume * p, and the camera sees it there.
        let moved_from_preoperative = app_from_volume.inverse() * movement * app_from_volume;
        let camera_from_fragment = camera_from_pelvis * moved_from_preoperative;
        let recovered =
            fragment_movement(&app_from_volume, &camera_from_pelvis, &camera_from_fragment);
        let p = Point::new(31.0, -14.0, 7.0);
        assert!((recovered * p - movement * p).norm() < 1e-9);
        // The inverse, which is what eq. 2 prints, is another transform.
        assert!((recovered.inverse() * p - movement * p).norm() > 1.0);
    }

    #[test]
    fn components_are_those_of_a_known_difference() {
        let truth = rigid([1.0, 2.0, 3.0], [0.1, 0.2, 0.3]);
        let angles = Vector::new(1.0, -2.0, 3.0);
        let difference = Rigid::from_parts(
            Vector::new(3.0, -4.0, 12.0).into(),
            euler::from_xyz(&angles.map(f64::to_radians)),
        );
        let error = PoseError::between(&(difference * truth), &truth);
        assert!((error.rotation_axes_deg - angles).norm() < 1e-9);
        assert!((error.translation_axes_mm - Vector::new(3.0, -4.0, 12.0)).norm() < 1e-9);
        assert!((error.translation_mm - 13.0).abs() < 1e-9);
    }

    #[test]
    fn tiny_and_half_turn_rotations_keep_their_digits() {
        for degrees in [1e-7, 1e-3, 90.0, 179.999_999] {
            let turn = rigid([0.0; 3], [0.0, f64::to_radians(degrees), 0.0]);
            let found = PoseError::of(&turn).rotation_deg;
            assert!(
                ((found - degrees) / degrees).abs() < 1e-8,
                "{found} for {degrees}"
            );
        }
    }

    proptest! {
        #[test]
        fn a_pose_has_no_error_against_itself(
            t in prop::array::uniform3(-50.0..50.0f64),
            r in prop::array::uniform3(-1.0..1.0f64),
        ) {
            let pose = rigid(t, r);
            let error = PoseError::between(&pose, &pose);
            prop_assert!(error.rotation_deg < 1e-10 && error.translation_mm < 1e-10);
        }
    }
}

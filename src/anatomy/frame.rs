//! The anterior pelvic plane (APP) frame and the hip.

use super::{Landmark, Landmarks, Side, Specimen};
use crate::geometry::{Point, Rigid, Vector};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use std::sync::Arc;

/// A landmark without which a frame cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    #[error("landmark {0} is missing; add it to the specimen's landmarks file")]
    Missing(String),
    #[error("the landmarks of the anterior pelvic plane (ASIS, IPS) lie on one line")]
    Degenerate,
}

/// `app_from_volume` with the origin at `origin` (facts 2.12): x from the right to the left ASIS,
/// y from the midpoint of the inferior symphysis points to that of the ASIS (superior) made
/// perpendicular to x, z = x cross y (anterior).
pub fn app_from_volume(landmarks: &Landmarks, origin: &Point) -> Result<Rigid, FrameError> {
    let get = |landmark: Landmark, side: Side| {
        landmarks
            .get(landmark, side)
            .ok_or_else(|| FrameError::Missing(landmark.key(side)))
    };
    let (left, right) = (
        get(Landmark::Asis, Side::Left)?,
        get(Landmark::Asis, Side::Right)?,
    );
    let symphysis = nalgebra::center(
        &get(Landmark::Ips, Side::Left)?,
        &get(Landmark::Ips, Side::Right)?,
    );
    let x = (left - right)
        .try_normalize(1e-6)
        .ok_or(FrameError::Degenerate)?;
    let up = nalgebra::center(&left, &right) - symphysis;
    let y = (up - x * up.dot(&x))
        .try_normalize(1e-6)
        .ok_or(FrameError::Degenerate)?;
    let z = x.cross(&y);
    let volume_from_app = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, y, z]));
    let rotation = UnitQuaternion::from_rotation_matrix(&volume_from_app).inverse();
    Ok(Rigid::from_parts(
        (-(rotation * origin.coords)).into(),
        rotation,
    ))
}

/// `camera_from_app` of a supine AP view with the detector in front of the patient: x = LR,
/// y = -IS, z = -AP for a left hip. For a right hip the C-arm comes from the other side of the
/// table, so the camera is turned by 180 deg about its z (DESIGN section 1).
pub fn ap_view_rotation(side: Side) -> UnitQuaternion<f64> {
    let s = side.lateral_sign();
    let rows = Matrix3::new(s, 0.0, 0.0, 0.0, -s, 0.0, 0.0, 0.0, -1.0);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rows))
}

/// A specimen and a side: what an operation is planned on.
#[derive(Clone, Debug)]
pub struct Hip {
    pub specimen: Arc<Specimen>,
    pub side: Side,
    /// Maps the specimen's world (LPS, mm) to the APP with the origin at the ipsilateral femoral
    /// head: x = LR (to the patient's left), y = IS (superior), z = AP (anterior).
    pub app_from_volume: Rigid,
}

impl Hip {
    /// The hip of one side.
    pub fn new(specimen: Arc<Specimen>, side: Side) -> Result<Self, FrameError> {
        let head = specimen
            .landmarks
            .get(Landmark::Fh, side)
            .ok_or_else(|| FrameError::Missing(Landmark::Fh.key(side)))?;
        let app_from_volume = app_from_volume(&specimen.landmarks, &head)?;
        Ok(Self {
            specimen,
            side,
            app_from_volume,
        })
    }

    /// `phantom-1/left`, as keys write it.
    pub fn key(&self) -> String {
        format!("{}/{}", self.specimen.name, self.side)
    }

    /// The femoral head's centre in the specimen's world.
    pub fn head(&self) -> Point {
        self.app_from_volume.inverse() * Point::origin()
    }

    /// A landmark of the hip's own side, in the specimen's world.
    ///
    /// # Errors
    /// When the specimen lacks it.
    pub fn landmark(&self, landmark: Landmark) -> Result<Point, FrameError> {
        self.specimen
            .landmarks
            .get(landmark, self.side)
            .ok_or_else(|| FrameError::Missing(landmark.key(self.side)))
    }

    /// The rim's trace of this side in the APP.
    pub fn rim_in_app(&self) -> Vec<Point> {
        let rim = self.specimen.rim(self.side);
        rim.iter().map(|p| self.app_from_volume * p).collect()
    }

    /// The direction of "lateral" in the APP: +x on the left, -x on the right.
    pub fn lateral(&self) -> Vector {
        Vector::x() * self.side.lateral_sign()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Landmarks of an upright pelvis in LPS: x to the left, y posterior, z superior.
    fn upright() -> Landmarks {
        let mut l = Landmarks::default();
        for side in Side::BOTH {
            let s = side.lateral_sign();
            l.set(Landmark::Asis, side, Point::new(120.0 * s, -90.0, 80.0));
            l.set(Landmark::Ips, side, Point::new(5.0 * s, -90.0, -40.0));
        }
        l
    }

    #[test]
    fn axes_point_left_up_and_forward() {
        let head = Point::new(85.0, -40.0, 0.0);
        let app = app_from_volume(&upright(), &head).unwrap();
        let moved = |p: Point| (app * p).coords;
        assert!((moved(head)).norm() < 1e-12);
        assert!((moved(head + Vector::x()) - Vector::x()).norm() < 1e-12);
        assert!((moved(head + Vector::z()) - Vector::y()).norm() < 1e-12);
        assert!((moved(head - Vector::y()) - Vector::z()).norm() < 1e-12);
    }

    #[test]
    fn a_moved_patient_keeps_the_frame() {
        let motion = Rigid::new(Vector::new(9.0, -4.0, 30.0), Vector::new(0.2, 0.4, -0.1));
        let mut moved = Landmarks::default();
        for (landmark, side, point) in upright().iter() {
            moved.set(landmark, side, motion * point);
        }
        let head = Point::new(85.0, -40.0, 0.0);
        let a = app_from_volume(&upright(), &head).unwrap();
        let b = app_from_volume(&moved, &(motion * head)).unwrap();
        let p = Point::new(1.0, 2.0, 3.0);
        assert!((a * p - b * (motion * p)).norm() < 1e-9);
    }
}

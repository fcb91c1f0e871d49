//! Oriented planes.

use super::{Point, Rigid, Vector};

/// The plane `normal . p = offset_mm`, oriented: its signed distance grows along `normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vector,
    /// Signed distance of the plane from the frame's origin, along `normal`, in mm.
    pub offset_mm: f64,
}

impl Plane {
    /// The plane through `point` with the direction of `normal` (need not be of unit length).
    ///
    /// # Panics
    /// When `normal` has no length.
    pub fn through(point: &Point, normal: &Vector) -> Self {
        let normal = normal
            .try_normalize(1e-12)
            .expect("a plane's normal must have a length");
        Self {
            normal,
            offset_mm: normal.dot(&point.coords),
        }
    }

    /// Signed distance of `point` in mm, positive on the side that the normal points to.
    pub fn signed_distance(&self, point: &Point) -> f64 {
        self.normal.dot(&point.coords) - self.offset_mm
    }

    /// The point of the plane closest to `point`.
    pub fn project(&self, point: &Point) -> Point {
        point - self.normal * self.signed_distance(point)
    }

    /// The same plane seen from another frame: `target_from_source` maps this plane's frame to it.
    pub fn transformed(&self, target_from_source: &Rigid) -> Self {
        let on_plane = Point::from(self.normal * self.offset_mm);
        Self::through(
            &(target_from_source * on_plane),
            &(target_from_source.rotation * self.normal),
        )
    }

    /// The same plane with its normal reversed.
    pub fn flipped(&self) -> Self {
        Self {
            normal: -self.normal,
            offset_mm: -self.offset_mm,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_is_kept_by_a_rigid_transform() {
        let plane = Plane::through(&Point::new(1.0, 2.0, 3.0), &Vector::new(1.0, -2.0, 0.5));
        let motion = Rigid::new(Vector::new(4.0, 5.0, -6.0), Vector::new(0.3, -0.2, 0.9));
        let p = Point::new(-7.0, 8.0, 2.5);
        let moved = plane.transformed(&motion);
        assert!((moved.signed_distance(&(motion * p)) - plane.signed_distance(&p)).abs() < 1e-12);
        assert!(plane.signed_distance(&plane.project(&p)).abs() < 1e-12);
    }
}

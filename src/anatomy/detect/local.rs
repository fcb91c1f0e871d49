//! The anatomical directions of one side.

use crate::geometry::{Point, Vector};

/// A frame of one side of the pelvis: (lateral, superior, anterior) in mm from an origin. It is
/// right-handed on the left and left-handed on the right, so that a rule reads the same on both.
#[derive(Clone, Copy, Debug)]
pub(in crate::anatomy) struct Local {
    pub origin: Point,
    /// World directions (unit, orthogonal): lateral, superior, anterior.
    pub axes: [Vector; 3],
}

impl Local {
    /// (lateral, superior, anterior) of a world point.
    pub fn coordinates(&self, point: &Point) -> Vector {
        let d = point - self.origin;
        Vector::new(
            d.dot(&self.axes[0]),
            d.dot(&self.axes[1]),
            d.dot(&self.axes[2]),
        )
    }

    /// The world direction of (lateral, superior, anterior).
    pub fn direction(&self, v: &Vector) -> Vector {
        self.axes[0] * v.x + self.axes[1] * v.y + self.axes[2] * v.z
    }

    /// The world point of (lateral, superior, anterior).
    pub fn point(&self, v: &Vector) -> Point {
        self.origin + self.direction(v)
    }
}

/// The direction (lateral, superior, anterior) that points forward, turned `lateral_deg` to the
/// side and `up_deg` up.
pub(super) fn forward(lateral_deg: f64, up_deg: f64) -> Vector {
    let (side, up) = (lateral_deg.to_radians(), up_deg.to_radians());
    Vector::new(side.sin(), side.cos() * up.sin(), side.cos() * up.cos())
}

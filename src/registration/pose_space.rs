//! Twists about a stage's start, in the frame that the stage searches in.

use crate::geometry::{Point, Rigid, se3};
use nalgebra::Vector6;

/// How six numbers (rad, mm; see [`se3`]) move one object away from a stage's starting pose. Zero
/// is the start.
#[derive(Clone, Debug)]
pub enum PoseSpace {
    /// Axes of the camera through the femoral head at the start: the single-view stages.
    CameraAligned {
        /// `camera_from_volume` at the start.
        start: Rigid,
        /// The femoral head at the start, in the camera frame.
        center: Point,
    },
    /// Axes of the APP with its origin at the femoral head: the multi-view stages.
    Anatomical {
        /// `world_from_volume` at the start.
        start: Rigid,
        /// The preoperative APP, shared by all objects.
        app_from_volume: Rigid,
    },
}

impl PoseSpace {
    /// The pose of a twist.
    ///
    /// # Panics
    /// When `twist` has not six values.
    pub fn pose(&self, twist: &[f64]) -> Rigid {
        let motion = self.motion(twist);
        match self {
            Self::CameraAligned { start, center } => {
                let c = Rigid::translation(center.x, center.y, center.z);
                c * motion * c.inverse() * start
            }
            Self::Anatomical {
                start,
                app_from_volume,
            } => start * app_from_volume.inverse() * motion * app_from_volume,
        }
    }

    /// The movement in the space's own axes: what the regularization judges.
    pub fn motion(&self, twist: &[f64]) -> Rigid {
        se3::exp(&Vector6::from_column_slice(twist))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector;

    #[test]
    fn camera_aligned_rotation_keeps_the_head_in_place() {
        let start = Rigid::new(
            Vector::new(10.0, -30.0, -800.0),
            Vector::new(0.3, -0.4, 1.0),
        );
        let head = Point::new(85.0, 20.0, -7.0);
        let space = PoseSpace::CameraAligned {
            start,
            center: start * head,
        };
        let turned = space.pose(&[0.2, -0.1, 0.4, 0.0, 0.0, 0.0]);
        assert!((turned * head - start * head).norm() < 1e-9);
        // A translation along the camera's depth moves every point along it.
        let deeper = space.pose(&[0.0, 0.0, 0.0, 0.0, 0.0, 5.0]);
        let p = Point::new(1.0, 2.0, 3.0);
        assert!((deeper * p - start * p - Vector::new(0.0, 0.0, 5.0)).norm() < 1e-9);
    }

    #[test]
    fn anatomical_motion_acts_in_the_app() {
        let start = Rigid::new(Vector::new(1.0, 2.0, 3.0), Vector::new(0.1, 0.2, 0.3));
        let app_from_volume = Rigid::new(Vector::new(-80.0, 5.0, 9.0), Vector::new(1.2, 0.1, -0.2));
        let space = PoseSpace::Anatomical {
            start,
            app_from_volume,
        };
        let twist = [0.1, 0.05, -0.2, 3.0, -1.0, 2.0];
        // The relative movement of equation 2 recovers the motion.
        let relative =
            app_from_volume * start.inverse() * space.pose(&twist) * app_from_volume.inverse();
        let difference = relative.to_homogeneous() - space.motion(&twist).to_homogeneous();
        assert!(difference.abs().max() < 1e-9);
    }
}

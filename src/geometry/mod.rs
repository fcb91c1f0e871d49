//! Rigid transforms, se(3), Euler angles, planes and rays.
//!
//! All poses are `f64`. Lengths are millimetres and angles radians. Transforms are named
//! target-first: `camera_from_volume` maps points of the volume to the camera.

pub mod euler;
pub mod plane;
pub mod pose_error;
pub mod ray;
pub mod se3;

/// A rigid transform (proper rotation and translation in mm).
pub type Rigid = nalgebra::Isometry3<f64>;
/// A position in mm.
pub type Point = nalgebra::Point3<f64>;
/// A displacement in mm, or a direction.
pub type Vector = nalgebra::Vector3<f64>;
/// A position in an image, in pixels: `x` is the column, `y` the row; integers are pixel centres.
pub type Pixel = nalgebra::Point2<f64>;

pub use plane::Plane;
pub use pose_error::PoseError;
pub use ray::Ray;

//! Single-landmark initialization (the paper's section on registration; facts 2.11).

use crate::anatomy::Hip;
use crate::anatomy::frame::ap_view_rotation;
use crate::geometry::{Pixel, Point, Rigid};
use crate::xray::Camera;

/// `camera_from_volume` of the first view: the APP aligned with the camera as in a supine AP view,
/// and the landmark picked at `point` of the CT's world on the ray of `pixel`, its pick in the full
/// image of `camera`, at `depth` of the way from the source to the detector.
pub fn from_single_landmark(
    hip: &Hip,
    camera: &Camera,
    point: &Point,
    pixel: &Pixel,
    depth: f64,
) -> Rigid {
    let rotation = ap_view_rotation(hip.side) * hip.app_from_volume.rotation;
    let landmark = camera.detector_point(pixel) * depth;
    let translation = landmark - rotation * point;
    Rigid::from_parts(translation.into(), rotation)
}

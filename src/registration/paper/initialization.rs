//! Single-landmark initialization (the paper's section on registration; facts 2.11).

use crate::anatomy::frame::ap_view_rotation;
use crate::geometry::Rigid;
use crate::registration::Observation;

/// `camera_from_volume` of the first view: the APP aligned with the camera as in a supine AP view,
/// and the picked landmark on the ray of its picked pixel, at `depth` of the source-to-detector
/// distance (measured along the central ray's direction).
pub fn from_single_landmark(observation: &Observation, depth: f64) -> Rigid {
    let hip = &observation.hip;
    let rotation = ap_view_rotation(hip.side) * hip.app_from_volume.rotation;
    let camera = &observation.views[0].camera;
    let landmark = camera.detector_point(&observation.picked_pixel) * depth;
    let translation = landmark - rotation * observation.picked_point;
    Rigid::from_parts(translation.into(), rotation)
}

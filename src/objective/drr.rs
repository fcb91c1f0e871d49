//! Simulated radiographs of bone.

use crate::geometry::Rigid;
use crate::image::Image;
use crate::xray::{BoneVolume, Camera};

/// The line integrals through bones, each with its `camera_from_volume`, as an image of the
/// camera: without unit, zero beside the bones. Samples every `step_mm`.
pub fn drr(camera: &Camera, bones: &[(&BoneVolume, Rigid)], step_mm: f64) -> Image<f32> {
    let mut image = Image::filled(camera.width, camera.height, 0.0);
    for (bone, camera_from_volume) in bones {
        if let Some(rect) = bone.footprint(camera, camera_from_volume) {
            bone.project_add(camera, camera_from_volume, step_mm, rect, &mut image.data);
        }
    }
    image
}

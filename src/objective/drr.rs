//! Simulated radiographs of bone.

use crate::geometry::Rigid;
use crate::image::{Image, PixelRect};
use crate::xray::{BoneVolume, Camera};

/// The line integrals through bones, each with its `camera_from_volume`, as an image of the
/// camera: without unit, zero beside the bones. Samples every `step_mm`.
pub fn drr(camera: &Camera, bones: &[(&BoneVolume, Rigid)], step_mm: f64) -> Image<f32> {
    let mut image = Image::filled(camera.width, camera.height, 0.0);
    for (bone, camera_from_volume) in bones {
        add_line_integrals(bone, camera, camera_from_volume, step_mm, &mut image.data);
    }
    image
}

/// Adds one bone's line integrals to a row-major image; gives the pixels that it may have changed.
pub(super) fn add_line_integrals(
    bone: &BoneVolume,
    camera: &Camera,
    camera_from_volume: &Rigid,
    step_mm: f64,
    image: &mut [f32],
) -> PixelRect {
    match bone.footprint(camera, camera_from_volume) {
        Some(rect) => {
            bone.project_add(camera, camera_from_volume, step_mm, rect, image);
            rect
        }
        None => PixelRect::EMPTY,
    }
}

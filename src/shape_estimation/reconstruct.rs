//! Annotated pixels to 3D points of a cut.

use super::annotation::{Crossing, CutAnnotation};
use crate::anatomy::{Hip, Side};
use crate::geometry::{Pixel, Point, Ray, Rigid};
use crate::surgery::Cut;
use crate::volume::Surface;
use crate::xray::Camera;

/// A view whose pelvis is registered.
#[derive(Clone, Copy, Debug)]
pub struct RegisteredView {
    /// Intrinsics of the full, uncropped image.
    pub camera: Camera,
    /// The registered pose of the full pelvis.
    pub camera_from_pelvis: Rigid,
}

/// The ray of a pixel from the detector towards the source, in the pelvis' frame, with a direction
/// of unit length.
pub fn detector_ray(camera: &Camera, camera_from_pelvis: &Rigid, pixel: &Pixel) -> Ray {
    let pelvis_from_camera = camera_from_pelvis.inverse();
    let detector = pelvis_from_camera * camera.detector_point(pixel);
    let source = pelvis_from_camera * Point::origin();
    Ray {
        origin: detector,
        direction: (source - detector).normalize(),
    }
}

/// The points, in the world of the CT, where annotated rays of one cut meet the unmoved
/// preoperative pelvis: cast from the detector towards the source, entering, leaving or both as
/// each annotation says.
pub fn cut_points(
    pelvis: &Surface,
    views: &[RegisteredView],
    annotations: &[CutAnnotation],
    cut: Cut,
) -> Vec<Point> {
    let mut points = Vec::new();
    for annotation in annotations.iter().filter(|a| a.cut == cut) {
        let view = &views[annotation.view];
        let ray = detector_ray(&view.camera, &view.camera_from_pelvis, &annotation.pixel);
        for hit in pelvis.intersections(&ray) {
            let wanted = match annotation.crossing {
                Crossing::Entry => hit.entering,
                Crossing::Exit => !hit.entering,
                Crossing::Both => true,
            };
            if wanted {
                points.push(ray.at(hit.t));
            }
        }
    }
    points
}

/// Keeps what can belong to a cut by its place in the anatomy: the ipsilateral side, above the
/// femoral head for the ilium, in front of it for the pubis (the paper's supplement, "Fragment
/// Shape Estimation").
pub fn prune(points: &[Point], hip: &Hip, midline_x: f64, cut: Cut) -> Vec<Point> {
    let ipsilateral = |x: f64| match hip.side {
        Side::Left => x > midline_x,
        Side::Right => x < midline_x,
    };
    points
        .iter()
        .filter(|point| {
            let p = hip.app_from_volume * *point;
            ipsilateral(p.x)
                && match cut {
                    Cut::Ilium => p.y > 0.0,
                    Cut::Pubis => p.z > 0.0,
                    Cut::Ischium | Cut::Posterior => true,
                }
        })
        .copied()
        .collect()
}

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

/// The places where one annotated ray may have met a cut, in rising distance from the detector: all
/// its entries into the pelvis, or all its exits. A ray may cross several parts of the pelvis, and
/// an annotation does not say in which one it saw the cut.
pub type Candidates = Vec<Point>;

/// The candidates of a cut's annotations, in the world of the CT: where their rays, cast from the
/// detector towards the source, meet the unmoved preoperative pelvis, entering or leaving as each
/// annotation says. An annotation of both gives two sets. Rays that miss the pelvis give none.
pub fn cut_points(
    pelvis: &Surface,
    views: &[RegisteredView],
    annotations: &[CutAnnotation],
    cut: Cut,
) -> Vec<Candidates> {
    let mut found = Vec::new();
    for annotation in annotations.iter().filter(|a| a.cut == cut) {
        let view = &views[annotation.view];
        let ray = detector_ray(&view.camera, &view.camera_from_pelvis, &annotation.pixel);
        let hits = pelvis.intersections(&ray);
        let of_kind = |entering: bool| -> Candidates {
            let wanted = hits.iter().filter(|hit| hit.entering == entering);
            wanted.map(|hit| ray.at(hit.t)).collect()
        };
        match annotation.crossing {
            Crossing::Entry => found.push(of_kind(true)),
            Crossing::Exit => found.push(of_kind(false)),
            Crossing::Both => found.extend([of_kind(true), of_kind(false)]),
        }
    }
    found.retain(|candidates| !candidates.is_empty());
    found
}

/// Keeps what can belong to a cut by its place in the anatomy: the ipsilateral side, above the
/// femoral head for the ilium, in front of it for the pubis (the paper's supplement, "Fragment
/// Shape Estimation"). Sets of which nothing is left are dropped.
pub fn prune(found: &[Candidates], hip: &Hip, midline_x: f64, cut: Cut) -> Vec<Candidates> {
    let keep = |point: &Point| {
        let p = hip.app_from_volume * point;
        let ipsilateral = match hip.side {
            Side::Left => p.x > midline_x,
            Side::Right => p.x < midline_x,
        };
        ipsilateral
            && match cut {
                Cut::Ilium => p.y > 0.0,
                Cut::Pubis => p.z > 0.0,
                Cut::Ischium | Cut::Posterior => true,
            }
    };
    found
        .iter()
        .map(|candidates| -> Candidates {
            let kept = candidates.iter().filter(|point| keep(point));
            kept.copied().collect()
        })
        .filter(|candidates| !candidates.is_empty())
        .collect()
}

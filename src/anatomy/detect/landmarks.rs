//! All landmarks and both rims of a pelvis.

use super::foramen::foramen_corners;
use super::head::femoral_head;
use super::notch::greater_sciatic_notch;
use super::pelvic_frame::pelvic_frame;
use super::prominence::prominences;
use super::rim::rim;
use super::symphysis::symphysis;
use super::{BoneSurfaces, DetectError, Head};
use crate::anatomy::frame::app_from_volume;
use crate::anatomy::{Landmark, Landmarks, Side};
use crate::geometry::{Point, Vector};

/// What was found on the bones of one specimen, in their world (LPS, mm). Pairs are by
/// [`Side::index`].
#[derive(Clone, Debug)]
pub struct Detected {
    /// All landmarks of both sides.
    pub landmarks: Landmarks,
    /// Each rim's trace: an ordered closed line from superior by the front, steps of 3 mm at most.
    pub rims: [Vec<Point>; 2],
    pub heads: [Head; 2],
    /// Not a landmark of a specimen; found for comparison with other people's.
    pub pubic_tubercles: [Point; 2],
    /// Not a landmark of a specimen; found for comparison with other people's.
    pub ischial_spines: [Point; 2],
}

/// Finds all landmarks and both rims.
///
/// # Errors
/// When the bones differ from what the rules expect, for the first thing that was not found.
pub fn detect(bones: &BoneSurfaces) -> Result<Detected, DetectError> {
    let frame = pelvic_frame(bones)?;
    let faces = symphysis(bones, &frame)?;
    let midline = nalgebra::center(&faces[0].superior, &faces[1].superior);
    let mut landmarks = Landmarks::default();
    let mut rims = [Vec::new(), Vec::new()];
    let (mut heads, mut tubercles, mut spines) = (Vec::new(), Vec::new(), Vec::new());
    for side in Side::BOTH {
        let hip = bones.hip(side);
        let head = femoral_head(
            bones.femur(side),
            side,
            &frame.local(side, frame.ilium[side.index()]),
        )?;
        let local = frame.local(side, head.center);
        let found = prominences(
            hip,
            side,
            &local,
            head.radius_mm,
            &frame.ilium[side.index()],
            &midline,
            frame.width(),
        )?;
        let notch = greater_sciatic_notch(hip, side, &local, head.radius_mm, &found.ischial_spine)?;
        rims[side.index()] = rim(hip, side, &local, &head)?;
        let face = &faces[side.index()];
        for (landmark, point) in [
            (Landmark::Asis, found.asis),
            (Landmark::Aiis, found.aiis),
            (Landmark::Fh, head.center),
            (Landmark::Sps, face.superior),
            (Landmark::Ips, face.inferior),
            (Landmark::Gsn, notch),
        ] {
            landmarks.set(landmark, side, point);
        }
        heads.push(head);
        tubercles.push(found.pubic_tubercle);
        spines.push(found.ischial_spine);
    }
    // The foramen's corners are those of an AP view, which the landmarks so far define.
    for side in Side::BOTH {
        let app = app_from_volume(&landmarks, &heads[side.index()].center).map_err(|error| {
            DetectError::NotFound {
                what: "anterior pelvic plane",
                side,
                reason: error.to_string(),
            }
        })?;
        let volume_from_app = app.rotation.inverse();
        let corners = foramen_corners(
            bones.hip(side),
            side,
            volume_from_app * (Vector::x() * side.lateral_sign()),
            volume_from_app * Vector::y(),
        )?;
        landmarks.set(Landmark::Mof, side, corners.medial);
        landmarks.set(Landmark::Iof, side, corners.inferior);
    }
    Ok(Detected {
        landmarks,
        rims,
        heads: [heads[0], heads[1]],
        pubic_tubercles: [tubercles[0], tubercles[1]],
        ischial_spines: [spines[0], spines[1]],
    })
}

//! All landmarks and both rims of a pelvis.

use super::foramen::foramen_corners;
use super::head::femoral_head;
use super::notch::greater_sciatic_notch;
use super::pelvic_frame::{PelvicFrame, pelvic_frame};
use super::prominence::prominences;
use super::rim::rim;
use super::spot::Spot;
use super::symphysis::{FaceEnds, face_ends};
use super::{BoneSurfaces, DetectError, Head};
use crate::anatomy::frame::app_from_volume;
use crate::anatomy::{Landmark, Landmarks, Provenance, Rim, Side};
use crate::geometry::{Point, Vector};
use nalgebra::{Rotation3, Unit};

/// Directions are uncertain by this much about each axis (deg): by so much the frames of two
/// observers differ.
const TURN_DEG: f64 = 2.0;

/// A landmark that a turned frame does not find at all counts as moved by this much (mm).
pub(super) const LOST_MM: f64 = 10.0;

/// What was found on the bones of one specimen, in their world (LPS, mm). Pairs are by
/// [`Side::index`]. Landmarks and rims carry their uncertainties.
#[derive(Clone, Debug)]
pub struct Detected {
    /// All landmarks of both sides.
    pub landmarks: Landmarks,
    /// Each rim's trace: from superior by the front, steps of 3 mm at most.
    pub rims: [Rim; 2],
    pub heads: [Head; 2],
    /// Not a landmark of a specimen; found for comparison with other people's.
    pub pubic_tubercles: [Extra; 2],
    /// Not a landmark of a specimen; found for comparison with other people's.
    pub ischial_spines: [Extra; 2],
}

/// A place that is no landmark of a specimen (LPS, mm).
#[derive(Clone, Copy, Debug)]
pub struct Extra {
    pub point: Point,
    /// As of [`Provenance`].
    pub uncertainty_mm: f64,
}

/// Finds all landmarks and both rims, each with its uncertainty.
///
/// The uncertainty of a landmark on bone is a standard deviation over all axes, from two parts that
/// the bone itself tells: how far its place moves when the directions turn by [`TURN_DEG`] about each
/// axis, and how far from it bone still meets the rule to within a millimetre ([`Spot::flat_mm`]):
/// `sqrt(sum over axes of (d+^2 + d-^2) / 2 + flat^2)`. That of a femoral head's centre is the
/// jackknife's over sectors of the sphere, that of a rim how far it moves with the point from which it
/// is seen.
///
/// # Errors
/// When the bones differ from what the rules expect, for the first thing that was not found.
pub fn detect(bones: &BoneSurfaces) -> Result<Detected, DetectError> {
    let frame = pelvic_frame(bones)?;
    let head = |side: Side| {
        let local = frame.local(side, frame.ilium[side.index()]);
        femoral_head(bones.femur(side), side, &local)
    };
    let heads = [head(Side::Left)?, head(Side::Right)?];
    let found = on_bones(bones, &frame, &heads);
    let mut landmarks = Landmarks::default();
    for side in Side::BOTH {
        let head = &heads[side.index()];
        let from = Provenance::detected(head.uncertainty_mm);
        landmarks.set_with(Landmark::Fh, side, head.center, from);
    }
    let mut marks = Vec::new();
    for (mark, side, spot) in found {
        let spot = spot?;
        if let Mark::Landmark(landmark) = mark {
            landmarks.set(landmark, side, spot.point);
        }
        marks.push((mark, side, spot));
    }
    // The foramen's corners are those of an AP view, which the landmarks so far define.
    let app =
        app_from_volume(&landmarks, &heads[0].center).map_err(|error| DetectError::NotFound {
            what: "anterior pelvic plane",
            side: Side::Left,
            reason: error.to_string(),
        })?;
    let app_axes = [Vector::x(), Vector::y()].map(|axis| app.rotation.inverse() * axis);
    for (mark, side, spot) in corners(bones, app_axes) {
        marks.push((mark, side, spot?));
    }

    let moved = moves(bones, &frame, &heads, app_axes, &marks);
    let (mut tubercles, mut spines) = (Vec::new(), Vec::new());
    for ((mark, side, spot), moved_mm) in marks.into_iter().zip(moved) {
        let extra = Extra {
            point: spot.point,
            uncertainty_mm: moved_mm.hypot(spot.flat_mm),
        };
        match mark {
            Mark::Landmark(landmark) => {
                let from = Provenance::detected(extra.uncertainty_mm);
                landmarks.set_with(landmark, side, spot.point, from);
            }
            Mark::PubicTubercle => tubercles.push(extra),
            Mark::IschialSpine => spines.push(extra),
        }
    }
    let rim = |side: Side| {
        let head = &heads[side.index()];
        rim(bones.hip(side), side, &frame.local(side, head.center), head)
    };
    Ok(Detected {
        landmarks,
        rims: [rim(Side::Left)?, rim(Side::Right)?],
        heads,
        pubic_tubercles: [tubercles[0], tubercles[1]],
        ischial_spines: [spines[0], spines[1]],
    })
}

/// What is found on a hip bone.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mark {
    Landmark(Landmark),
    PubicTubercle,
    IschialSpine,
}

type Finding = (Mark, Side, Result<Spot, DetectError>);

/// Everything but the foramen's corners, on both sides.
fn on_bones(bones: &BoneSurfaces, frame: &PelvicFrame, heads: &[Head; 2]) -> Vec<Finding> {
    let faces = Side::BOTH.map(|side| face_ends(bones, frame, side));
    let midline = match &faces {
        [Ok(left), Ok(right)] => nalgebra::center(&left.superior.point, &right.superior.point),
        // The symphysis' own error comes before what depends on it.
        _ => nalgebra::center(&frame.pubis[0], &frame.pubis[1]),
    };
    let mut list: Vec<Finding> = Vec::new();
    for (side, face) in Side::BOTH.into_iter().zip(faces) {
        match face {
            Ok(FaceEnds { superior, inferior }) => {
                list.push((Mark::Landmark(Landmark::Sps), side, Ok(superior)));
                list.push((Mark::Landmark(Landmark::Ips), side, Ok(inferior)));
            }
            Err(error) => list.push((Mark::Landmark(Landmark::Sps), side, Err(error))),
        }
    }
    for side in Side::BOTH {
        let (hip, head) = (bones.hip(side), &heads[side.index()]);
        let local = frame.local(side, head.center);
        let ilium = &frame.ilium[side.index()];
        let found = prominences(hip, side, &local, head, ilium, &midline, frame.width());
        let notch = match &found.ischial_spine {
            Ok(spine) => {
                let notch = greater_sciatic_notch(hip, side, &local, head.radius_mm, &spine.point);
                Some(notch)
            }
            Err(_) => None,
        };
        list.push((Mark::Landmark(Landmark::Asis), side, found.asis));
        list.push((Mark::Landmark(Landmark::Aiis), side, found.aiis));
        list.push((Mark::PubicTubercle, side, found.pubic_tubercle));
        list.push((Mark::IschialSpine, side, found.ischial_spine));
        list.extend(notch.map(|notch| (Mark::Landmark(Landmark::Gsn), side, notch)));
    }
    list
}

/// The foramina's corners in the view whose columns and rows lie along two unit directions, left and
/// superior.
fn corners(bones: &BoneSurfaces, [left, superior]: [Vector; 2]) -> Vec<Finding> {
    let mut list: Vec<Finding> = Vec::new();
    for side in Side::BOTH {
        let lateral = left * side.lateral_sign();
        match foramen_corners(bones.hip(side), side, lateral, superior) {
            Ok(corners) => {
                list.push((Mark::Landmark(Landmark::Mof), side, corners.medial));
                list.push((Mark::Landmark(Landmark::Iof), side, corners.inferior));
            }
            Err(error) => list.push((Mark::Landmark(Landmark::Mof), side, Err(error))),
        }
    }
    list
}

/// How far each mark moves (mm) when directions turn, over all three axes.
fn moves(
    bones: &BoneSurfaces,
    frame: &PelvicFrame,
    heads: &[Head; 2],
    app_axes: [Vector; 2],
    marks: &[(Mark, Side, Spot)],
) -> Vec<f64> {
    let mut squares = vec![0.0; marks.len()];
    for axis in frame.axes() {
        for sign in [-1.0, 1.0] {
            let angle = sign * TURN_DEG.to_radians();
            let turn = Rotation3::from_axis_angle(&Unit::new_unchecked(axis), angle);
            let mut again = on_bones(bones, &frame.turned(&turn), heads);
            again.extend(corners(bones, app_axes.map(|axis| turn * axis)));
            for ((mark, side, spot), square) in marks.iter().zip(&mut squares) {
                let same = again.iter().find(|(m, s, _)| m == mark && s == side);
                let moved = match same {
                    Some((_, _, Ok(other))) => (other.point - spot.point).norm_squared(),
                    _ => LOST_MM * LOST_MM,
                };
                *square += moved / 2.0;
            }
        }
    }
    squares.into_iter().map(f64::sqrt).collect()
}

//! The landmarks and rims of a pelvis.

use super::foramen::foramen_corners;
use super::head::femoral_head;
use super::missing::{Missing, Place};
use super::notch::greater_sciatic_notch;
use super::pelvic_frame::{PelvicFrame, pelvic_frame};
use super::prominence::prominences;
use super::rim::{rim, socket_axis};
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

/// What was found on the bones of one specimen, in their world (LPS, mm), and why the rest was not.
/// Pairs are by [`Side::index`]. Landmarks and rims carry their uncertainties.
#[derive(Clone, Debug)]
pub struct Detected {
    pub landmarks: Landmarks,
    /// Each rim's trace: from superior by the front, steps of 3 mm at most.
    pub rims: [Option<Rim>; 2],
    /// Heads whose sphere was found, and those of [`detect_with`] about a given centre.
    pub heads: [Option<Head>; 2],
    /// Not a landmark of a specimen; found for comparison with other people's.
    pub pubic_tubercles: [Option<Extra>; 2],
    /// Not a landmark of a specimen; found for comparison with other people's.
    pub ischial_spines: [Option<Extra>; 2],
    /// Each landmark and rim that is not above: landmarks in the order of files, then rims.
    pub missing: Vec<Missing>,
}

/// A place that is no landmark of a specimen (LPS, mm).
#[derive(Clone, Copy, Debug)]
pub struct Extra {
    pub point: Point,
    /// As of [`Provenance`].
    pub uncertainty_mm: f64,
}

/// Finds landmarks and rims, each with its uncertainty. What is not found does not keep what does not
/// rest on it from being found.
///
/// The uncertainty of a landmark on bone is a standard deviation over all axes, from two parts that
/// the bone itself tells: how far its place moves when the directions turn by [`TURN_DEG`] about each
/// axis, and how far from it bone still meets the rule to within a millimetre ([`Spot::flat_mm`]):
/// `sqrt(sum over axes of (d+^2 + d-^2) / 2 + flat^2)`. That of a femoral head's centre is the
/// jackknife's over sectors of the sphere, that of a rim how far it moves with the point from which it
/// is seen.
///
/// # Errors
/// When the hip bones give no pelvic frame, on which everything rests.
pub fn detect(bones: &BoneSurfaces) -> Result<Detected, DetectError> {
    detect_with(bones, &Landmarks::default())
}

/// As [`detect`], with landmarks (LPS, mm) that people placed to start from where the rules find none:
/// a femoral head whose sphere was not found lies about its given centre and is as large as the other
/// one, and the AP view of the foramina may rest on given landmarks. What is found stays the same.
///
/// # Errors
/// As [`detect`].
pub fn detect_with(bones: &BoneSurfaces, given: &Landmarks) -> Result<Detected, DetectError> {
    let frame = pelvic_frame(bones)?;
    let mut landmarks = Landmarks::default();
    let mut missing = Vec::new();
    let spheres = Side::BOTH.map(|side| {
        let local = frame.local(side, frame.ilium[side.index()]);
        // A femur without a head has other round places.
        let in_socket = |head: &Head| match socket_axis(bones.hip(side), head) {
            Some(_) => Ok(()),
            None => Err(DetectError::NotFound {
                what: "femoral head",
                side,
                reason: format!(
                    "the best sphere, of {:.0} mm radius, lies in no socket; is the head whole?",
                    head.radius_mm
                ),
            }),
        };
        let found = femoral_head(bones.femur(side), side, &local);
        match found.and_then(|head| in_socket(&head).map(|()| head)) {
            Ok(head) => {
                let from = Provenance::detected(head.uncertainty_mm);
                landmarks.set_with(Landmark::Fh, side, head.center, from);
                Some(head)
            }
            Err(error) => {
                missing.push(Missing::new(Place::Landmark(Landmark::Fh), side, error));
                None
            }
        }
    });
    let heads = Side::BOTH.map(|side| {
        spheres[side.index()].or_else(|| {
            let center = given.get(Landmark::Fh, side)?;
            Some(spheres[side.opposite().index()]?.about(center))
        })
    });
    let mut marks = Vec::new();
    let mut take = |findings: Vec<Finding>, landmarks: &mut Landmarks| {
        for (mark, side, spot) in findings {
            match (spot, mark) {
                (Ok(spot), _) => {
                    if let Mark::Landmark(landmark) = mark {
                        landmarks.set(landmark, side, spot.point);
                    }
                    marks.push((mark, side, spot));
                }
                (Err(error), Mark::Landmark(landmark)) => {
                    missing.push(Missing::new(Place::Landmark(landmark), side, error));
                }
                // No specimen wants it.
                (Err(_), Mark::PubicTubercle | Mark::IschialSpine) => {}
            }
        }
    };
    take(on_bones(bones, &frame, &heads), &mut landmarks);
    // The foramen's corners are those of an AP view, which the landmarks so far define.
    let app_axes = app_axes(&landmarks, given);
    take(corners(bones, &app_axes), &mut landmarks);

    let moved = moves(bones, &frame, &heads, &app_axes, &marks);
    let (mut pubic_tubercles, mut ischial_spines) = ([None; 2], [None; 2]);
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
            Mark::PubicTubercle => pubic_tubercles[side.index()] = Some(extra),
            Mark::IschialSpine => ischial_spines[side.index()] = Some(extra),
        }
    }
    let rims = Side::BOTH.map(|side| {
        let found = match &heads[side.index()] {
            Some(head) => rim(bones.hip(side), side, &frame.local(side, head.center), head),
            None => Err(rests_on_head("acetabular rim", side)),
        };
        found
            .map_err(|error| missing.push(Missing::new(Place::Rim, side, error)))
            .ok()
    });
    missing.sort_by_key(|missing| (missing.place, missing.side));
    Ok(Detected {
        landmarks,
        rims,
        heads,
        pubic_tubercles,
        ischial_spines,
        missing,
    })
}

/// The directions left and superior of the AP view, or what it lacks: a landmark neither found nor given.
fn app_axes(found: &Landmarks, given: &Landmarks) -> Result<[Vector; 2], String> {
    let mut ground = given.clone();
    ground.set_all(found);
    let keys = [Landmark::Asis, Landmark::Ips].map(|l| Side::BOTH.map(|s| (l, s)));
    let absent = keys.as_flattened().iter();
    let absent = absent.filter(|(landmark, side)| ground.get(*landmark, *side).is_none());
    let absent: Vec<String> = absent.map(|(l, side)| l.key(*side)).collect();
    if !absent.is_empty() {
        return Err(format!("{} of the AP view", absent.join(", ")));
    }
    let app = app_from_volume(&ground, &Point::origin());
    let app = app.map_err(|error| format!("the AP view ({error})"))?;
    Ok([Vector::x(), Vector::y()].map(|axis| app.rotation.inverse() * axis))
}

fn rests_on_head(what: &'static str, side: Side) -> DetectError {
    let on = format!("the {side} femoral head ({})", Landmark::Fh.key(side));
    DetectError::Rests { what, side, on }
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
fn on_bones(bones: &BoneSurfaces, frame: &PelvicFrame, heads: &[Option<Head>; 2]) -> Vec<Finding> {
    let faces = Side::BOTH.map(|side| face_ends(bones, frame, side));
    let midline = match &faces {
        [Ok(left), Ok(right)] => nalgebra::center(&left.superior.point, &right.superior.point),
        _ => nalgebra::center(&frame.pubis[0], &frame.pubis[1]),
    };
    let mut list: Vec<Finding> = Vec::new();
    for (side, face) in Side::BOTH.into_iter().zip(faces) {
        let (superior, inferior) = match face {
            Ok(FaceEnds { superior, inferior }) => (Ok(superior), Ok(inferior)),
            Err(error) => (Err(error.clone()), Err(error)),
        };
        list.push((Mark::Landmark(Landmark::Sps), side, superior));
        list.push((Mark::Landmark(Landmark::Ips), side, inferior));
    }
    for side in Side::BOTH {
        let Some(head) = &heads[side.index()] else {
            for (what, landmark) in [
                ("anterior superior iliac spine", Landmark::Asis),
                ("anterior inferior iliac spine", Landmark::Aiis),
                ("greater sciatic notch", Landmark::Gsn),
            ] {
                let error = rests_on_head(what, side);
                list.push((Mark::Landmark(landmark), side, Err(error)));
            }
            continue;
        };
        let hip = bones.hip(side);
        let local = frame.local(side, head.center);
        let ilium = &frame.ilium[side.index()];
        let found = prominences(hip, side, &local, head, ilium, &midline, frame.width());
        let notch = match &found.ischial_spine {
            Ok(spine) => greater_sciatic_notch(hip, side, &local, head.radius_mm, &spine.point),
            Err(error) => Err(DetectError::Rests {
                what: "greater sciatic notch",
                side,
                on: error.to_string(),
            }),
        };
        list.push((Mark::Landmark(Landmark::Asis), side, found.asis));
        list.push((Mark::Landmark(Landmark::Aiis), side, found.aiis));
        list.push((Mark::PubicTubercle, side, found.pubic_tubercle));
        list.push((Mark::IschialSpine, side, found.ischial_spine));
        list.push((Mark::Landmark(Landmark::Gsn), side, notch));
    }
    list
}

/// The foramina's corners in the view whose columns and rows lie along two unit directions, left and
/// superior.
fn corners(bones: &BoneSurfaces, axes: &Result<[Vector; 2], String>) -> Vec<Finding> {
    let mut list: Vec<Finding> = Vec::new();
    for side in Side::BOTH {
        let found = match axes {
            Ok([left, superior]) => {
                let lateral = left * side.lateral_sign();
                foramen_corners(bones.hip(side), side, lateral, *superior)
            }
            Err(on) => Err(DetectError::Rests {
                what: "obturator foramen",
                side,
                on: on.clone(),
            }),
        };
        let (medial, inferior) = match found {
            Ok(corners) => (corners.medial, corners.inferior),
            Err(error) => (Err(error.clone()), Err(error)),
        };
        list.push((Mark::Landmark(Landmark::Mof), side, medial));
        list.push((Mark::Landmark(Landmark::Iof), side, inferior));
    }
    list
}

/// How far each mark moves (mm) when directions turn, over all three axes.
fn moves(
    bones: &BoneSurfaces,
    frame: &PelvicFrame,
    heads: &[Option<Head>; 2],
    app_axes: &Result<[Vector; 2], String>,
    marks: &[(Mark, Side, Spot)],
) -> Vec<f64> {
    let mut squares = vec![0.0; marks.len()];
    for axis in frame.axes() {
        for sign in [-1.0, 1.0] {
            let angle = sign * TURN_DEG.to_radians();
            let turn = Rotation3::from_axis_angle(&Unit::new_unchecked(axis), angle);
            let mut again = on_bones(bones, &frame.turned(&turn), heads);
            let app_axes = app_axes.clone().map(|axes| axes.map(|axis| turn * axis));
            again.extend(corners(bones, &app_axes));
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

//! Bony prominences: the tip of a region in one direction.

use super::local::{Local, forward};
use super::spot::{Spot, tip};
use super::{DetectError, Head};
use crate::anatomy::Side;
use crate::geometry::{Point, Vector};
use crate::volume::Surface;

/// An extreme point nearer than this to the end of its region is no prominence but the place where
/// the region was cut (mm).
const BORDER_MM: f64 = 0.5;

/// The prominences of one hip bone, in the world (LPS, mm).
#[derive(Debug)]
pub(super) struct Prominences {
    pub asis: Result<Spot, DetectError>,
    pub aiis: Result<Spot, DetectError>,
    pub pubic_tubercle: Result<Spot, DetectError>,
    pub ischial_spine: Result<Spot, DetectError>,
}

/// Finds the prominences of a hip bone. The directions are anatomical (spines and tubercle look
/// forward, a little outward and downward; the ischial spine looks back and inward, a little upward) and lie in the middle of
/// a range of 10 deg or more over which the points hardly move.
///
/// `local` has its origin at the femoral head's centre; `ilium` is the most anterior point of the
/// ilium, `midline` a point of the symphysis, `width_mm` the distance between both ilia's most
/// anterior points.
pub(super) fn prominences(
    hip: &Surface,
    side: Side,
    local: &Local,
    head: &Head,
    ilium: &Point,
    midline: &Point,
    width_mm: f64,
) -> Prominences {
    let radius_mm = head.radius_mm;
    let front = local.coordinates(ilium);
    let symphysis = local.coordinates(midline);
    let find = |what, direction, region: &dyn Fn(&Vector) -> f64| -> Result<Spot, DetectError> {
        extreme(hip, local, direction, region).ok_or(DetectError::NotFound {
            what,
            side,
            reason: "the bone has no prominence where it is expected".into(),
        })
    };
    Prominences {
        asis: find(
            "anterior superior iliac spine",
            forward(10.0, -10.0),
            &|p| (p.y - front.y / 2.0).min(p.z),
        ),
        // Between the roof of the socket and the notch below the superior spine.
        aiis: find(
            "anterior inferior iliac spine",
            forward(15.0, -15.0),
            &|p| (p.y - radius_mm).min(0.65 * front.y - p.y).min(p.z),
        ),
        // On the body of the pubic bone: a fifth of the pelvis' width on either side.
        pubic_tubercle: find("pubic tubercle", forward(20.0, -20.0), &|p| {
            (symphysis.x + 0.2 * width_mm - p.x).min(symphysis.y + 15.0 - p.y)
        }),
        ischial_spine: find("ischial spine", forward(-30.0, 170.0), &|p| {
            (radius_mm - p.y.abs()).min(-p.z)
        }),
    }
}

/// The tip along `direction` of the bone for which `region`, the distance from the region's border (mm), is
/// positive; `None` when its foremost vertex lies at the border.
fn extreme(
    hip: &Surface,
    local: &Local,
    direction: Vector,
    region: &dyn Fn(&Vector) -> f64,
) -> Option<Spot> {
    let eligible = |p: &Point| region(&local.coordinates(p)) > 0.0;
    let tip = tip(hip, &local.direction(&direction), eligible)?;
    let inside = region(&local.coordinates(&hip.vertices()[tip.foremost]));
    (inside > BORDER_MM).then_some(tip.spot)
}

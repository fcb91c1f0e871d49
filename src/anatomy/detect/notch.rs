//! The greater sciatic notch.

use super::spot::{FLAT_MM, Spot, middle, nearness, rms};
use super::{DetectError, local::Local, outline::Outline};
use crate::anatomy::Side;
use crate::geometry::Point;
use crate::volume::Surface;
use nalgebra::{Vector1, Vector2};

/// The chord is walked in steps of about this (mm).
const STEP_MM: f64 = 0.25;

/// How much less deep the edge may be to count for the notch's bottom (mm).
const BOTTOM_MM: f64 = 3.0;

/// The bottom of the greater sciatic notch, seen from the side: the middle of the edge that lies nearly as far as any
/// from the chord between the ischial spine and the posterior inferior end of the ilium.
///
/// `local` has its origin at the femoral head's centre.
pub(super) fn greater_sciatic_notch(
    hip: &Surface,
    side: Side,
    local: &Local,
    radius_mm: f64,
    ischial_spine: &Point,
) -> Result<Spot, DetectError> {
    let not_found = |reason: &str| DetectError::NotFound {
        what: "greater sciatic notch",
        side,
        reason: reason.into(),
    };
    // The ilium's end: where a line turned up from behind about the spine first meets it.
    let spine = local.coordinates(ischial_spine);
    let elevation = |p: &Point| {
        let c = local.coordinates(p) - spine;
        c.y.atan2(-c.z)
    };
    let ilium = hip
        .vertices()
        .iter()
        .filter(|p| {
            let c = local.coordinates(p);
            c.y > radius_mm && c.z < spine.z
        })
        .min_by(|a, b| elevation(a).total_cmp(&elevation(b)))
        .ok_or_else(|| not_found("no part of the ilium lies behind the ischial spine"))?;
    let [_, superior, anterior] = local.axes;
    let outline = Outline::new(hip, local.origin, anterior, superior);
    let flat = |p: &Point| {
        let c = local.coordinates(p);
        Vector2::new(c.z, c.y)
    };
    let (low, high) = (flat(ischial_spine), flat(ilium));
    let along = high - low;
    let forward = Vector2::new(along.y, -along.x).normalize();
    // (depth, how far along the chord, place on the edge)
    let mut edge: Vec<(f64, Vector1<f64>, Vector2<f64>)> = Vec::new();
    let steps = (along.norm() / STEP_MM).ceil();
    for step in (steps * 0.05) as usize..=(steps * 0.95) as usize {
        let part = step as f64 / steps;
        let start = low + along * part;
        if outline.covered(&start) {
            continue;
        }
        let depth = outline
            .distance(&start, &forward, 150.0)
            .ok_or_else(|| not_found("nothing closes it in front"))?;
        edge.push((depth, Vector1::new(part), start + forward * depth));
    }
    let depth = edge.iter().map(|e| e.0).fold(f64::MIN, f64::max);
    let bottom = middle(edge.iter().map(|e| (e.1, nearness(depth - e.0, BOTTOM_MM))));
    let bottom =
        bottom.ok_or_else(|| not_found("bone fills it between ischial spine and ilium"))?;
    let apart = |e: &(f64, Vector1<f64>, Vector2<f64>)| (e.1 - bottom).x.abs();
    let deepest = edge.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
    let point = deepest.and_then(|e| outline.surface_point(&e.2, &forward));
    let point = point.ok_or_else(|| not_found("its edge could not be met"))?;
    let as_deep = edge.iter().filter(|e| e.0 >= depth - FLAT_MM);
    let squares = as_deep.map(|e| (along * (e.1 - bottom).x).norm_squared());
    let flat_mm = rms(squares);
    Ok(Spot { point, flat_mm })
}

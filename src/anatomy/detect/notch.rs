//! The greater sciatic notch.

use super::spot::{FLAT_MM, Spot, rms};
use super::{DetectError, local::Local, outline::Outline};
use crate::anatomy::Side;
use crate::geometry::Point;
use crate::volume::Surface;
use nalgebra::Vector2;

/// The deepest point of the greater sciatic notch, seen from the side: the edge point farthest
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
    let mut edge: Vec<(f64, Vector2<f64>)> = Vec::new();
    for percent in 5..=95 {
        let start = low + along * (f64::from(percent) / 100.0);
        if outline.covered(&start) {
            continue;
        }
        let depth = outline
            .distance(&start, &forward, 150.0)
            .ok_or_else(|| not_found("nothing closes it in front"))?;
        edge.push((depth, start + forward * depth));
    }
    // The first of equally deep ones.
    let &(depth, deepest) = edge
        .iter()
        .rev()
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .ok_or_else(|| not_found("bone fills it between ischial spine and ilium"))?;
    let as_deep = edge.iter().filter(|e| e.0 >= depth - FLAT_MM);
    let flat_mm = rms(as_deep.map(|e| (e.1 - deepest).norm_squared()));
    outline
        .surface_point(&(deepest + forward * 0.4))
        .map(|point| Spot { point, flat_mm })
        .ok_or_else(|| not_found("its edge could not be met"))
}

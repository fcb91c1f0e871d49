//! The pubic symphysis.

use super::spot::{FLAT_MM, Spot, middle, nearness};
use super::{BoneSurfaces, DetectError, pelvic_frame::PelvicFrame};
use crate::anatomy::Side;
use crate::geometry::Vector;

/// Bone belongs to a face wholly where the gap to the other bone is wider by the first than where it is
/// narrow, and not at all beyond the second (mm). A sharp limit would make the face's ends jump.
const WIDER_MM: (f64, f64) = (2.0, 6.0);

/// The joint is narrow where this much of its face lies nearest the other bone (mm^2): a tenth of a face. One
/// narrowest place would hang on one voxel.
const NARROW_MM2: f64 = 150.0;

/// Bone belongs to a face not at all below the first cosine of its normal with medial, wholly above the second.
const FACING: (f64, f64) = (0.3, 0.7);

/// A face ends where this much of it lies beyond (mm^2).
const END_MM2: f64 = 5.0;

/// How far from a face's end bone counts for the end's middle (mm).
const END_DEPTH_MM: f64 = 6.0;

/// Only this far from the midline are faces searched (mm).
const NEAR_MM: f64 = 40.0;

/// The ends of one pubic bone's symphyseal face, in the world (LPS, mm).
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceEnds {
    pub superior: Spot,
    pub inferior: Spot,
}

/// The upper and lower end of one symphyseal face along its long axis.
pub(super) fn face_ends(
    bones: &BoneSurfaces,
    frame: &PelvicFrame,
    side: Side,
) -> Result<FaceEnds, DetectError> {
    let hip = bones.hip(side);
    let other = bones.hip(side.opposite());
    let local = frame.local(side, nalgebra::center(&frame.pubis[0], &frame.pubis[1]));
    let not_found = |reason: String| DetectError::NotFound {
        what: "symphyseal face of the pubic bone",
        side,
        reason,
    };
    let facing = |v: usize| -hip.normals()[v].dot(&local.axes[0]);
    // (distance to the other bone, vertex) of all that might belong to the face, the nearest first.
    let mut near: Vec<(f64, usize)> = Vec::new();
    for (v, point) in hip.vertices().iter().enumerate() {
        let p = local.coordinates(point);
        if p.norm() < 2.0 * NEAR_MM && p.x.abs() < NEAR_MM && facing(v) > FACING.0 {
            let (closest, _) = other
                .closest_point(point)
                .ok_or_else(|| not_found("the other hip bone is empty".into()))?;
            near.push(((closest - point).norm(), v));
        }
    }
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let areas = hip.vertex_areas();
    let with_area = near.iter().map(|&(distance, v)| (distance, areas[v]));
    let gap = beyond(with_area, NARROW_MM2).unwrap_or(0.0);
    // Where the face's parts lie, and the area of each that belongs to it.
    let face: Vec<(Vector, f64)> = near
        .iter()
        .map(|&(distance, v)| {
            let close = rising(gap - distance, (-WIDER_MM.1, -WIDER_MM.0));
            let share = close * rising(facing(v), FACING);
            (local.coordinates(&hip.vertices()[v]), share * areas[v])
        })
        .filter(|part| part.1 > 0.0)
        .collect();
    if face.len() < 20 {
        return Err(not_found(format!(
            "only {} vertices face the other bone ({gap:.1} mm away)",
            face.len()
        )));
    }
    let mean = middle(face.iter().copied()).unwrap_or_default();
    // The long axis in the sagittal plane, by the angle of the 2 x 2 covariance.
    let (mut yy, mut yz, mut zz) = (0.0, 0.0, 0.0);
    for (p, area) in &face {
        let d = p - mean;
        yy += area * d.y * d.y;
        yz += area * d.y * d.z;
        zz += area * d.z * d.z;
    }
    let angle = 0.5 * (2.0 * yz).atan2(yy - zz);
    let axis = Vector::new(0.0, angle.cos(), angle.sin());
    let end = |sign: f64| -> Option<Spot> {
        let reach = |p: &Vector| sign * (p - mean).dot(&axis);
        let mut outer: Vec<(f64, f64)> = face.iter().map(|(p, area)| (reach(p), *area)).collect();
        outer.sort_by(|a, b| b.0.total_cmp(&a.0));
        let last = beyond(outer.into_iter(), END_MM2)?;
        let near_end = |(p, area): &(Vector, f64)| {
            let weight = area * nearness(last - reach(p), END_DEPTH_MM);
            (*p, weight)
        };
        let middle = middle(face.iter().map(near_end))?;
        let at = middle + axis * (sign * (last - reach(&middle)));
        let (point, _) = hip.closest_point(&local.point(&at))?;
        let as_far = face.iter().filter(|(p, _)| reach(p) >= last - FLAT_MM);
        let as_far = as_far.map(|(p, area)| (local.point(p), *area));
        Some(Spot::among(point, as_far))
    };
    match (end(1.0), end(-1.0)) {
        (Some(superior), Some(inferior)) => Ok(FaceEnds { superior, inferior }),
        _ => Err(not_found("its face is empty".into())),
    }
}

/// The value at which the areas of (value, area) before it add up to `area`; the last one if they never do.
fn beyond(parts: impl Iterator<Item = (f64, f64)>, area: f64) -> Option<f64> {
    let mut sum = 0.0;
    let mut value = None;
    for (next, part) in parts {
        value = Some(next);
        sum += part;
        if sum >= area {
            break;
        }
    }
    value
}

/// 0 below a range, 1 above it, linear between.
fn rising(value: f64, (low, high): (f64, f64)) -> f64 {
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}

//! The pubic symphysis.

use super::spot::{FLAT_MM, Spot};
use super::{BoneSurfaces, DetectError, pelvic_frame::PelvicFrame};
use crate::anatomy::Side;
use crate::geometry::{Point, Vector};

/// The face of a pubic bone reaches as far as the gap to the other bone is at most this much wider
/// than where it is narrowest (mm).
const FACE_DEPTH_MM: f64 = 4.0;

/// A face looks to the other side at least this much (cosine).
const FACING: f64 = 0.5;

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
    // (distance to the other bone, vertex) of all that might belong to the face.
    let mut near: Vec<(f64, usize)> = Vec::new();
    for (v, point) in hip.vertices().iter().enumerate() {
        let p = local.coordinates(point);
        let facing = -hip.normals()[v].dot(&local.axes[0]);
        if p.norm() < 2.0 * NEAR_MM && p.x.abs() < NEAR_MM && facing > FACING {
            let (closest, _) = other
                .closest_point(point)
                .ok_or_else(|| not_found("the other hip bone is empty".into()))?;
            near.push(((closest - point).norm(), v));
        }
    }
    let gap = near.iter().map(|n| n.0).fold(f64::MAX, f64::min);
    let face: Vec<Vector> = near
        .iter()
        .filter(|(d, _)| *d < gap + FACE_DEPTH_MM)
        .map(|&(_, v)| local.coordinates(&hip.vertices()[v]))
        .collect();
    if face.len() < 20 {
        return Err(not_found(format!(
            "only {} vertices face the other bone ({gap:.1} mm away)",
            face.len()
        )));
    }
    let mean: Vector = face.iter().sum::<Vector>() / face.len() as f64;
    // The long axis in the sagittal plane, by the angle of the 2 x 2 covariance.
    let (mut yy, mut yz, mut zz) = (0.0, 0.0, 0.0);
    for p in &face {
        let d = p - mean;
        yy += d.y * d.y;
        yz += d.y * d.z;
        zz += d.z * d.z;
    }
    let angle = 0.5 * (2.0 * yz).atan2(yy - zz);
    let axis = Vector::new(0.0, angle.cos(), angle.sin());
    let reach = |p: &Vector| (p - mean).dot(&axis);
    let end = |sign: f64| -> Option<Spot> {
        let farthest = |p: &&Vector| sign * reach(p);
        let best = face
            .iter()
            .max_by(|a, b| farthest(a).total_cmp(&farthest(b)))?;
        let as_far: Vec<Point> = face
            .iter()
            .filter(|p| farthest(p) >= farthest(&best) - FLAT_MM)
            .map(|p| local.point(p))
            .collect();
        Some(Spot::among(local.point(best), as_far.iter()))
    };
    match (end(1.0), end(-1.0)) {
        (Some(superior), Some(inferior)) => Ok(FaceEnds { superior, inferior }),
        _ => Err(not_found("its face is empty".into())),
    }
}

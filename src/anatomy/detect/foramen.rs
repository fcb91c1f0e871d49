//! The obturator foramen's points of maximal curvature.

use super::closed_curve::{length, resampled, smoothed};
use super::spot::{FLAT_MM, Spot, rms};
use super::{DetectError, outline::Outline};
use crate::anatomy::Side;
use crate::geometry::Vector;
use crate::volume::Surface;
use nalgebra::Vector2;

/// The foramen's edge is described by this many points.
const POINTS: usize = 400;

/// Corners are sought on the edge smoothed by this much (mm): small enough to keep the foramen's
/// three corners, large enough that notches of the edge are none.
const SMOOTHING_MM: f64 = 5.5;

/// How far the edge's outward normal at a corner may point away from medial, or from inferior.
const MEDIAL_WITHIN_DEG: f64 = 50.0;
const INFERIOR_WITHIN_DEG: f64 = 40.0;

/// A smaller hole in the bone's shadow is no foramen (mm^2).
const MIN_AREA_MM2: f64 = 100.0;

/// The two corners, in the world (LPS, mm).
#[derive(Debug)]
pub(super) struct ForamenCorners {
    pub medial: Result<Spot, DetectError>,
    pub inferior: Result<Spot, DetectError>,
}

/// The points of maximal curvature on the medial and on the inferior part of the foramen's edge as
/// an AP view shows it, where they are picked (the paper's section on initialization).
///
/// `lateral` and `superior` are the unit world directions of the AP view.
pub(super) fn foramen_corners(
    hip: &Surface,
    side: Side,
    lateral: Vector,
    superior: Vector,
) -> Result<ForamenCorners, DetectError> {
    let not_found = |what, reason: String| DetectError::NotFound { what, side, reason };
    let no_hole = || {
        not_found(
            "obturator foramen",
            "the AP view of the hip bone shows no hole".into(),
        )
    };
    let origin = *hip.vertices().first().ok_or_else(no_hole)?;
    let outline = Outline::new(hip, origin, lateral, superior);
    let (center, area) = outline.largest_hole().ok_or_else(no_hole)?;
    if area < MIN_AREA_MM2 {
        return Err(no_hole());
    }
    let edge = edge(&outline, &center).ok_or_else(no_hole)?;
    let smooth = smoothed(&edge, SMOOTHING_MM * POINTS as f64 / length(&edge));
    let corner = |what, toward: Vector2<f64>, within_deg: f64| {
        sharpest(&smooth, &toward, within_deg)
            .and_then(|i| {
                let outward = (edge[i] - center).normalize();
                let point = outline.surface_point(&(edge[i] + outward * 0.4))?;
                let flat_mm = blunt(&smooth, i);
                Some(Spot { point, flat_mm })
            })
            .ok_or_else(|| not_found(what, "the foramen's edge has no corner there".into()))
    };
    Ok(ForamenCorners {
        medial: corner(
            "medial corner of the obturator foramen",
            Vector2::new(-1.0, 0.0),
            MEDIAL_WITHIN_DEG,
        ),
        inferior: corner(
            "inferior corner of the obturator foramen",
            Vector2::new(0.0, -1.0),
            INFERIOR_WITHIN_DEG,
        ),
    })
}

/// The hole's edge, anticlockwise in (u, v), in equal steps.
fn edge(outline: &Outline, center: &Vector2<f64>) -> Option<Vec<Vector2<f64>>> {
    let around: Option<Vec<Vector2<f64>>> = (0..360)
        .map(|degree| {
            let (sin, cos) = f64::from(degree).to_radians().sin_cos();
            let direction = Vector2::new(cos, sin);
            let r = outline.distance(center, &direction, 100.0)?;
            Some(center + direction * r)
        })
        .collect();
    around.map(|points| resampled(&points, POINTS))
}

/// Root mean square distance to the points on either side of a corner that reach as far outward to
/// within [`FLAT_MM`].
fn blunt(curve: &[Vector2<f64>], corner: usize) -> f64 {
    let n = curve.len();
    let tangent = curve[(corner + 1) % n] - curve[(corner + n - 1) % n];
    let outward = Vector2::new(tangent.y, -tangent.x).normalize();
    let arm = |k: usize| curve[(corner + k) % n] - curve[corner];
    let as_far = |k: &usize| arm(*k).dot(&outward).abs() <= FLAT_MM;
    let forward = (0..n / 2).take_while(as_far);
    let back = (1..n / 2).map(|k| n - k).take_while(as_far);
    rms(forward.chain(back).map(|k| arm(k).norm_squared()))
}

/// The local maximum of curvature that is largest among those whose outward normal points
/// `toward` within an angle.
fn sharpest(curve: &[Vector2<f64>], toward: &Vector2<f64>, within_deg: f64) -> Option<usize> {
    let n = curve.len();
    let step = |i: usize, k: isize| curve[(i as isize + k).rem_euclid(n as isize) as usize];
    let curvature: Vec<f64> = (0..n)
        .map(|i| {
            let first = (step(i, 1) - step(i, -1)) / 2.0;
            let second = step(i, 1) - step(i, 0) * 2.0 + step(i, -1);
            (first.x * second.y - first.y * second.x) / first.norm().powi(3)
        })
        .collect();
    (0..n)
        .filter(|&i| {
            let tangent = (step(i, 1) - step(i, -1)).normalize();
            let outward = Vector2::new(tangent.y, -tangent.x);
            let peak = curvature[i] > 0.0
                && curvature[i] > curvature[(i + n - 1) % n]
                && curvature[i] >= curvature[(i + 1) % n];
            peak && outward.dot(toward) > within_deg.to_radians().cos()
        })
        .max_by(|&a, &b| curvature[a].total_cmp(&curvature[b]))
}

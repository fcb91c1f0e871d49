//! The obturator foramen's points of maximal curvature.

use super::closed_curve::{length, resampled, smoothed};
use super::spot::{FLAT_MM, Spot, middle, rms};
use super::{DetectError, outline::Outline};
use crate::anatomy::Side;
use crate::geometry::Vector;
use crate::volume::Surface;
use nalgebra::{Vector1, Vector2};

/// The foramen's edge is described by this many points.
const POINTS: usize = 400;

/// Corners are sought on the edge smoothed by this much (mm): small enough to keep the foramen's
/// three corners, large enough that notches of the edge are none. The others, a fifth less and more, tell
/// how sure a corner is.
const SMOOTHINGS_MM: [f64; 3] = [5.5, 4.4, 6.6];

/// The part of the edge whose outward normal points medially, or inferiorly, within about this (standard
/// deviation of a Gaussian, deg) gives a corner's middle. With 35 and more, thick slices let it run into the
/// next corner.
const TOWARD_DEG: f64 = 25.0;

/// How far the edge's outward normal at a corner may point away from medial, or from inferior.
const MEDIAL_WITHIN_DEG: f64 = 50.0;
const INFERIOR_WITHIN_DEG: f64 = 40.0;

/// A corner with this share of the sharpest one's curvature might as well have been taken.
const RIVAL: f64 = 0.8;

/// A smaller hole in the bone's shadow is no foramen (mm^2).
const MIN_AREA_MM2: f64 = 100.0;

/// The two corners, in the world (LPS, mm).
#[derive(Debug)]
pub(super) struct ForamenCorners {
    pub medial: Result<Spot, DetectError>,
    pub inferior: Result<Spot, DetectError>,
}

/// The corners, places of maximal curvature on the medial and on the inferior part of the foramen's edge as
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
    let smooth = SMOOTHINGS_MM.map(|mm| smoothed(&edge, mm * POINTS as f64 / length(&edge)));
    let corner = |what, toward: Vector2<f64>, within_deg: f64| {
        let corners = smooth
            .each_ref()
            .map(|curve| sharpest(curve, &toward, within_deg));
        let best = corners[0].first().and_then(|_| {
            let at = corner_middle(&smooth[0], &toward)?;
            let (i, part) = (at as usize % POINTS, at.fract());
            let at = edge[i].lerp(&edge[(i + 1) % POINTS], part);
            let outward = (at - center).normalize();
            let point = outline.surface_point(&at, &outward)?;
            let as_sharp = smooth.iter().zip(&corners);
            let as_sharp = as_sharp.flat_map(|(curve, corners)| blunt(curve, corners));
            let flat_mm = rms(as_sharp.map(|p| (p - smooth[0][i]).norm_squared()));
            Some(Spot { point, flat_mm })
        });
        best.ok_or_else(|| not_found(what, "the foramen's edge has no corner there".into()))
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

/// The points on either side of any of the corners that reach as far outward to within [`FLAT_MM`].
fn blunt(curve: &[Vector2<f64>], corners: &[usize]) -> Vec<Vector2<f64>> {
    let n = curve.len();
    let around = |&corner: &usize| {
        let tangent = curve[(corner + 1) % n] - curve[(corner + n - 1) % n];
        let outward = Vector2::new(tangent.y, -tangent.x).normalize();
        let as_far = move |p: &Vector2<f64>| (p - curve[corner]).dot(&outward).abs() <= FLAT_MM;
        let at = move |k: usize| curve[(corner + k) % n];
        let forward = (0..n / 2).map(at).take_while(as_far);
        let back = (1..n / 2).map(move |k| at(n - k)).take_while(as_far);
        forward.chain(back).collect::<Vec<_>>()
    };
    corners.iter().flat_map(around).collect()
}

/// Where, in steps along the edge, its curvature toward a direction has its middle. A rounded corner, or one
/// that a notch divides, has several points of nearly maximal curvature; which is the sharpest is chance.
fn corner_middle(curve: &[Vector2<f64>], toward: &Vector2<f64>) -> Option<f64> {
    let n = curve.len();
    let weights: Vec<f64> = bends(curve)
        .map(|(curvature, outward)| {
            let angle = outward.dot(toward).clamp(-1.0, 1.0).acos();
            let off = angle / TOWARD_DEG.to_radians();
            curvature.max(0.0).powi(2) * (-0.5 * off * off).exp()
        })
        .collect();
    let heaviest = (0..n).max_by(|&a, &b| weights[a].total_cmp(&weights[b]))?;
    // A quarter of the edge to either side: the ring is cut where nothing weighs.
    let start = heaviest + n - n / 4;
    let parts = (0..=n / 2).map(|k| (Vector1::new(k as f64), weights[(start + k) % n]));
    let steps = middle(parts)?.x;
    Some((start as f64 + steps).rem_euclid(n as f64))
}

/// Curvature (1/mm, positive where the hole bulges outward) and unit outward normal at each point of an edge.
fn bends(curve: &[Vector2<f64>]) -> impl Iterator<Item = (f64, Vector2<f64>)> + '_ {
    let n = curve.len();
    (0..n).map(move |i| {
        let (before, here, after) = (curve[(i + n - 1) % n], curve[i], curve[(i + 1) % n]);
        let first = (after - before) / 2.0;
        let second = after - here * 2.0 + before;
        let curvature = (first.x * second.y - first.y * second.x) / first.norm().powi(3);
        (curvature, Vector2::new(first.y, -first.x).normalize())
    })
}

/// The local maxima of curvature, the sharpest first, that are nearly as sharp ([`RIVAL`]) among those
/// whose outward normal points `toward` within an angle.
fn sharpest(curve: &[Vector2<f64>], toward: &Vector2<f64>, within_deg: f64) -> Vec<usize> {
    let n = curve.len();
    let (curvature, outward): (Vec<f64>, Vec<_>) = bends(curve).unzip();
    let mut peaks: Vec<usize> = (0..n)
        .filter(|&i| {
            let peak = curvature[i] > 0.0
                && curvature[i] > curvature[(i + n - 1) % n]
                && curvature[i] >= curvature[(i + 1) % n];
            peak && outward[i].dot(toward) > within_deg.to_radians().cos()
        })
        .collect();
    // Of equal ones the last.
    peaks.sort_by(|&a, &b| curvature[b].total_cmp(&curvature[a]).then(b.cmp(&a)));
    let least = RIVAL * peaks.first().map_or(0.0, |&first| curvature[first]);
    peaks.retain(|&i| curvature[i] >= least);
    peaks
}

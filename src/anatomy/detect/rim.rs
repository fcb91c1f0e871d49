//! The acetabular rim.

use super::closed_curve::{length, resampled, smoothed};
use super::landmarks::LOST_MM;
use super::{DetectError, Head, local::Local};
use crate::anatomy::{Provenance, Rim, Side};
use crate::geometry::{Point, Ray, Vector};
use crate::volume::Surface;
use nalgebra::Vector2;
use std::ops::RangeInclusive;

/// Meridians around the socket's axis.
const MERIDIANS: usize = 180;

/// The lower third, in which the acetabular notch lies: meridian 0 points up.
const LOWER: RangeInclusive<usize> = MERIDIANS / 3..=2 * MERIDIANS / 3;

/// Each meridian is searched between these angles from the socket's axis (deg); rims lie at 60 to
/// 105.
const SEARCH_DEG: (f64, f64) = (30.0, 135.0);

/// Step along a meridian before bisection (deg).
const STEP_DEG: f64 = 0.5;

/// Bone within this distance beyond the femoral head's radius belongs to the socket (mm): joint
/// space, the edge's rounding and its deviation from the head's sphere; the fossa's floor, the
/// ischium and the iliac spine lie deeper.
const SOCKET_MM: f64 = 8.0;

/// Bone within this distance beyond the head gives the socket's axis (mm).
const AXIS_MM: f64 = 6.0;

/// How far the eye moves (mm) and the socket's reach changes (mm) for the uncertainty: the sphere's
/// residual, at most, and as much as joint spaces differ.
const EYE_MM: f64 = 1.0;
const REACH_MM: f64 = 2.0;

/// Smoothing along the rim (deg of meridian): about 2 mm.
const SMOOTHING_DEG: f64 = 4.0;

/// The trace's points are at most this far apart (mm).
const STEP_MM: f64 = 2.5;

/// The rim as the head's centre sees it: on each meridian about the socket's axis the farthest
/// visible bone of the socket. Across the acetabular notch the trace runs straight from the tip of
/// one horn to that of the other, as the transverse ligament does.
///
/// `local` has its origin at the head's centre. The trace starts superiorly and runs by the front
/// on either side; points are at most 3 mm apart.
///
/// The uncertainty is the root mean square over the trace's points of how far it moves when the
/// head's centre, from which it is seen, moves [`EYE_MM`] along each axis, and the socket's reach
/// grows or shrinks by [`REACH_MM`]: a sharp edge stays where it is.
pub(super) fn rim(
    hip: &Surface,
    side: Side,
    local: &Local,
    head: &Head,
) -> Result<Rim, DetectError> {
    let points = trace(hip, side, local, head, SOCKET_MM)?;
    let moved = |by: Vector, reach_mm: f64| {
        let mut other = *head;
        other.center += local.direction(&by);
        let seen = trace(hip, side, local, &other, SOCKET_MM + reach_mm);
        seen.map_or(LOST_MM * LOST_MM, |seen| apart(&points, &seen))
    };
    let axes = [Vector::x(), Vector::y(), Vector::z()].map(|v| v * EYE_MM);
    let pairs = axes
        .map(|by| moved(by, 0.0) + moved(-by, 0.0))
        .into_iter()
        .sum::<f64>()
        + moved(Vector::zeros(), REACH_MM)
        + moved(Vector::zeros(), -REACH_MM);
    Ok(Rim::new(points, Provenance::detected((pairs / 2.0).sqrt())))
}

/// Mean square distance of points from a closed line's vertices, which are dense.
fn apart(points: &[Point], line: &[Point]) -> f64 {
    let nearest = |p: &Point| {
        line.iter()
            .map(|q| (q - p).norm_squared())
            .fold(f64::MAX, f64::min)
    };
    points.iter().map(nearest).sum::<f64>() / points.len().max(1) as f64
}

fn trace(
    hip: &Surface,
    side: Side,
    local: &Local,
    head: &Head,
    socket_mm: f64,
) -> Result<Vec<Point>, DetectError> {
    let not_found = |reason: String| DetectError::NotFound {
        what: "acetabular rim",
        side,
        reason,
    };
    let axis = socket_axis(hip, head)
        .ok_or_else(|| not_found("no bone lies close around the femoral head".into()))?;
    let fan = Fan::new(hip, head, axis, local, socket_mm)
        .ok_or_else(|| not_found("the socket's axis points straight up or down".into()))?;
    let mut edge = Vec::with_capacity(MERIDIANS);
    for meridian in 0..MERIDIANS {
        // A meridian through a wide notch may meet no socket at all. It will be bridged, as all of the
        // notch is.
        let notch = LOWER.contains(&meridian).then(|| fan.inmost());
        edge.push(fan.edge(meridian).or(notch).ok_or_else(|| {
            not_found(format!(
                "no socket lies {} deg round from superior",
                2 * meridian
            ))
        })?);
    }
    let edge = without_outliers(&edge);
    let edge = smoothed(&edge, SMOOTHING_DEG * MERIDIANS as f64 / 360.0);
    let points = bridged(&fan, &edge);
    // The bridge meets the horns at an angle, which smoothing rounds.
    let flat: Vec<Vector> = points.iter().map(|p| p - head.center).collect();
    let dense = resampled(&flat, 4 * MERIDIANS);
    let step = length(&dense) / dense.len() as f64;
    let smooth = smoothed(&dense, 1.5 / step);
    let count = (length(&smooth) / STEP_MM).ceil() as usize;
    Ok(resampled(&smooth, count)
        .iter()
        .map(|v| head.center + v)
        .collect())
}

/// The direction from the head's centre into the socket: the mean direction of the bone around it. A
/// sphere without any is no head.
pub(super) fn socket_axis(hip: &Surface, head: &Head) -> Option<Vector> {
    let mut sum = Vector::zeros();
    for t in 0..hip.triangles().len() {
        let corners = hip.corners(t);
        let middle = (corners[0].coords + corners[1].coords + corners[2].coords) / 3.0;
        let arm = middle - head.center.coords;
        if arm.norm() < head.radius_mm + AXIS_MM {
            let area = (corners[1] - corners[0])
                .cross(&(corners[2] - corners[0]))
                .norm();
            sum += arm.normalize() * area;
        }
    }
    sum.try_normalize(1.0)
}

/// Lines of sight from the head's centre, by meridian (from superior by the front) and angle from
/// the socket's axis.
struct Fan<'a> {
    hip: &'a Surface,
    center: Point,
    reach_mm: f64,
    /// Into the socket, superior, anterior: orthogonal unit world directions.
    axes: [Vector; 3],
}

impl<'a> Fan<'a> {
    fn new(
        hip: &'a Surface,
        head: &Head,
        axis: Vector,
        local: &Local,
        socket_mm: f64,
    ) -> Option<Self> {
        let up = local.axes[1];
        let superior = (up - axis * up.dot(&axis)).try_normalize(0.1)?;
        let sideways = axis.cross(&superior);
        let anterior = sideways * sideways.dot(&local.axes[2]).signum();
        Some(Self {
            hip,
            center: head.center,
            reach_mm: head.radius_mm + socket_mm,
            axes: [axis, superior, anterior],
        })
    }

    fn direction(&self, meridian: f64, angle_deg: f64) -> Vector {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let (s, c) = (meridian * std::f64::consts::TAU / MERIDIANS as f64).sin_cos();
        self.axes[0] * cos + (self.axes[1] * c + self.axes[2] * s) * sin
    }

    /// Distance of the first bone in a direction, if it belongs to the socket.
    fn socket(&self, meridian: f64, angle_deg: f64) -> Option<f64> {
        let ray = Ray {
            origin: self.center,
            direction: self.direction(meridian, angle_deg),
        };
        let first = self.hip.intersections(&ray).first()?.t;
        (first < self.reach_mm).then_some(first)
    }

    /// (angle in deg, distance in mm) of the farthest socket bone on a meridian.
    fn edge(&self, meridian: usize) -> Option<Vector2<f64>> {
        let m = meridian as f64;
        let steps = ((SEARCH_DEG.1 - SEARCH_DEG.0) / STEP_DEG) as usize;
        let last = (0..=steps)
            .rev()
            .map(|n| SEARCH_DEG.0 + n as f64 * STEP_DEG)
            .find(|&angle| self.socket(m, angle).is_some())?;
        let (mut seen, mut unseen) = (last, last + STEP_DEG);
        for _ in 0..12 {
            let middle = (seen + unseen) / 2.0;
            if self.socket(m, middle).is_some() {
                seen = middle;
            } else {
                unseen = middle;
            }
        }
        self.socket(m, seen).map(|d| Vector2::new(seen, d))
    }

    /// Where the search of a meridian ends in the socket, if there is none.
    fn inmost(&self) -> Vector2<f64> {
        Vector2::new(SEARCH_DEG.0, self.reach_mm)
    }

    fn point(&self, meridian: usize, edge: &Vector2<f64>) -> Point {
        self.center + self.direction(meridian as f64, edge.x) * edge.y
    }
}

/// Each value replaced by the median of itself and two neighbours on either side: single lines of
/// sight pass through pits of the edge.
fn without_outliers(edge: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let n = edge.len();
    let median = |i: usize, axis: usize| {
        let mut five: [f64; 5] = std::array::from_fn(|k| edge[(i + n + k - 2) % n][axis]);
        five.sort_by(f64::total_cmp);
        five[2]
    };
    (0..n)
        .map(|i| Vector2::new(median(i, 0), median(i, 1)))
        .collect()
}

/// The edge's points, with the notch bridged.
fn bridged(fan: &Fan, edge: &[Vector2<f64>]) -> Vec<Point> {
    let n = edge.len();
    let points: Vec<Point> = (0..n).map(|m| fan.point(m, &edge[m])).collect();
    // The notch is the edge's deepest gap in the lower third; a horn ends on either side of it, within
    // a fifth of the circle.
    let notch = LOWER
        .min_by(|&a, &b| edge[a].x.total_cmp(&edge[b].x))
        .unwrap_or(n / 2);
    let tip = |range: &mut dyn Iterator<Item = usize>| {
        range
            .max_by(|&a, &b| edge[a].x.total_cmp(&edge[b].x))
            .unwrap_or(notch)
    };
    let before = tip(&mut (notch - n / 5..=notch));
    let after = tip(&mut (notch..=notch + n / 5));
    let mut line = points.clone();
    for m in before + 1..after {
        let t = (m - before) as f64 / (after - before) as f64;
        line[m] = points[before] + (points[after] - points[before]) * t;
    }
    line
}

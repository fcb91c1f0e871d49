//! The lateral centre-edge (LCE) angle.
//!
//! In the coronal projection of the APP it is the angle, at the femoral head's centre, from
//! superior to the most lateral point of the acetabular rim, positive laterally (DESIGN section
//! 3). The rim moves with the fragment, and its most lateral point is found again afterwards.
//!
//! A trace has a point every few mm. The most lateral VERTEX would jump from one to the next as
//! the pose changes, by degrees of LCE angle, so the most lateral point is that of the smooth
//! closed curve through the trace (a periodic Catmull-Rom spline), which varies continuously.

use super::Side;
use crate::geometry::{Point, Rigid};
use serde::{Deserialize, Serialize};

/// Where the angle's apex lies after a relocation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LceApex {
    /// The origin of the APP: the femoral head's centre before the operation.
    #[default]
    PreoperativeHead,
    /// The femoral head's centre after the femur's movement.
    MovedHead,
}

/// A rim that has no LCE angle.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum LceError {
    #[error(
        "the rim trace has {0} points; the LCE angle needs at least 4, check the specimen's rim file"
    )]
    TooFewPoints(usize),
    #[error(
        "the rim trace holds a coordinate that is not finite; check the specimen's rim file and the movement"
    )]
    NotFinite,
}

/// The LCE angle in radians, in (-pi, pi].
///
/// `rim` is the closed preoperative trace in the APP with its origin at the ipsilateral femoral
/// head (mm), `fragment` the movement of the fragment there, `apex` the angle's apex there: the
/// origin ([`LceApex::PreoperativeHead`]) or the moved head's centre.
///
/// # Errors
/// When the trace has fewer than four points or is not finite.
pub fn lce_angle(
    rim: &[Point],
    side: Side,
    fragment: &Rigid,
    apex: &Point,
) -> Result<f64, LceError> {
    let moved: Vec<Point> = rim.iter().map(|p| fragment * p).collect();
    let edge = most_lateral_point(&moved, side)?;
    let arm = edge - apex;
    Ok((arm.x * side.lateral_sign()).atan2(arm.y))
}

/// The most lateral point (+x on a left hip, -x on a right one) of the smooth closed curve through
/// the points of `rim`, in the frame of `rim`.
///
/// # Errors
/// When the trace has fewer than four points or is not finite.
pub fn most_lateral_point(rim: &[Point], side: Side) -> Result<Point, LceError> {
    if rim.len() < 4 {
        return Err(LceError::TooFewPoints(rim.len()));
    }
    if rim.iter().any(|p| !p.coords.iter().all(|c| c.is_finite())) {
        return Err(LceError::NotFinite);
    }
    let n = rim.len();
    let sign = side.lateral_sign();
    let mut best = rim[0];
    let mut consider = |candidate: Point| {
        if candidate.x * sign > best.x * sign {
            best = candidate;
        }
    };
    for i in 0..n {
        let [a, b, c, d] = [n - 1, 0, 1, 2].map(|step| rim[(i + step) % n].coords);
        // Catmull-Rom between b and c: ((k3 u + k2) u + k1) u + b for u in [0, 1].
        let k1 = (c - a) / 2.0;
        let k2 = a - b * 2.5 + c * 2.0 - d * 0.5;
        let k3 = (d - a) / 2.0 + (b - c) * 1.5;
        let at = |u: f64| Point::from(((k3 * u + k2) * u + k1) * u + b);
        consider(at(0.0));
        for u in quadratic_roots(3.0 * k3.x, 2.0 * k2.x, k1.x) {
            if (0.0..=1.0).contains(&u) {
                consider(at(u));
            }
        }
    }
    Ok(best)
}

/// The real roots of `a u^2 + b u + c`, without cancellation; NaN where there is none.
fn quadratic_roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let root = (b * b - 4.0 * a * c).sqrt();
    let q = -0.5 * (b + root.copysign(b));
    [q / a, c / q]
}

/// The apex of the angle in the APP: its origin, or where the femur's movement takes it.
pub fn apex(choice: LceApex, femur: &Rigid) -> Point {
    match choice {
        LceApex::PreoperativeHead => Point::origin(),
        LceApex::MovedHead => femur * Point::origin(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Vector, euler};

    /// A rim around the head's centre: a circle of radius `r` whose coronal projection is an
    /// ellipse with its long axis `tilt` above horizontal (lateral and up).
    fn rim(side: Side, r: f64, tilt: f64, anteversion: f64, points: usize) -> Vec<Point> {
        let s = side.lateral_sign();
        let long = Vector::new(tilt.cos(), tilt.sin(), 0.0);
        let short = Vector::new(-tilt.sin(), tilt.cos(), 0.0) * anteversion.sin()
            + Vector::z() * anteversion.cos();
        (0..points)
            .map(|i| {
                let phi = std::f64::consts::TAU * i as f64 / points as f64;
                let p = (long * phi.cos() + short * phi.sin()) * r;
                Point::new(p.x * s, p.y, p.z)
            })
            .collect()
    }

    /// Closed form: in the projection x = r (cos t cos phi - sin t sin a sin phi) is largest at
    /// tan phi = -tan t sin a.
    fn closed_form(tilt: f64, anteversion: f64) -> f64 {
        let phi = (-tilt.tan() * anteversion.sin()).atan();
        let x = tilt.cos() * phi.cos() - tilt.sin() * anteversion.sin() * phi.sin();
        let y = tilt.sin() * phi.cos() + tilt.cos() * anteversion.sin() * phi.sin();
        x.atan2(y)
    }

    #[test]
    fn a_circular_rim_has_its_closed_form_on_both_sides() {
        for side in Side::BOTH {
            for tilt_deg in [30.0_f64, 45.0, 60.0] {
                let (tilt, anteversion) = (tilt_deg.to_radians(), 0.35);
                let trace = rim(side, 26.0, tilt, anteversion, 54);
                let found = lce_angle(&trace, side, &Rigid::identity(), &Point::origin()).unwrap();
                let expected = closed_form(tilt, anteversion);
                assert!(
                    (found - expected).to_degrees().abs() < 0.02,
                    "{side} {tilt_deg}: {} for {}",
                    found.to_degrees(),
                    expected.to_degrees()
                );
            }
        }
    }

    /// The movement's AP rotation turns the dome laterally: clockwise in the coronal plane of a
    /// left hip seen from the front (negative about z), the other way on the right.
    #[test]
    fn a_coronal_rotation_adds_to_the_angle_of_a_point_like_edge() {
        for side in Side::BOTH {
            let s = side.lateral_sign();
            // A trace whose most lateral point is a sharp corner at 25 deg.
            let corner = 25f64.to_radians();
            let edge = Point::new(s * 30.0 * corner.sin(), 30.0 * corner.cos(), 0.0);
            let trace = [
                edge,
                Point::new(s * 5.0, 20.0, 12.0),
                Point::new(-s * 9.0, -24.0, 0.0),
                Point::new(s * 5.0, 20.0, -12.0),
            ];
            let before = lce_angle(&trace, side, &Rigid::identity(), &Point::origin()).unwrap();
            let turn = euler::from_xyz(&Vector::new(0.0, 0.0, -s * 10f64.to_radians()));
            let turned = Rigid::from_parts(Vector::zeros().into(), turn);
            let after = lce_angle(&trace, side, &turned, &Point::origin()).unwrap();
            assert!((before.to_degrees() - 25.0).abs() < 1.0, "{before}");
            assert!((after.to_degrees() - 35.0).abs() < 1.0, "{after}");
        }
    }

    #[test]
    fn the_angle_is_continuous_in_the_pose() {
        let trace = rim(Side::Left, 26.0, 0.8, 0.35, 50);
        let angle = |degrees: f64| {
            let turn = euler::from_xyz(&Vector::new(
                f64::to_radians(degrees),
                0.0,
                f64::to_radians(-degrees),
            ));
            let pose = Rigid::from_parts(Vector::zeros().into(), turn);
            lce_angle(&trace, Side::Left, &pose, &Point::origin())
                .unwrap()
                .to_degrees()
        };
        for step in 0..400 {
            let a = f64::from(step) * 0.05;
            let jump = (angle(a + 0.05) - angle(a)).abs();
            assert!(jump < 0.2, "jump of {jump} deg at {a} deg");
        }
    }

    #[test]
    fn the_apex_follows_the_femur_only_when_asked() {
        let femur = Rigid::new(Vector::new(0.0, -2.0, 1.0), Vector::new(0.3, 0.0, 0.0));
        assert_eq!(apex(LceApex::PreoperativeHead, &femur), Point::origin());
        let moved = apex(LceApex::MovedHead, &femur);
        assert_eq!(moved, femur * Point::origin());
        let trace = rim(Side::Right, 26.0, 0.8, 0.35, 50);
        let still = lce_angle(&trace, Side::Right, &Rigid::identity(), &Point::origin()).unwrap();
        let lower = lce_angle(&trace, Side::Right, &Rigid::identity(), &moved).unwrap();
        assert!(lower < still, "a lower head is covered less far laterally");
    }

    #[test]
    fn a_trace_that_is_too_short_is_refused() {
        let short = [Point::origin(); 3];
        assert_eq!(
            most_lateral_point(&short, Side::Left),
            Err(LceError::TooFewPoints(3))
        );
    }
}

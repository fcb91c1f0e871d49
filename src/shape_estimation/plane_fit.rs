//! Plane fits to 3D points: least squares, and RANSAC against outliers.

use crate::geometry::{Plane, Point, Vector};
use crate::random::Stream;
use nalgebra::Matrix3;
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// How RANSAC searches (Fischler and Bolles 1981; rule and numbers as facts 2.13).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RansacParameters {
    /// Number of three-point models tried.
    pub iterations: usize,
    /// A point agrees with a model when its distance is below the mean of all points' distances
    /// plus this many of their standard deviations.
    pub inlier_sd: f64,
    /// Smallest share of the points that must agree with a model.
    pub consensus: f64,
}

impl Default for RansacParameters {
    fn default() -> Self {
        Self {
            iterations: 50,
            inlier_sd: 1.0,
            consensus: 0.5,
        }
    }
}

impl RansacParameters {
    /// What is out of range, as (field, problem).
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        if !(1..=1_000_000).contains(&self.iterations) {
            problems.push((
                "iterations".into(),
                format!("is {}; expected 1 to 1000000", self.iterations),
            ));
        }
        for (field, value, high) in [
            ("inlier_sd", self.inlier_sd, 10.0),
            ("consensus", self.consensus, 1.0),
        ] {
            if !(value > 0.0 && value <= high) {
                let problem = format!("is {value}; expected above 0 and at most {high}");
                problems.push((field.into(), problem));
            }
        }
        problems
    }
}

/// Two of the points' principal spreads must exceed this (mm), or they do not determine a plane.
const SMALLEST_SPREAD_MM: f64 = 0.5;

/// The plane of least squared distances, or `None` if the points lie on a line or are fewer than
/// three. The normal's sign is arbitrary.
pub fn least_squares_plane(points: &[Point]) -> Option<Plane> {
    if points.len() < 3 {
        return None;
    }
    let n = points.len() as f64;
    let center = Point::from(points.iter().map(|p| p.coords).sum::<Vector>() / n);
    let scatter: Matrix3<f64> = points
        .iter()
        .map(|p| {
            let d = p - center;
            d * d.transpose()
        })
        .sum();
    let eigen = (scatter / n).symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    if eigen.eigenvalues[order[1]].max(0.0).sqrt() < SMALLEST_SPREAD_MM {
        return None;
    }
    let normal: Vector = eigen.eigenvectors.column(order[0]).into();
    Some(Plane::through(&center, &normal))
}

/// The plane that most points agree with, refit to those that do. `None` if there are fewer than
/// `3`, or no model finds its consensus.
pub fn ransac_plane(
    points: &[Point],
    parameters: &RansacParameters,
    stream: &mut Stream,
) -> Option<Plane> {
    if points.len() < 3 {
        return None;
    }
    let mut best: Option<(f64, Plane)> = None;
    for _ in 0..parameters.iterations {
        let sample = sample_three(points.len(), stream).map(|i| points[i]);
        let normal = (sample[1] - sample[0]).cross(&(sample[2] - sample[0]));
        if normal.norm() < SMALLEST_SPREAD_MM * SMALLEST_SPREAD_MM {
            continue;
        }
        let model = Plane::through(&sample[0], &normal);
        let distances: Vec<f64> = points
            .iter()
            .map(|p| model.signed_distance(p).abs())
            .collect();
        let n = distances.len() as f64;
        let mean = distances.iter().sum::<f64>() / n;
        let variance = distances.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / n;
        let limit = mean + parameters.inlier_sd * variance.sqrt();
        let agreeing: Vec<Point> = points
            .iter()
            .zip(&distances)
            .filter(|(_, distance)| **distance < limit)
            .map(|(point, _)| *point)
            .collect();
        if (agreeing.len() as f64) < parameters.consensus * n {
            continue;
        }
        let Some(plane) = least_squares_plane(&agreeing) else {
            continue;
        };
        let score = agreeing
            .iter()
            .map(|p| plane.signed_distance(p).abs())
            .sum::<f64>()
            / agreeing.len() as f64;
        if best.is_none_or(|(lowest, _)| score < lowest) {
            best = Some((score, plane));
        }
    }
    best.map(|(_, plane)| plane)
}

/// Three different indices below `n`, which is at least 3.
fn sample_three(n: usize, stream: &mut Stream) -> [usize; 3] {
    let a = stream.random_range(0..n);
    let mut b = stream.random_range(0..n - 1);
    if b >= a {
        b += 1;
    }
    let mut c = stream.random_range(0..n - 2);
    for taken in [a.min(b), a.max(b)] {
        if c >= taken {
            c += 1;
        }
    }
    [a, b, c]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

    /// A tilted patch of 10 x 10 points and the plane that it lies on.
    fn patch() -> (Vec<Point>, Plane) {
        let plane = Plane::through(&Point::new(3.0, -4.0, 30.0), &Vector::new(0.2, -0.5, 1.0));
        let points = (0..100)
            .map(|i| {
                plane.project(&Point::new(
                    (i % 10) as f64 * 4.0,
                    (i / 10) as f64 * 3.0,
                    20.0,
                ))
            })
            .collect();
        (points, plane)
    }

    fn angle(a: &Plane, b: &Plane) -> f64 {
        a.normal.cross(&b.normal).norm().asin()
    }

    #[test]
    fn least_squares_recovers_an_exact_plane() {
        let (points, plane) = patch();
        let fit = least_squares_plane(&points).unwrap();
        assert!(angle(&fit, &plane) < 1e-9);
        assert!(fit.signed_distance(&points[7]).abs() < 1e-9);
    }

    #[test]
    fn a_line_determines_no_plane() {
        let line: Vec<Point> = (0..20)
            .map(|i| Point::new(i as f64, 2.0 * i as f64, 1.0))
            .collect();
        assert_eq!(least_squares_plane(&line), None);
        let mut draws = stream(1, Purpose::Ransac, "line");
        assert_eq!(
            ransac_plane(&line, &RansacParameters::default(), &mut draws),
            None
        );
    }

    #[test]
    fn ransac_ignores_outliers_that_spoil_least_squares() {
        let (mut points, plane) = patch();
        for i in 0..25 {
            points.push(Point::new(30.0 + i as f64, 5.0, -30.0 - i as f64));
        }
        let mut draws = stream(1, Purpose::Ransac, "outliers");
        let fit = ransac_plane(&points, &RansacParameters::default(), &mut draws).unwrap();
        assert!(
            angle(&fit, &plane).to_degrees() < 0.5,
            "{}",
            angle(&fit, &plane).to_degrees()
        );
        let plain = least_squares_plane(&points).unwrap();
        assert!(angle(&plain, &plane).to_degrees() > 5.0);
    }

    #[test]
    fn samples_are_distinct_and_cover_all() {
        let mut draws = stream(1, Purpose::Ransac, "three");
        let mut seen = [false; 5];
        for _ in 0..200 {
            let [a, b, c] = sample_three(5, &mut draws);
            assert!(a != b && b != c && a != c && a.max(b).max(c) < 5);
            seen[a] = true;
            seen[b] = true;
            seen[c] = true;
        }
        assert_eq!(seen, [true; 5]);
    }
}

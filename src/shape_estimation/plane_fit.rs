//! Plane fits: least squares, and RANSAC against outliers (paper, section "Fragment Shape
//! Estimation" and its supplement; facts 2.13).

use crate::geometry::{Plane, Point, Vector};
use crate::random::Stream;
use nalgebra::Matrix3;
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// How a plane is found among outliers. The paper names RANSAC without numbers; these are ours.
/// (The authors' library takes points nearer than mean + 1 SD as inliers and 50 rounds, facts 2.13: a
/// threshold that grows with the outliers.)
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RansacParameters {
    /// Planes through three random points that are tried.
    pub iterations: usize,
    /// Largest distance of an inlier from the plane (mm). The error of an annotation, 10 pixels of
    /// the full image, is 1.6 mm at the patient.
    pub inlier_mm: f64,
    /// Smallest part of the points that a plane must have as inliers, in (0, 1].
    pub smallest_consensus: f64,
    /// Fewest inliers of a plane.
    pub fewest_inliers: usize,
    /// Smallest standard deviation of the inliers within the plane, across their main direction
    /// (mm). Points on one straight line leave the plane's tilt open.
    pub smallest_spread_mm: f64,
}

impl Default for RansacParameters {
    fn default() -> Self {
        Self {
            iterations: 1000,
            inlier_mm: 2.0,
            smallest_consensus: 0.4,
            fewest_inliers: 30,
            smallest_spread_mm: 1.0,
        }
    }
}

impl RansacParameters {
    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        let mut check = |field: &str, value: f64, min: f64, max: f64, unit: &str| {
            if !(min..=max).contains(&value) {
                let message = format!("is {value}{unit}; expected {min} to {max}{unit}");
                problems.push((field.to_string(), message));
            }
        };
        check("iterations", self.iterations as f64, 1.0, 1e6, "");
        check("inlier_mm", self.inlier_mm, 0.01, 50.0, " mm");
        check("smallest_consensus", self.smallest_consensus, 0.01, 1.0, "");
        check("fewest_inliers", self.fewest_inliers as f64, 3.0, 1e6, "");
        check(
            "smallest_spread_mm",
            self.smallest_spread_mm,
            0.0,
            50.0,
            " mm",
        );
        problems
    }
}

/// Why points give no plane.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    #[error("{points} points are left after pruning, expected {expected} or more")]
    TooFewPoints { points: usize, expected: usize },
    #[error(
        "no plane has enough of the {points} points within {inlier_mm} mm: the best has {inliers}, expected {expected}"
    )]
    NoConsensus {
        points: usize,
        inliers: usize,
        expected: usize,
        inlier_mm: f64,
    },
    #[error(
        "the {inliers} inliers lie along a line (spread across it {spread_mm:.2} mm, expected {expected_mm} mm or more), which leaves the plane's tilt open"
    )]
    OnALine {
        inliers: usize,
        spread_mm: f64,
        expected_mm: f64,
    },
}

/// A fitted plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneFit {
    /// Its normal has no particular sign.
    pub plane: Plane,
    /// Number of points that it was fitted to.
    pub inliers: usize,
    /// Standard deviations of these points along their principal directions (mm), largest first: the
    /// first two lie in the plane, the third is the root mean square distance from it.
    pub spread_mm: [f64; 3],
}

/// The least-squares plane of at least three points: through their centroid, normal along the
/// direction of least scatter.
pub fn least_squares_plane<'a>(points: impl Iterator<Item = &'a Point> + Clone) -> PlaneFit {
    let inliers = points.clone().count();
    let n = inliers as f64;
    let center = Point::from(points.clone().map(|p| p.coords).sum::<Vector>() / n);
    let mut scatter = Matrix3::zeros();
    for p in points {
        let d = p - center;
        scatter += d * d.transpose();
    }
    // The singular vectors of a symmetric positive matrix are its eigenvectors.
    let svd = (scatter / n).svd(true, false);
    let u = svd.u.expect("the left singular vectors were asked for");
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
    PlaneFit {
        plane: Plane::through(&center, &u.column(order[2]).into_owned()),
        inliers,
        spread_mm: order.map(|i| svd.singular_values[i].max(0.0).sqrt()),
    }
}

/// The plane of most of the points: the best of many planes through three random points, then least
/// squares on its inliers, repeated with the inliers of the new plane until they stay the same.
///
/// A plane's score is the sum over all points of min(distance^2, inlier_mm^2), lower is better
/// (MSAC: it also prefers the better of two planes with as many inliers).
///
/// # Errors
/// When the points are too few, disagree, or lie along a line.
pub fn ransac_plane(
    points: &[Point],
    parameters: &RansacParameters,
    stream: &mut Stream,
) -> Result<PlaneFit, FitError> {
    if points.len() < parameters.fewest_inliers.max(3) {
        return Err(FitError::TooFewPoints {
            points: points.len(),
            expected: parameters.fewest_inliers.max(3),
        });
    }
    let limit = parameters.inlier_mm;
    let score = |plane: &Plane| -> f64 {
        let truncated = |p: &Point| plane.signed_distance(p).powi(2).min(limit * limit);
        points.iter().map(truncated).sum()
    };
    let mut best: Option<(f64, Plane)> = None;
    for _ in 0..parameters.iterations {
        let [a, b, c] = std::array::from_fn(|_| points[stream.random_range(0..points.len())]);
        let normal = (b - a).cross(&(c - a));
        // Three points of a line, or the same point twice, are no model.
        if normal.norm() < 1e-6 {
            continue;
        }
        let plane = Plane::through(&a, &normal);
        let score = score(&plane);
        if best.is_none_or(|(lowest, _)| score < lowest) {
            best = Some((score, plane));
        }
    }
    let on = |plane: &Plane| -> Vec<&Point> {
        let near = |p: &&Point| plane.signed_distance(p).abs() <= limit;
        points.iter().filter(near).collect()
    };
    let mut inliers = best.map_or_else(Vec::new, |(_, plane)| on(&plane));
    let mut fit = None;
    for _ in 0..20 {
        if inliers.len() < 3 {
            break;
        }
        let refined = least_squares_plane(inliers.iter().copied());
        let again = on(&refined.plane);
        fit = Some(refined);
        if again == inliers {
            break;
        }
        inliers = again;
    }
    let consensus = (parameters.smallest_consensus * points.len() as f64).ceil() as usize;
    let expected = consensus.max(parameters.fewest_inliers);
    let fit = fit.filter(|fit| fit.inliers >= expected);
    let Some(fit) = fit else {
        return Err(FitError::NoConsensus {
            points: points.len(),
            inliers: inliers.len(),
            expected,
            inlier_mm: limit,
        });
    };
    if fit.spread_mm[1] < parameters.smallest_spread_mm {
        return Err(FitError::OnALine {
            inliers: fit.inliers,
            spread_mm: fit.spread_mm[1],
            expected_mm: parameters.smallest_spread_mm,
        });
    }
    Ok(fit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};
    use rand_distr::{Distribution, StandardNormal};

    fn source() -> Stream {
        stream(11, Purpose::Ransac, "test")
    }

    /// Points of a plane, 50 x 10 mm, with Gaussian distance `sd` from it.
    fn on_plane(plane: &Plane, n: usize, sd: f64, stream: &mut Stream) -> Vec<Point> {
        let u = plane.normal.cross(&Vector::new(0.3, -0.5, 0.8)).normalize();
        let v = plane.normal.cross(&u);
        let foot = Point::from(plane.normal * plane.offset_mm);
        (0..n)
            .map(|_| {
                let (a, b) = (
                    stream.random_range(-25.0..25.0),
                    stream.random_range(-5.0..5.0),
                );
                let z: f64 = StandardNormal.sample(stream);
                foot + u * a + v * b + plane.normal * (sd * z)
            })
            .collect()
    }

    fn angle_deg(a: &Vector, b: &Vector) -> f64 {
        a.dot(b).abs().min(1.0).acos().to_degrees()
    }

    fn plane() -> Plane {
        Plane::through(&Point::new(10.0, 40.0, -20.0), &Vector::new(0.2, 1.0, -0.4))
    }

    #[test]
    fn least_squares_is_exact_on_a_plane_and_knows_its_spread() {
        let mut s = source();
        let points = on_plane(&plane(), 4000, 0.0, &mut s);
        let fit = least_squares_plane(points.iter());
        assert!(angle_deg(&fit.plane.normal, &plane().normal) < 1e-5);
        let distance = fit.plane.signed_distance(&points[0]);
        assert!(distance.abs() < 1e-9);
        // A uniform distribution of width w has SD w / sqrt(12).
        assert!((fit.spread_mm[0] - 50.0 / 12f64.sqrt()).abs() < 0.3);
        assert!((fit.spread_mm[1] - 10.0 / 12f64.sqrt()).abs() < 0.1);
        assert!(fit.spread_mm[2] < 1e-6);
    }

    #[test]
    fn outliers_do_not_move_the_plane() {
        let mut s = source();
        let mut points = on_plane(&plane(), 600, 0.5, &mut s);
        // Another surface behind the cut, and points anywhere.
        let wrong = Plane::through(&Point::new(0.0, 70.0, -60.0), &Vector::new(1.0, 0.2, 0.1));
        points.extend(on_plane(&wrong, 250, 1.0, &mut s));
        for _ in 0..150 {
            let anywhere = Vector::from_fn(|_, _| s.random_range(-60.0..60.0));
            points.push(Point::new(10.0, 40.0, -20.0) + anywhere);
        }
        let all = least_squares_plane(points.iter());
        assert!(angle_deg(&all.plane.normal, &plane().normal) > 10.0);
        let fit = ransac_plane(&points, &RansacParameters::default(), &mut s).unwrap();
        let angle = angle_deg(&fit.plane.normal, &plane().normal);
        assert!(angle < 3.0, "{angle}");
        let center = Point::from(plane().normal * plane().offset_mm);
        let distance = fit.plane.signed_distance(&center);
        assert!(distance.abs() < 0.3, "{angle} {distance} {}", fit.inliers);
        assert!((580..660).contains(&fit.inliers), "{}", fit.inliers);
    }

    #[test]
    fn too_few_points_are_refused() {
        let mut s = source();
        let points = on_plane(&plane(), 12, 0.0, &mut s);
        let error = ransac_plane(&points, &RansacParameters::default(), &mut s).unwrap_err();
        assert!(matches!(error, FitError::TooFewPoints { points: 12, .. }));
    }

    #[test]
    fn a_cloud_has_no_plane() {
        let mut s = source();
        let points: Vec<Point> = (0..400)
            .map(|_| Point::from(Vector::from_fn(|_, _| s.random_range(-30.0..30.0))))
            .collect();
        let error = ransac_plane(&points, &RansacParameters::default(), &mut s).unwrap_err();
        assert!(matches!(error, FitError::NoConsensus { .. }), "{error}");
    }

    #[test]
    fn a_line_has_no_plane() {
        let mut s = source();
        let points: Vec<Point> = (0..200)
            .map(|n| {
                let noise = Vector::from_fn(|_, _| 0.2 * s.random_range(-1.0..1.0));
                Point::new(f64::from(n) * 0.3, 5.0, 2.0) + noise
            })
            .collect();
        let error = ransac_plane(&points, &RansacParameters::default(), &mut s).unwrap_err();
        assert!(matches!(error, FitError::OnALine { .. }), "{error}");
    }

    #[test]
    fn the_same_stream_gives_the_same_plane() {
        let points = on_plane(&plane(), 200, 0.8, &mut source());
        let fit = |_| ransac_plane(&points, &RansacParameters::default(), &mut source());
        assert_eq!(fit(1), fit(2));
    }
}

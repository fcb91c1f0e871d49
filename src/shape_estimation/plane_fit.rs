//! Plane fits: least squares, and RANSAC against outliers (paper, section "Fragment Shape
//! Estimation" and its supplement; facts 2.13).

use crate::geometry::{Plane, Point, Vector};
use crate::random::Stream;
use nalgebra::Matrix3;
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// How a plane is found among outliers. The paper names RANSAC without numbers; these are ours,
/// chosen on simulated annotations with poses off by what single-view registrations leave. (The
/// authors' library takes points nearer than mean + 1 SD as inliers and 50 rounds, facts 2.13: a
/// threshold that grows with the outliers.)
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RansacParameters {
    /// Planes through three random points that are tried.
    pub iterations: usize,
    /// Largest distance of an inlier from the plane (mm). The error of an annotation, 10 pixels of
    /// the full image, is 1.6 mm across a ray; where a ray grazes the bone it is several times that
    /// on the surface.
    pub inlier_mm: f64,
    /// Smallest part of the sightings that a plane must have as inliers, in (0, 1].
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
            inlier_mm: 5.0,
            smallest_consensus: 0.5,
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

/// Rounds of least squares at most; the inliers settle within a few.
const REFINEMENTS: usize = 20;

/// The candidate nearest to a plane, and its distance.
fn nearest(candidates: &[Point], plane: &Plane) -> (Point, f64) {
    let mut best = (candidates[0], f64::INFINITY);
    for &point in candidates {
        let distance = plane.signed_distance(&point).abs();
        if distance < best.1 {
            best = (point, distance);
        }
    }
    best
}

/// Why points give no plane.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    #[error("{sightings} sightings are left after pruning, expected {expected} or more")]
    TooFewPoints { sightings: usize, expected: usize },
    #[error(
        "no plane has enough of the {sightings} sightings within {inlier_mm} mm: the best has {inliers}, expected {expected}"
    )]
    NoConsensus {
        sightings: usize,
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
pub fn least_squares_plane(points: &[Point]) -> PlaneFit {
    let n = points.len() as f64;
    let center = Point::from(points.iter().map(|p| p.coords).sum::<Vector>() / n);
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
        inliers: points.len(),
        spread_mm: order.map(|i| svd.singular_values[i].max(0.0).sqrt()),
    }
}

/// The plane of most of the sightings, each of which is a set of candidate points (not empty) of
/// which one at most is right: the best of many planes through three random points, then least
/// squares on its inliers, repeated with the inliers of the new plane until they stay the same. A
/// plane takes of each sighting the candidate nearest to it.
///
/// A plane's score is the sum over all sightings of min(distance^2, inlier_mm^2), lower is better
/// (MSAC: it also prefers the better of two planes with as many inliers).
///
/// # Errors
/// When the sightings are too few, disagree, or lie along a line.
pub fn ransac_plane(
    sightings: &[Vec<Point>],
    parameters: &RansacParameters,
    stream: &mut Stream,
) -> Result<PlaneFit, FitError> {
    if sightings.len() < parameters.fewest_inliers.max(3) {
        return Err(FitError::TooFewPoints {
            sightings: sightings.len(),
            expected: parameters.fewest_inliers.max(3),
        });
    }
    let limit = parameters.inlier_mm;
    let mut best: Option<(f64, Plane)> = None;
    for _ in 0..parameters.iterations {
        let [a, b, c] = std::array::from_fn(|_| {
            let candidates = &sightings[stream.random_range(0..sightings.len())];
            candidates[stream.random_range(0..candidates.len())]
        });
        let normal = (b - a).cross(&(c - a));
        // Three points of a line, or the same point twice, are no model.
        if normal.norm() < 1e-6 {
            continue;
        }
        let plane = Plane::through(&a, &normal);
        let truncated = |candidates: &Vec<Point>| nearest(candidates, &plane).1.min(limit).powi(2);
        let score = sightings.iter().map(truncated).sum();
        if best.is_none_or(|(lowest, _)| score < lowest) {
            best = Some((score, plane));
        }
    }
    let on = |plane: &Plane| -> Vec<Point> {
        let each = sightings
            .iter()
            .map(|candidates| nearest(candidates, plane));
        each.filter(|&(_, distance)| distance <= limit)
            .map(|(point, _)| point)
            .collect()
    };
    let mut inliers = best.map_or_else(Vec::new, |(_, plane)| on(&plane));
    let mut fit = None;
    for _ in 0..REFINEMENTS {
        if inliers.len() < 3 {
            break;
        }
        let refined = least_squares_plane(&inliers);
        let again = on(&refined.plane);
        fit = Some(refined);
        if again == inliers {
            break;
        }
        inliers = again;
    }
    let consensus = (parameters.smallest_consensus * sightings.len() as f64).ceil() as usize;
    let expected = consensus.max(parameters.fewest_inliers);
    let fit = fit.filter(|fit| fit.inliers >= expected);
    let Some(fit) = fit else {
        return Err(FitError::NoConsensus {
            sightings: sightings.len(),
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

    /// Each point as the one candidate of a sighting.
    fn alone(points: &[Point]) -> Vec<Vec<Point>> {
        points.iter().map(|&p| vec![p]).collect()
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
        let fit = least_squares_plane(&points);
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
        let all = least_squares_plane(&points);
        assert!(angle_deg(&all.plane.normal, &plane().normal) > 10.0);
        let fit = ransac_plane(&alone(&points), &RansacParameters::default(), &mut s).unwrap();
        let angle = angle_deg(&fit.plane.normal, &plane().normal);
        assert!(angle < 3.0, "{angle}");
        let center = Point::from(plane().normal * plane().offset_mm);
        let distance = fit.plane.signed_distance(&center);
        assert!(distance.abs() < 0.3, "{angle} {distance} {}", fit.inliers);
        assert!((590..720).contains(&fit.inliers), "{}", fit.inliers);
    }

    #[test]
    fn of_each_sighting_the_candidate_on_the_plane_is_taken() {
        let mut s = source();
        let wrong = Plane::through(&Point::new(0.0, 90.0, -60.0), &Vector::new(0.1, 1.0, 0.1));
        let right = on_plane(&plane(), 300, 0.2, &mut s);
        let behind = on_plane(&wrong, 300, 0.2, &mut s);
        let far = on_plane(&wrong, 300, 40.0, &mut s);
        let sightings: Vec<Vec<Point>> = (0..300)
            .map(|n| match n % 3 {
                0 => vec![right[n], behind[n], far[n]],
                1 => vec![far[n], right[n]],
                _ => vec![behind[n], right[n]],
            })
            .collect();
        let fit = ransac_plane(&sightings, &RansacParameters::default(), &mut s).unwrap();
        assert!(angle_deg(&fit.plane.normal, &plane().normal) < 1.0);
        assert_eq!(fit.inliers, 300);
        assert!((fit.spread_mm[2] - 0.2).abs() < 0.03);
    }

    #[test]
    fn too_few_points_are_refused() {
        let mut s = source();
        let points = on_plane(&plane(), 12, 0.0, &mut s);
        let error =
            ransac_plane(&alone(&points), &RansacParameters::default(), &mut s).unwrap_err();
        assert!(matches!(
            error,
            FitError::TooFewPoints { sightings: 12, .. }
        ));
    }

    #[test]
    fn a_cloud_has_no_plane() {
        let mut s = source();
        let points: Vec<Point> = (0..400)
            .map(|_| Point::from(Vector::from_fn(|_, _| s.random_range(-30.0..30.0))))
            .collect();
        let error =
            ransac_plane(&alone(&points), &RansacParameters::default(), &mut s).unwrap_err();
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
        let error =
            ransac_plane(&alone(&points), &RansacParameters::default(), &mut s).unwrap_err();
        assert!(matches!(error, FitError::OnALine { .. }), "{error}");
    }

    #[test]
    fn the_same_stream_gives_the_same_plane() {
        let points = on_plane(&plane(), 200, 0.8, &mut source());
        let fit = |_| ransac_plane(&alone(&points), &RansacParameters::default(), &mut source());
        assert_eq!(fit(1), fit(2));
    }
}

//! Where the acetabulum is: the rim and the surface that faces the femoral head.

use crate::anatomy::{Hip, Label};
use crate::geometry::{Plane, Point, Vector};
use nalgebra::Matrix3;

/// Number of rays from the femoral head's centre that look for the acetabulum: one for about
/// 2.3 mm^2 of a sphere of 27 mm.
const RAYS: usize = 4000;
/// Step along a ray in mm.
const STEP_MM: f64 = 0.5;
/// How much deeper than the farthest rim point (in mm, from the head's centre) a ray may meet
/// bone: the floor of the acetabular fossa lies behind the articular surface.
const FOSSA_MM: f64 = 5.0;
/// Fewest points that make a rim.
const FEWEST_RIM_POINTS: usize = 8;

/// The acetabulum of one hip, in its APP.
#[derive(Clone, Debug)]
pub struct Acetabulum {
    /// The rim's trace.
    pub rim: Vec<Point>,
    /// Points about 1.5 mm apart on the bone that faces the femoral head: articular surface and
    /// floor of the fossa.
    pub surface: Vec<Point>,
}

/// Why the acetabulum is not found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AcetabulumError {
    #[error(
        "the acetabular rim of {hip} has {points} points, expected {FEWEST_RIM_POINTS} or more; add its trace to the specimen"
    )]
    NoRim { hip: String, points: usize },
    #[error(
        "of {RAYS} rays from the femoral head's centre of {hip} only {hits} meet the pelvis within {reach_mm:.0} mm; check the landmark FH and that the label map holds the pelvis as 1"
    )]
    NoSurface {
        hip: String,
        hits: usize,
        reach_mm: f64,
    },
}

impl Acetabulum {
    /// Finds the surface by rays from the femoral head's centre into the side of the rim's plane
    /// where the bone is: the first pelvis voxel that a ray meets, no farther than the fossa can
    /// be. Rays of a right hip are the mirror image of a left hip's.
    ///
    /// # Errors
    /// When the specimen lacks this side's rim, or the rays do not meet the pelvis.
    pub fn of(hip: &Hip) -> Result<Self, AcetabulumError> {
        let rim = hip.rim_in_app();
        if rim.len() < FEWEST_RIM_POINTS {
            return Err(AcetabulumError::NoRim {
                hip: hip.key(),
                points: rim.len(),
            });
        }
        let opening = opening_plane(&rim, &hip.lateral());
        let reach_mm = FOSSA_MM + rim.iter().map(|p| p.coords.norm()).fold(0.0, f64::max);
        let volume_from_app = hip.app_from_volume.inverse();
        let labels = &hip.specimen.labels;
        let is_pelvis =
            |p: &Point| labels.nearest(&(volume_from_app * p)) == Some(Label::Pelvis.value());
        let mut surface = Vec::new();
        for mut direction in sphere(RAYS) {
            direction.x *= hip.side.lateral_sign();
            let steps = (reach_mm / STEP_MM) as usize;
            let hit = (1..=steps)
                .map(|n| Point::from(direction * (n as f64 * STEP_MM)))
                .find(is_pelvis);
            surface.extend(hit.filter(|p| opening.signed_distance(p) < 0.0));
        }
        if surface.len() < RAYS / 20 {
            return Err(AcetabulumError::NoSurface {
                hip: hip.key(),
                hits: surface.len(),
                reach_mm,
            });
        }
        Ok(Self { rim, surface })
    }

    /// Rim and surface.
    pub fn points(&self) -> impl Iterator<Item = &Point> + '_ {
        self.rim.iter().chain(&self.surface)
    }

    /// The smallest y of rim and surface: how low the acetabulum reaches.
    pub fn lowest(&self) -> f64 {
        self.points().map(|p| p.y).fold(f64::INFINITY, f64::min)
    }

    /// The distance in mm by which the whole acetabulum lies inside a plane; negative where the
    /// plane cuts it.
    pub fn clearance_mm(&self, plane: &Plane) -> f64 {
        self.points()
            .map(|p| -plane.signed_distance(p))
            .fold(f64::INFINITY, f64::min)
    }
}

/// The plane that fits the rim best, normal towards `lateral`.
fn opening_plane(rim: &[Point], lateral: &Vector) -> Plane {
    let n = rim.len() as f64;
    let center = Point::from(rim.iter().map(|p| p.coords).sum::<Vector>() / n);
    let scatter: Matrix3<f64> = rim
        .iter()
        .map(|p| (p - center) * (p - center).transpose())
        .sum();
    let eigen = scatter.symmetric_eigen();
    let normal: Vector = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into();
    Plane::through(&center, &(normal * normal.dot(lateral).signum()))
}

/// `n` unit vectors spread evenly over the sphere (Fibonacci lattice).
fn sphere(n: usize) -> impl Iterator<Item = Vector> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..n).map(move |i| {
        let y = 1.0 - (2 * i + 1) as f64 / n as f64;
        let radius = (1.0 - y * y).sqrt();
        let (sin, cos) = (golden_angle * i as f64).sin_cos();
        Vector::new(radius * cos, y, radius * sin)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Side;
    use crate::surgery::block_hip::{SHELL_END_MM, SHELL_MM, VOXEL_MM, block_hip};

    #[test]
    fn rays_find_the_inside_of_the_shell_on_both_sides() {
        for side in Side::BOTH {
            let hip = block_hip(side);
            let acetabulum = Acetabulum::of(&hip).unwrap();
            assert_eq!(acetabulum.rim.len(), 72);
            for p in &acetabulum.surface {
                let r = p.coords.norm();
                // The nearest voxel's centre may lie half a diagonal off, a ray half a step late.
                assert!((r - SHELL_MM[0]).abs() < 0.87 * VOXEL_MM + STEP_MM, "{p}");
                assert!(p.x * side.lateral_sign() < SHELL_END_MM);
            }
            // The part of the sphere below the rim's plane, as the hits' share of all rays.
            let share = acetabulum.surface.len() as f64 / RAYS as f64;
            let expected = 0.5 * (1.0 + SHELL_END_MM / SHELL_MM[0]);
            assert!((share - expected).abs() < 0.02, "{share} {expected}");
        }
    }

    #[test]
    fn clearance_is_the_nearest_points_distance() {
        let hip = block_hip(Side::Left);
        let acetabulum = Acetabulum::of(&hip).unwrap();
        let plane = Plane::through(&Point::new(0.0, 40.0, 0.0), &Vector::y());
        let (radius, _) = crate::surgery::block_hip::rim_circle();
        assert!((acetabulum.clearance_mm(&plane) - (40.0 - radius)).abs() < 1e-9);
        let cutting = Plane::through(&Point::new(0.0, 10.0, 0.0), &Vector::y());
        assert!((acetabulum.clearance_mm(&cutting) - (10.0 - radius)).abs() < 1e-9);
    }

    #[test]
    fn a_hip_without_rim_or_bone_is_refused() {
        let hip = crate::surgery::toy_hip::toy_hip(Side::Left);
        assert!(matches!(
            Acetabulum::of(&hip),
            Err(AcetabulumError::NoRim { points: 0, .. })
        ));
        let bare = crate::surgery::block_hip::block_hip_without(Side::Left, |_, _, _| true);
        assert!(matches!(
            Acetabulum::of(&bare),
            Err(AcetabulumError::NoSurface { hits: 0, .. })
        ));
    }
}

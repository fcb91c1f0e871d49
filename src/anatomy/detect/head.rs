//! The femoral head as a sphere.

use super::{DetectError, local::Local};
use crate::anatomy::Side;
use crate::geometry::{Point, Vector};
use crate::volume::Surface;
use nalgebra::{Matrix4, Vector4};

/// Vertices at most this far below the femur's top are searched for the head: more than the
/// diameter of any head, less than the distance to the shaft (mm).
const PROXIMAL_MM: f64 = 80.0;

/// Where the fit starts: an average radius (mm).
const START_RADIUS_MM: f64 = 23.0;

/// Vertices within this distance of the sphere belong to the head (mm); the fovea and bony spurs
/// do not.
const BAND_MM: f64 = 1.0;

/// Rounds of the fit.
const ROUNDS: i32 = 200;

/// On coarse surfaces a few vertices may join the band and leave it for ever; the sphere then moves to
/// and fro by less than this (mm), far below the surface's own accuracy.
const SWAY_MM: f64 = 0.05;

/// Sectors that the jackknife leaves out in turn.
const SECTORS: usize = 8;

/// A worse fit is refused (mm RMS).
const MAX_RMS_MM: f64 = 1.0;

/// A femoral head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Head {
    /// In the world of the surfaces (LPS, mm).
    pub center: Point,
    pub radius_mm: f64,
    /// Root mean square distance of the head's vertices from the sphere.
    pub rms_mm: f64,
    /// Number of those vertices.
    pub vertices: usize,
    /// Standard deviation of the centre over all axes (mm), by the jackknife.
    pub uncertainty_mm: f64,
}

impl Head {
    /// A head as large as this one about a centre that a person placed. It has no vertices of its own,
    /// and nobody knows how sure its centre is.
    pub(super) fn about(&self, center: Point) -> Self {
        Self {
            center,
            radius_mm: self.radius_mm,
            rms_mm: f64::NAN,
            vertices: 0,
            uncertainty_mm: f64::NAN,
        }
    }
}

/// Fits a sphere to the part of the head that faces away from the neck: least squares over the
/// vertices in a band about the sphere, which narrows from 5 to 1 mm while the fit settles.
///
/// `local` gives the directions; its origin plays no part.
pub(in crate::anatomy) fn femoral_head(
    femur: &Surface,
    side: Side,
    local: &Local,
) -> Result<Head, DetectError> {
    let points: Vec<Vector> = femur
        .vertices()
        .iter()
        .map(|p| local.coordinates(p))
        .collect();
    let top = points.iter().map(|p| p.y).fold(f64::MIN, f64::max);
    let proximal: Vec<Vector> = points
        .into_iter()
        .filter(|p| p.y > top - PROXIMAL_MM)
        .collect();
    let not_found = |reason: &str| DetectError::NotFound {
        what: "femoral head",
        side,
        reason: reason.into(),
    };
    let most_medial = proximal
        .iter()
        .copied()
        .min_by(|a, b| a.x.total_cmp(&b.x))
        .ok_or_else(|| not_found("the femur has no vertices"))?;
    let away_from_neck = Vector::new(-1.0, 1.0, 0.0).normalize();
    let mut center = most_medial + Vector::x() * START_RADIUS_MM;
    let mut radius = START_RADIUS_MM;
    for round in 0..ROUNDS {
        let band = BAND_MM + 4.0 * 0.9_f64.powi(round);
        let near: Vec<Vector> = proximal
            .iter()
            .copied()
            .filter(|p| {
                let arm = p - center;
                (arm.norm() - radius).abs() < band && arm.dot(&away_from_neck) > -0.2 * arm.norm()
            })
            .collect();
        let (next, next_radius) =
            sphere(&near).ok_or_else(|| not_found("too few vertices lie on one sphere"))?;
        let step = (next - center).norm();
        (center, radius) = (next, next_radius);
        let settled = step < 1e-9 || (round == ROUNDS - 1 && step < SWAY_MM);
        if round > 60 && settled {
            let square: f64 = near
                .iter()
                .map(|p| ((p - center).norm() - radius).powi(2))
                .sum();
            let rms_mm = (square / near.len() as f64).sqrt();
            if rms_mm > MAX_RMS_MM {
                break;
            }
            return Ok(Head {
                center: local.point(&center),
                radius_mm: radius,
                rms_mm,
                vertices: near.len(),
                uncertainty_mm: scatter(&near, &center),
            });
        }
    }
    Err(not_found(
        "the sphere's fit does not settle; is the head whole and round?",
    ))
}

/// The centre's standard deviation by the jackknife: from spheres without one in turn of the
/// [`SECTORS`] sectors around the axis that the head's vertices look along. A head that is no sphere
/// gives each its own centre. Single vertices say nothing here: neighbours err together.
fn scatter(near: &[Vector], center: &Vector) -> f64 {
    let mean: Vector = near.iter().map(|p| p - center).sum();
    let Some(axis) = mean.try_normalize(1e-9) else {
        return f64::NAN;
    };
    let mut beside = Vector::zeros();
    beside[axis.iamin()] = 1.0;
    let u = axis.cross(&beside).normalize();
    let v = axis.cross(&u);
    let sector = |p: &Vector| {
        let arm = p - center;
        let turn = arm.dot(&v).atan2(arm.dot(&u)) / std::f64::consts::TAU + 0.5;
        ((turn * SECTORS as f64) as usize).min(SECTORS - 1)
    };
    let centers: Option<Vec<Vector>> = (0..SECTORS)
        .map(|left_out| {
            let rest: Vec<Vector> = near
                .iter()
                .copied()
                .filter(|p| sector(p) != left_out)
                .collect();
            sphere(&rest).map(|found| found.0)
        })
        .collect();
    let Some(centers) = centers else {
        return f64::NAN;
    };
    let n = SECTORS as f64;
    let middle = centers.iter().sum::<Vector>() / n;
    let square: f64 = centers.iter().map(|c| (c - middle).norm_squared()).sum();
    ((n - 1.0) / n * square).sqrt()
}

/// The algebraic least-squares sphere: |p|^2 = 2 c.p + (r^2 - |c|^2).
pub(super) fn sphere(points: &[Vector]) -> Option<(Vector, f64)> {
    if points.len() < 30 {
        return None;
    }
    // About the mean, so that the normal equations are well conditioned.
    let mean: Vector = points.iter().sum::<Vector>() / points.len() as f64;
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for p in points {
        let q = p - mean;
        let row = Vector4::new(2.0 * q.x, 2.0 * q.y, 2.0 * q.z, 1.0);
        normal += row * row.transpose();
        right += row * q.norm_squared();
    }
    let solution = normal.cholesky()?.solve(&right);
    let offset = solution.xyz();
    let square = solution.w + offset.norm_squared();
    (square > 0.0).then(|| (mean + offset, square.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sphere_of_a_cap_is_found() {
        let center = Vector::new(-320.0, 45.0, -880.0);
        let mut cap = Vec::new();
        for i in 0..40 {
            for j in 0..12 {
                let (a, b) = (i as f64 * 0.157, j as f64 * 0.1);
                cap.push(
                    center + Vector::new(b.cos(), b.sin() * a.cos(), b.sin() * a.sin()) * 23.5,
                );
            }
        }
        let (found, radius) = sphere(&cap).unwrap();
        assert!((found - center).norm() < 1e-8 && (radius - 23.5).abs() < 1e-8);
        assert!(sphere(&cap[..20]).is_none());
    }
}

//! The planned cuts, placed from the anatomy.

use super::ranges::out_of_range;
use super::site::{OsteotomySite, SiteError};
use super::{Cut, CutPlanes};
use crate::anatomy::{Hip, Landmark, frame::FrameError};
use crate::geometry::{Plane, Point, Vector};
use serde::{Deserialize, Serialize};

/// Where the nominal cuts lie (DESIGN section 3, "nominal cuts").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NominalCutParameters {
    /// Smallest distance in mm of each cut to the acetabular rim and the articular surface.
    pub clearance_mm: f64,
    /// Where the ilium cut meets the anterior border: 0 at the AIIS, 1 at the ASIS.
    pub ilium_fraction: f64,
    /// Where the posterior cut lies in the posterior column: 0 at the posterior rim, 1 at the
    /// sciatic notch.
    pub posterior_fraction: f64,
    /// Smallest thickness in mm, seen from the side, of the posterior column that the posterior
    /// cut leaves. The clearance comes first: a column too narrow for both is an error.
    pub column_mm: f64,
}

impl Default for NominalCutParameters {
    fn default() -> Self {
        Self {
            clearance_mm: 8.0,
            ilium_fraction: 0.5,
            posterior_fraction: 0.5,
            column_mm: 3.0,
        }
    }
}

impl NominalCutParameters {
    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        out_of_range(&[
            ("clearance_mm", self.clearance_mm, 0.0..=20.0, " mm"),
            ("ilium_fraction", self.ilium_fraction, 0.0..=1.0, ""),
            ("posterior_fraction", self.posterior_fraction, 0.0..=1.0, ""),
            ("column_mm", self.column_mm, 0.0..=20.0, " mm"),
        ])
    }
}

/// Why no nominal cuts can be placed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NominalCutError {
    #[error(transparent)]
    Frame(#[from] FrameError),
    #[error(transparent)]
    Site(#[from] SiteError),
    #[error(
        "the posterior column of {hip} has {gap_mm:.1} mm between acetabulum and sciatic notch; expected {clearance_mm} mm of clearance and {column_mm} mm of column; lower `clearance_mm` or `column_mm`, or give this hip's cuts by hand"
    )]
    NarrowColumn {
        hip: String,
        gap_mm: f64,
        clearance_mm: f64,
        column_mm: f64,
    },
    #[error(
        "the {} cut of {hip} comes within {clearance_mm:.1} mm of the acetabulum, expected {expected_mm} mm or more; check the landmarks ASIS, AIIS and FH and the rim, or give this hip's cuts by hand",
        .cut.name()
    )]
    Clearance {
        hip: String,
        cut: Cut,
        clearance_mm: f64,
        expected_mm: f64,
    },
}

/// The four nominal cuts, in the APP with the origin at the femoral head.
///
/// Ilium, ischium and posterior contain the LR axis (facts 2.13), so each is a line seen from the
/// side; there lie the points that they pass through:
///
/// - *posterior*: parallel to the posterior border of the column from ischium to sciatic notch
///   (the median slope of that border), midway between it and the acetabulum;
/// - *ilium*: from the anterior border midway between AIIS and ASIS to the posterior cut, at the
///   height midway between the notch's roof and the rim point nearest to it, or higher where it
///   would not clear the acetabulum;
/// - *ischium*: from the posterior cut at the level of the acetabulum's lowest point (of the rim, or
///   of the articular surface where that hangs lower) forward, as steep as it takes to pass the clearance below the acetabulum: through the infracotyloid groove;
/// - *pubis*: sagittal, the clearance medial of the acetabulum.
///
/// # Errors
/// When landmarks or rim are missing, or the bone leaves no room for the clearance.
pub fn nominal_cuts(
    hip: &Hip,
    parameters: &NominalCutParameters,
) -> Result<CutPlanes, NominalCutError> {
    let OsteotomySite { acetabulum, column } = OsteotomySite::of(hip)?;
    let clearance = parameters.clearance_mm;
    let in_app = |landmark| {
        hip.landmark(landmark)
            .map(|p| from_the_side(&(hip.app_from_volume * p)))
    };
    let (asis, aiis) = (in_app(Landmark::Asis)?, in_app(Landmark::Aiis)?);
    let joint: Vec<Vector> = acetabulum.points().map(from_the_side).collect();
    let rim: Vec<Vector> = acetabulum.rim.iter().map(from_the_side).collect();

    let up = Vector::new(0.0, 1.0, median_slope(&column.border)).normalize();
    let backward = up.cross(&Vector::x());
    let joint_reach = reach(&joint, &backward);
    let gap_mm = -reach(&column.border, &-backward) - joint_reach;
    if gap_mm < clearance + parameters.column_mm {
        return Err(NominalCutError::NarrowColumn {
            hip: hip.key(),
            gap_mm,
            clearance_mm: clearance,
            column_mm: parameters.column_mm,
        });
    }
    let depth = (parameters.posterior_fraction * gap_mm)
        .max(clearance)
        .min(gap_mm - parameters.column_mm);
    let posterior = Plane {
        normal: backward,
        offset_mm: joint_reach + depth,
    };
    let at_height = |y: f64| {
        let foot = backward * posterior.offset_mm;
        foot + up * ((y - foot.y) / up.y)
    };

    let ilium_front = aiis + (asis - aiis) * parameters.ilium_fraction;
    let notch = column.roof();
    let planned = at_height(0.5 * (notch.y + nearest(&rim, &notch).y)) - ilium_front;
    let rise = joint
        .iter()
        .map(|p| lowest_rise(&(p - ilium_front), clearance))
        .fold(planned.y.atan2(-planned.z), f64::max);
    let ilium_backward = Vector::new(0.0, rise.sin(), -rise.cos());
    let ilium = Plane::through(&ilium_front.into(), &Vector::x().cross(&ilium_backward));

    let ischium_back = at_height(acetabulum.lowest());
    let slope = joint
        .iter()
        .map(|p| steepest_slope(&(p - ischium_back), clearance))
        .fold(f64::INFINITY, f64::min);
    let forward = Vector::new(0.0, slope.sin(), slope.cos());
    let ischium = Plane::through(&ischium_back.into(), &Vector::x().cross(&forward));

    let medial = -hip.lateral();
    let pubis = Plane {
        normal: medial,
        offset_mm: acetabulum
            .points()
            .map(|p| p.coords.dot(&medial))
            .fold(f64::NEG_INFINITY, f64::max)
            + clearance,
    };

    let cuts = CutPlanes::new([ilium, ischium, posterior, pubis]);
    for cut in Cut::ALL {
        let clearance_mm = acetabulum.clearance_mm(cuts.get(cut));
        // The clearances that are met by construction are met up to rounding.
        if clearance_mm < clearance - 1e-6 {
            return Err(NominalCutError::Clearance {
                hip: hip.key(),
                cut,
                clearance_mm,
                expected_mm: clearance,
            });
        }
    }
    Ok(cuts)
}

/// A position projected on the sagittal plane through the femoral head.
fn from_the_side(p: &Point) -> Vector {
    Vector::new(0.0, p.y, p.z)
}

/// How far points reach along a direction.
fn reach(points: &[Vector], direction: &Vector) -> f64 {
    points
        .iter()
        .map(|p| p.dot(direction))
        .fold(f64::NEG_INFINITY, f64::max)
}

/// The point nearest to `to`; `points` must not be empty.
fn nearest(points: &[Vector], to: &Vector) -> Vector {
    let mut best = points[0];
    for p in points {
        if (p - to).norm_squared() < (best - to).norm_squared() {
            best = *p;
        }
    }
    best
}

/// dz / dy as the median over all pairs of points (Theil and Sen): the ischial spine, which
/// stands out of the border, does not tilt it.
fn median_slope(border: &[Vector]) -> f64 {
    let mut slopes: Vec<f64> = Vec::new();
    for (n, a) in border.iter().enumerate() {
        slopes.extend(border[n + 1..].iter().map(|b| (b.z - a.z) / (b.y - a.y)));
    }
    slopes.sort_by(f64::total_cmp);
    slopes[slopes.len() / 2]
}

/// The angle (rad, upward from anterior) of the steepest line through the origin that passes
/// `clearance` below `p`.
fn steepest_slope(p: &Vector, clearance: f64) -> f64 {
    p.y.atan2(p.z) - (clearance / p.norm()).clamp(-1.0, 1.0).asin()
}

/// The angle (rad, upward from posterior) of the lowest line through the origin that passes
/// `clearance` above `p`.
fn lowest_rise(p: &Vector, clearance: f64) -> f64 {
    p.y.atan2(-p.z) + (clearance / p.norm()).clamp(-1.0, 1.0).asin()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Side;
    use crate::surgery::block_hip::{
        BORDER_MM, SHELL_MM, VOXEL_MM, block_hip, block_hip_without, rim_circle,
    };

    fn cuts(side: Side) -> CutPlanes {
        nominal_cuts(&block_hip(side), &NominalCutParameters::default()).unwrap()
    }

    #[test]
    fn every_cut_clears_the_acetabulum_and_faces_outward() {
        for side in Side::BOTH {
            let OsteotomySite { acetabulum, .. } = OsteotomySite::of(&block_hip(side)).unwrap();
            let cuts = cuts(side);
            for cut in Cut::ALL {
                let plane = cuts.get(cut);
                assert!(
                    acetabulum.clearance_mm(plane) > 8.0 - 1e-9,
                    "{side} {cut:?}"
                );
                assert!((plane.normal.norm() - 1.0).abs() < 1e-12);
                let along = plane.normal.x.abs();
                assert_eq!(along, if cut == Cut::Pubis { 1.0 } else { 0.0 }, "{cut:?}");
            }
        }
    }

    #[test]
    fn the_posterior_cut_halves_the_column() {
        let cuts = cuts(Side::Left);
        let plane = cuts.get(Cut::Posterior);
        // The border is a straight line, so the cut is parallel to it.
        assert!(
            (plane.normal + Vector::z()).norm() < 1e-9,
            "{:?}",
            plane.normal
        );
        let middle = 0.5 * (rim_circle().0 - BORDER_MM);
        assert!(
            (plane.offset_mm - middle).abs() < VOXEL_MM,
            "{}",
            plane.offset_mm
        );
    }

    #[test]
    fn the_ilium_cut_runs_from_between_the_spines_to_the_posterior_cut() {
        let cuts = cuts(Side::Right);
        let plane = cuts.get(Cut::Ilium);
        let front = Point::new(0.0, 0.5 * (85.0 + 45.0), 25.0);
        assert!(plane.signed_distance(&front).abs() < 1e-9);
        // The rim point nearest to the notch (40, -50) lies in its direction, among points 5 deg
        // apart.
        let (radius, notch) = (rim_circle().0, nalgebra::Vector2::new(40.0, BORDER_MM));
        let height = 0.5 * (notch.x + radius * notch.normalize().x);
        let back = Point::new(0.0, height, -cuts.get(Cut::Posterior).offset_mm);
        assert!(
            plane.signed_distance(&back).abs() < 1.0,
            "{}",
            plane.signed_distance(&back)
        );
    }

    #[test]
    fn the_ischium_cut_touches_the_clearance_below_the_rim() {
        let hip = block_hip(Side::Left);
        let cuts = cuts(Side::Left);
        let plane = cuts.get(Cut::Ischium);
        let back = Point::new(0.0, -rim_circle().0, -cuts.get(Cut::Posterior).offset_mm);
        assert!(plane.signed_distance(&back).abs() < 1e-9);
        let clearance = OsteotomySite::of(&hip)
            .unwrap()
            .acetabulum
            .clearance_mm(plane);
        assert!((clearance - 8.0).abs() < 1e-9, "{clearance}");
        assert!(
            plane.normal.y < 0.0 && plane.normal.z < 0.0,
            "falls forward"
        );
    }

    #[test]
    fn the_pubis_cut_lies_the_clearance_medial_of_the_floor() {
        for side in Side::BOTH {
            let cuts = cuts(side);
            let plane = cuts.get(Cut::Pubis);
            assert_eq!(plane.normal, -Vector::x() * side.lateral_sign());
            assert!(
                (plane.offset_mm - SHELL_MM[0] - 8.0).abs() < 1.5,
                "{}",
                plane.offset_mm
            );
        }
    }

    #[test]
    fn mirrored_hips_have_mirrored_cuts() {
        let (left, right) = (cuts(Side::Left), cuts(Side::Right));
        for cut in Cut::ALL {
            let (l, r) = (left.get(cut), right.get(cut));
            let mirrored = Vector::new(-l.normal.x, l.normal.y, l.normal.z);
            assert!((mirrored - r.normal).norm() < 1e-9, "{cut:?}");
            assert!((l.offset_mm - r.offset_mm).abs() < 1e-9, "{cut:?}");
        }
    }

    #[test]
    fn a_low_ilium_cut_is_lifted_off_the_acetabulum() {
        let hip = block_hip(Side::Left);
        let parameters = NominalCutParameters {
            ilium_fraction: 0.0,
            clearance_mm: 11.0,
            posterior_fraction: 0.0,
            ..Default::default()
        };
        let cuts = nominal_cuts(&hip, &parameters).unwrap();
        let clearance = OsteotomySite::of(&hip)
            .unwrap()
            .acetabulum
            .clearance_mm(cuts.get(Cut::Ilium));
        assert!((clearance - 11.0).abs() < 1e-9, "{clearance}");
    }

    #[test]
    fn a_column_without_room_is_an_error_with_numbers() {
        let thin = block_hip_without(Side::Left, |_, y, z| y < 40.0 && z < -39.0);
        let error = nominal_cuts(&thin, &NominalCutParameters::default()).unwrap_err();
        let text = error.to_string();
        assert!(
            matches!(error, NominalCutError::NarrowColumn { .. }),
            "{text}"
        );
        assert!(text.contains("toy/left") && text.contains("8 mm"), "{text}");
    }

    #[test]
    fn slopes_clear_a_point_by_the_given_distance() {
        for p in [Vector::new(0.0, 2.0, 25.0), Vector::new(0.0, -9.0, 40.0)] {
            let slope = steepest_slope(&p, 8.0);
            let above = Vector::new(0.0, slope.cos(), -slope.sin());
            assert!((p.dot(&above) - 8.0).abs() < 1e-12);
            let mirrored = Vector::new(0.0, p.y, -p.z);
            let rise = lowest_rise(&mirrored, 8.0);
            let above = Vector::new(0.0, rise.cos(), rise.sin());
            assert!((mirrored.dot(&above) + 8.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_median_slope_ignores_a_spine() {
        let border: Vec<Vector> = (0..40)
            .map(|n| {
                let y = f64::from(n);
                let spine = if (10..20).contains(&n) { 8.0 } else { 0.0 };
                Vector::new(0.0, y, -45.0 + 0.1 * y - spine)
            })
            .collect();
        assert!((median_slope(&border) - 0.1).abs() < 0.02);
    }
}

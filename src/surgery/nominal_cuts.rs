//! The planned cuts, placed from the anatomy.

use super::acetabulum::{Acetabulum, AcetabulumError};
use super::posterior_column::{ColumnError, posterior_border};
use super::ranges::out_of_range;
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
            column_mm: 4.0,
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
    Acetabulum(#[from] AcetabulumError),
    #[error(transparent)]
    Column(#[from] ColumnError),
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
        "the {} cut of {hip} comes within {clearance_mm:.1} mm of the acetabulum, expected {expected_mm} mm or more; check the landmarks ASIS, AIIS, FH and GSN and the rim, or give this hip's cuts by hand",
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
/// - *posterior*: parallel to the posterior border of the column between sciatic notch and
///   ischium (the median slope of that border), midway between it and the acetabulum;
/// - *ilium*: from the anterior border midway between AIIS and ASIS to the posterior cut, at the
///   height midway between the notch and the rim point nearest to it, or higher where it would
///   not clear the acetabulum;
/// - *ischium*: from the posterior cut at the level of the lowest rim point forward, as steep as
///   it takes to pass the clearance below the acetabulum: through the infracotyloid groove;
/// - *pubis*: sagittal, the clearance medial of the acetabulum.
///
/// # Errors
/// When landmarks or rim are missing, or the bone leaves no room for the clearance.
pub fn nominal_cuts(
    hip: &Hip,
    parameters: &NominalCutParameters,
) -> Result<CutPlanes, NominalCutError> {
    let acetabulum = Acetabulum::of(hip)?;
    let clearance = parameters.clearance_mm;
    let in_app = |landmark| {
        hip.landmark(landmark)
            .map(|p| from_the_side(&(hip.app_from_volume * p)))
    };
    let (asis, aiis) = (in_app(Landmark::Asis)?, in_app(Landmark::Aiis)?);
    let notch = in_app(Landmark::Gsn)?;
    let joint: Vec<Vector> = acetabulum.points().map(from_the_side).collect();
    let rim: Vec<Vector> = acetabulum.rim.iter().map(from_the_side).collect();
    let lowest_rim = rim.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);

    let border = posterior_border(hip, &acetabulum, lowest_rim..=notch.y)?;
    let up = Vector::new(0.0, 1.0, median_slope(&border)).normalize();
    let backward = up.cross(&Vector::x());
    let joint_reach = reach(&joint, &backward);
    let gap_mm = -reach(&border, &-backward) - joint_reach;
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
    let planned = at_height(0.5 * (notch.y + nearest(&rim, &notch).y)) - ilium_front;
    let rise = joint
        .iter()
        .map(|p| lowest_rise(&(p - ilium_front), clearance))
        .fold(planned.y.atan2(-planned.z), f64::max);
    let ilium_backward = Vector::new(0.0, rise.sin(), -rise.cos());
    let ilium = Plane::through(&ilium_front.into(), &Vector::x().cross(&ilium_backward));

    let ischium_back = at_height(lowest_rim);
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

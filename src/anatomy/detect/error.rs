//! Why a landmark was not found.

use crate::anatomy::Side;

/// Why landmarks or rims could not be found. The bones then differ from what the rules expect:
/// bones of the wrong side, in another frame, incomplete, or of unusual shape.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DetectError {
    #[error("the two hip bones have no left-right axis: their centres are {apart_mm:.1} mm apart")]
    NoAxis { apart_mm: f64 },
    #[error(
        "the left hip bone lies to the right of the right one ({apart_mm:.1} mm along LPS x); are the files or their frame swapped?"
    )]
    SidesSwapped { apart_mm: f64 },
    #[error("the pelvic frame does not settle within {0} rounds; are the hip bones whole?")]
    FrameUnsettled(usize),
    #[error(
        "the {side} femoral head is no sphere: {rms_mm:.2} mm RMS from the best one (radius {radius_mm:.1} mm); expected below {limit_mm} mm"
    )]
    Head {
        side: Side,
        rms_mm: f64,
        radius_mm: f64,
        limit_mm: f64,
    },
    #[error("the {side} {what} was not found: {reason}")]
    NotFound {
        what: &'static str,
        side: Side,
        reason: String,
    },
    /// It was not sought: what its rule starts from is missing.
    #[error("the {side} {what} rests on what is missing: {on}")]
    Rests {
        what: &'static str,
        side: Side,
        /// What that is, and why it is missing where nothing else says so.
        on: String,
    },
}

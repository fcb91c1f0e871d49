//! Are landmarks sure, and alike on both sides?

use super::{Check, Verdict};
use crate::anatomy::{Confidence, Landmark, Side, Specimen};

/// Distances between landmarks of one side that are compared with the other side's.
const DISTANCES: [(Landmark, Landmark); 6] = [
    (Landmark::Asis, Landmark::Fh),
    (Landmark::Aiis, Landmark::Fh),
    (Landmark::Fh, Landmark::Sps),
    (Landmark::Fh, Landmark::Ips),
    (Landmark::Fh, Landmark::Mof),
    (Landmark::Fh, Landmark::Gsn),
];

pub(super) fn checks(specimen: &Specimen) -> Vec<Check> {
    let mut checks = vec![low_confidence(specimen)];
    for (from, to) in DISTANCES {
        let length = |side| {
            let a = specimen.landmarks.get(from, side)?;
            Some((specimen.landmarks.get(to, side)? - a).norm())
        };
        let (Some(left), Some(right)) = (length(Side::Left), length(Side::Right)) else {
            continue;
        };
        let what = format!("{} to {}, left and right", from.name(), to.name());
        let apart = (left - right).abs();
        let mut check = Check::number(what, apart, "mm apart", (0.0, 8.0), (0.0, 20.0));
        check.found = format!("{left:.1} and {right:.1} mm");
        check.expected = "at most 8 mm apart".into();
        checks.push(check.advise(
            "one of the four points may be off: it tilts the APP, and with it cuts, movements and every angle \
             in tables; look at both sides' points in the pictures and pick the wrong one anew",
        ));
    }
    checks
}

fn low_confidence(specimen: &Specimen) -> Check {
    let landmarks = specimen.landmarks.iter().map(|(landmark, side, _)| {
        let from = specimen.landmarks.provenance(landmark, side);
        (landmark.key(side), from.unwrap_or_default())
    });
    let rims = Side::BOTH.map(|side| {
        let from = specimen.rims[side.index()].provenance;
        (format!("{side} rim"), from)
    });
    let all: Vec<_> = landmarks.chain(rims).collect();
    let known = all
        .iter()
        .filter(|of| of.1.uncertainty_mm.is_some())
        .count();
    let low: Vec<String> = all
        .iter()
        .filter(|of| of.1.confidence() == Some(Confidence::Low))
        .map(|(name, from)| format!("{name} {:.1} mm", from.uncertainty_mm.unwrap_or(f64::NAN)))
        .collect();
    Check {
        what: "landmarks and rims of low confidence".into(),
        found: match (low.is_empty(), known) {
            (false, _) => low.join(", "),
            (true, 0) => "none known: given, not found by rule".into(),
            (true, _) => format!("none of {known}"),
        },
        expected: format!("none beyond {} mm", Confidence::MEDIUM_MM),
        verdict: match low.is_empty() {
            true => Verdict::Fine,
            false => Verdict::Doubtful,
        },
        advice: "the bone does not tell where exactly it lies: the place may be another corner or spine of \
                 the same bone; look at it in the pictures and give its place in landmarks.csv"
            .into(),
    }
}

//! Proofs that a specimen is what it says: sides, frames, landmarks on bone, whole bones, Hounsfield
//! units.
//!
//! [`specimen_problems`](super::specimen_problems) says whether a specimen is well formed; these
//! checks ask its own data whether it is right. They read label map, CT, landmarks and rims against
//! each other: a femoral head's centre, for instance, against a sphere fitted to the femur's label.

mod content;
mod edges;
mod extent;
mod frames;
mod hip;
mod labels;
mod landmarks;

use super::{Side, Specimen};
use crate::anatomy::Label;
use crate::volume::Surface;
use std::sync::Arc;

/// How a check came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    Fine,
    /// Unusual; look at the pictures.
    Doubtful,
    /// A study on this specimen would give wrong numbers.
    Wrong,
}

impl Verdict {
    /// `ok`, `doubtful` or `WRONG`, as tables print it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fine => "ok",
            Self::Doubtful => "doubtful",
            Self::Wrong => "WRONG",
        }
    }
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    pub what: String,
    pub found: String,
    pub expected: String,
    pub verdict: Verdict,
    /// What it does to a study where it is not fine, and what to do about it.
    pub advice: String,
}

impl Check {
    /// A check of a number: fine within `fine`, doubtful within `bearable`, wrong beyond and if it
    /// is not a number.
    pub fn number(
        what: impl Into<String>,
        value: f64,
        unit: &str,
        fine: (f64, f64),
        bearable: (f64, f64),
    ) -> Self {
        let within = |(low, high): (f64, f64)| (low..=high).contains(&value);
        let verdict = match (within(fine), within(bearable)) {
            (true, _) => Verdict::Fine,
            (false, true) => Verdict::Doubtful,
            (false, false) => Verdict::Wrong,
        };
        let bound = |v: f64| {
            format!("{v:.6}")
                .trim_end_matches('0')
                .trim_end_matches('.')
                .to_owned()
        };
        let expected = match fine {
            (low, high) if low.is_infinite() => format!("at most {}", bound(high)),
            (low, high) if high.is_infinite() => format!("at least {}", bound(low)),
            (low, high) => format!("{} to {}", bound(low), bound(high)),
        };
        let digits = if value.abs() >= 100.0 { 0 } else { 1 };
        Self {
            what: what.into(),
            found: format!("{value:.digits$} {unit}").trim_end().to_owned(),
            expected: format!("{expected} {unit}").trim_end().to_owned(),
            verdict,
            advice: String::new(),
        }
    }

    /// A check that either holds or makes the specimen wrong.
    pub fn holds(
        what: impl Into<String>,
        holds: bool,
        found: impl Into<String>,
        expected: impl Into<String>,
    ) -> Self {
        Self {
            what: what.into(),
            found: found.into(),
            expected: expected.into(),
            verdict: if holds { Verdict::Fine } else { Verdict::Wrong },
            advice: String::new(),
        }
    }

    /// The same check with what to say where it is not fine.
    #[must_use]
    pub fn advise(mut self, advice: impl Into<String>) -> Self {
        self.advice = advice.into();
        self
    }
}

/// Label surfaces that several checks measure to (LPS, mm).
struct Bones {
    pelvis: Surface,
    /// By [`Side::index`].
    femurs: [Surface; 2],
}

/// All checks of a specimen that has no [`specimen_problems`](super::specimen_problems), in the order
/// in which people read them.
pub fn check_specimen(specimen: &Arc<Specimen>) -> Vec<Check> {
    let surface = |label: Label| {
        Surface::from_mask(
            &specimen.labels,
            |v| v == label.value(),
            &Default::default(),
        )
    };
    let bones = Bones {
        pelvis: surface(Label::Pelvis),
        femurs: Side::BOTH.map(|side| surface(Label::femur(side))),
    };
    let mut checks = content::checks(specimen, &bones);
    checks.extend(labels::checks(specimen));
    checks.extend(edges::checks(specimen, &bones));
    checks.extend(extent::checks(specimen));
    checks.extend(landmarks::checks(specimen));
    checks.extend(frames::checks(specimen, &bones));
    let mut radii = [f64::NAN; 2];
    for side in Side::BOTH {
        let (of_hip, radius_mm) = hip::checks(specimen, &bones, side);
        checks.extend(of_hip);
        radii[side.index()] = radius_mm;
    }
    checks.push(hip::radii(radii));
    checks
}

#[cfg(test)]
mod tests;

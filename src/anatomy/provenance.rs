//! How a landmark or a rim came to be known, and how surely.

use serde::{Deserialize, Serialize};

/// How a place came to be known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Found {
    /// By rule on the bone's surface ([`super::detect`]).
    Detected,
    /// It came with the data, which do not say how it was found.
    Given,
    /// Placed by a person.
    Picked,
}

impl Found {
    /// `detected`, `given` or `picked`, as files write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Detected => "detected",
            Self::Given => "given",
            Self::Picked => "picked",
        }
    }
}

/// How a place came to be known, and how surely. Files that do not say leave both out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Provenance {
    pub found: Option<Found>,
    /// Standard deviation of the place over all three axes together (mm): the root of the mean
    /// square distance to where it might as well lie.
    pub uncertainty_mm: Option<f64>,
}

impl Provenance {
    /// Of what came with the data.
    pub const GIVEN: Self = Self {
        found: Some(Found::Given),
        uncertainty_mm: None,
    };

    /// Of what was found by rule.
    pub fn detected(uncertainty_mm: f64) -> Self {
        Self {
            found: Some(Found::Detected),
            uncertainty_mm: Some(uncertainty_mm),
        }
    }

    /// What the uncertainty comes to, or `None` where it is not known.
    pub fn confidence(&self) -> Option<Confidence> {
        self.uncertainty_mm.map(Confidence::of)
    }
}

/// An uncertainty in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Confidence {
    Low,
    Medium,
    High,
}

impl Confidence {
    /// As good as a careful pick (mm): the protocol's picks scatter by 3 mm.
    pub const HIGH_MM: f64 = 3.0;
    /// The most that raters scatter at a clear landmark (mm): the ASIS of the six VSD subjects
    /// (docs/specimens.md).
    pub const MEDIUM_MM: f64 = 6.0;

    /// High up to [`Self::HIGH_MM`], medium up to [`Self::MEDIUM_MM`], low beyond and for what is
    /// not a number.
    pub fn of(uncertainty_mm: f64) -> Self {
        if uncertainty_mm <= Self::HIGH_MM {
            Self::High
        } else if uncertainty_mm <= Self::MEDIUM_MM {
            Self::Medium
        } else {
            Self::Low
        }
    }

    /// `low`, `medium` or `high`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Low => "low",
            Self::Medium => "medium",
            Self::High => "high",
        }
    }
}

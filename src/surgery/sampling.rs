//! Random plausible fragments.

use super::CutPlanes;
use super::acetabulum::{Acetabulum, AcetabulumError};
use super::fragment::{FragmentError, FragmentParameters, SurgeryMap};
use super::plausibility::{PlausibilityParameters, Rejection, plausible_fragment};
use super::random_cuts::{CutPivots, RandomCutParameters, random_cuts};
use crate::anatomy::{Hip, frame::FrameError};
use crate::random::{Purpose, stream};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How a study's fragments are drawn.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FragmentSamplingParameters {
    /// Spread of the random cuts.
    pub random_cuts: RandomCutParameters,
    /// Chisel and hull.
    pub fragment: FragmentParameters,
    /// Rules that a fragment has to keep.
    pub plausibility: PlausibilityParameters,
    /// Draws after which a hip is given up.
    pub max_draws: usize,
}

impl Default for FragmentSamplingParameters {
    fn default() -> Self {
        Self {
            random_cuts: RandomCutParameters::default(),
            fragment: FragmentParameters::default(),
            plausibility: PlausibilityParameters::default(),
            max_draws: 2000,
        }
    }
}

impl FragmentSamplingParameters {
    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let nested = [
            ("random_cuts", self.random_cuts.problems()),
            ("fragment", self.fragment.problems()),
            ("plausibility", self.plausibility.problems()),
        ];
        let mut problems = Vec::new();
        for (section, found) in nested {
            let found = found.into_iter();
            problems.extend(found.map(|(field, message)| (format!("{section}.{field}"), message)));
        }
        if self.max_draws == 0 {
            problems.push(("max_draws".into(), "is 0; expected 1 or more".into()));
        }
        problems
    }
}

/// How many draws were rejected, by the first rule that each broke.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RejectionCounts {
    counts: BTreeMap<Rejection, usize>,
}

impl RejectionCounts {
    /// Counts one rejection.
    pub fn add(&mut self, rejection: Rejection) {
        *self.counts.entry(rejection).or_default() += 1;
    }

    /// Adds the counts of other draws.
    pub fn merge(&mut self, other: &Self) {
        for (rejection, count) in other.iter() {
            *self.counts.entry(rejection).or_default() += count;
        }
    }

    /// Each reason that occurred and its count, in the order of the rules.
    pub fn iter(&self) -> impl Iterator<Item = (Rejection, usize)> + '_ {
        self.counts
            .iter()
            .map(|(&rejection, &count)| (rejection, count))
    }

    /// The number of rejected draws.
    pub fn total(&self) -> usize {
        self.counts.values().sum()
    }
}

impl std::fmt::Display for RejectionCounts {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (n, (rejection, count)) in self.iter().enumerate() {
            let separator = if n == 0 { "" } else { ", " };
            write!(f, "{separator}{count} x {rejection}")?;
        }
        Ok(())
    }
}

/// Why no fragment was drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    #[error(transparent)]
    Frame(#[from] FrameError),
    #[error(transparent)]
    Acetabulum(#[from] AcetabulumError),
    #[error("the nominal cuts are unusable: {0}")]
    Nominal(#[from] FragmentError),
    #[error(
        "none of {draws} random cuts of {hip} makes a plausible fragment ({counts}); look at the nominal cuts, lower the spread in `random_cuts`, or widen `plausibility`"
    )]
    NothingPlausible {
        hip: String,
        draws: usize,
        counts: RejectionCounts,
    },
}

/// Draws random cuts until they make a plausible fragment, from the stream of (`seed`,
/// [`Purpose::Cuts`], `key`).
///
/// # Errors
/// When rim or landmarks are missing, the nominal cuts are unusable, or `max_draws` draws are
/// rejected.
pub fn sample_fragment(
    hip: &Hip,
    nominal: &CutPlanes,
    parameters: &FragmentSamplingParameters,
    seed: u64,
    key: &str,
) -> Result<(SurgeryMap, RejectionCounts), SampleError> {
    let acetabulum = Acetabulum::of(hip)?;
    let pivots = CutPivots::of(hip, nominal, &parameters.fragment)?;
    let mut stream = stream(seed, Purpose::Cuts, key);
    let mut counts = RejectionCounts::default();
    for _ in 0..parameters.max_draws {
        let spread = &parameters.random_cuts;
        let cuts = random_cuts(nominal, &pivots, hip.side, spread, &mut stream);
        let rules = &parameters.plausibility;
        match plausible_fragment(hip, &acetabulum, &cuts, &parameters.fragment, rules)? {
            Ok(carving) => return Ok((carving.into_map(hip, &cuts), counts)),
            Err(rejection) => counts.add(rejection),
        }
    }
    Err(SampleError::NothingPlausible {
        hip: hip.key(),
        draws: parameters.max_draws,
        counts,
    })
}

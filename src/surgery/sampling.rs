//! Random plausible fragments.

use super::CutPlanes;
use super::fragment::{FragmentError, FragmentParameters, SurgeryMap};
use super::plausibility::{PlausibilityParameters, Rejection, plausible_fragment};
use super::random_cuts::{CutPivots, RandomCutParameters, random_cuts};
use super::site::{OsteotomySite, SiteError};
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
    Site(#[from] SiteError),
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
    let site = OsteotomySite::of(hip)?;
    let pivots = CutPivots::of(hip, nominal, &parameters.fragment)?;
    let mut stream = stream(seed, Purpose::Cuts, key);
    let mut counts = RejectionCounts::default();
    for _ in 0..parameters.max_draws {
        let spread = &parameters.random_cuts;
        let cuts = random_cuts(nominal, &pivots, hip.side, spread, &mut stream);
        let rules = &parameters.plausibility;
        match plausible_fragment(hip, &site, &cuts, &parameters.fragment, rules)? {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::{Label, Side};
    use crate::geometry::Vector;
    use crate::surgery::block_hip::block_hip;
    use crate::surgery::nominal_cuts::{NominalCutParameters, nominal_cuts};
    use crate::surgery::{Acetabulum, Cut};

    fn drawn(side: Side, key: &str) -> (SurgeryMap, RejectionCounts) {
        let hip = block_hip(side);
        let nominal = nominal_cuts(&hip, &NominalCutParameters::default()).unwrap();
        sample_fragment(&hip, &nominal, &Default::default(), 3, key).unwrap()
    }

    #[test]
    fn mirrored_hips_and_equal_keys_give_mirrored_surgeries() {
        for key in ["f00", "f01"] {
            let (left, left_counts) = drawn(Side::Left, key);
            let (right, right_counts) = drawn(Side::Right, key);
            assert_eq!(left_counts, right_counts);
            for cut in Cut::ALL {
                let (l, r) = (left.cuts.get(cut), right.cuts.get(cut));
                let mirrored = Vector::new(-l.normal.x, l.normal.y, l.normal.z);
                assert!((mirrored - r.normal).norm() < 1e-9, "{cut:?}");
                assert!((l.offset_mm - r.offset_mm).abs() < 1e-9, "{cut:?}");
            }
            // The block hip's grid mirrors onto itself; only the femora have other labels.
            let ni = left.labels.grid.dims[0];
            let of_surgery = |v: u8| {
                [Label::Pelvis, Label::Fragment, Label::Cut]
                    .into_iter()
                    .find(|l| l.value() == v)
            };
            for (offset, &value) in left.labels.data.iter().enumerate() {
                let [i, j, k] = left.labels.grid.voxel(offset);
                let other = right.labels.at(ni - 1 - i, j, k);
                assert_eq!(of_surgery(value), of_surgery(other), "{key} {i} {j} {k}");
            }
        }
    }

    #[test]
    fn draws_are_repeatable_differ_by_key_and_keep_the_rules() {
        let (a, counts) = drawn(Side::Left, "f00");
        assert_eq!((a.clone(), counts), drawn(Side::Left, "f00"));
        let (b, _) = drawn(Side::Left, "f01");
        assert_ne!(a.cuts, b.cuts);
        let acetabulum = Acetabulum::of(&block_hip(Side::Left)).unwrap();
        for cut in Cut::ALL {
            assert!(acetabulum.clearance_mm(a.cuts.get(cut)) >= 4.0);
        }
    }

    #[test]
    fn giving_up_says_why() {
        let hip = block_hip(Side::Left);
        let nominal = nominal_cuts(&hip, &NominalCutParameters::default()).unwrap();
        let mut parameters = FragmentSamplingParameters {
            max_draws: 7,
            ..Default::default()
        };
        parameters.plausibility.clearance_mm = 20.0;
        let error = sample_fragment(&hip, &nominal, &parameters, 3, "f00").unwrap_err();
        let text = error.to_string();
        let SampleError::NothingPlausible { counts, .. } = error else {
            panic!("{text}");
        };
        assert_eq!(counts.total(), 7);
        assert!(
            text.contains("x ilium cut too close to the acetabulum"),
            "{text}"
        );
    }

    #[test]
    fn counts_add_up() {
        let mut counts = RejectionCounts::default();
        counts.add(Rejection::RingBroken);
        counts.add(Rejection::TooSmall);
        let mut sum = counts.clone();
        sum.merge(&counts);
        assert_eq!(sum.total(), 4);
        assert_eq!(sum.to_string(), "2 x too small, 2 x pelvic ring broken");
    }

    #[test]
    fn problems_carry_the_path_of_the_field() {
        let mut parameters = FragmentSamplingParameters::default();
        parameters.random_cuts.pubis.rotation_sd_deg = 200.0;
        parameters.max_draws = 0;
        let fields: Vec<String> = parameters.problems().into_iter().map(|(f, _)| f).collect();
        assert_eq!(fields, ["random_cuts.pubis.rotation_sd_deg", "max_draws"]);
    }
}

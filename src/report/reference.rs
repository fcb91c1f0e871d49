//! The published figures, embedded from `studies/paper/reference.toml`.

use serde::Deserialize;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Mean and standard deviation, in degrees or mm.
pub type MeanSd = [f64; 2];

/// The paper's figures that a study is held against.
#[derive(Debug, Deserialize)]
pub struct Reference {
    /// Names of the scenarios as the paper prints them.
    pub scenarios: BTreeMap<String, String>,
    /// Table I by scenario and column.
    pub table1: BTreeMap<String, BTreeMap<String, MeanSd>>,
    /// Shares of registrations under a threshold, by criterion and scenario.
    pub success_rates: BTreeMap<String, BTreeMap<String, f64>>,
    /// Table II, in the paper's order.
    pub table2: Vec<Comparison>,
    pub sampling: Sampling,
    pub initialization_offset: Offset,
    /// By scenario; the paper does not say after which stage.
    pub pelvis_offset_after_registration: BTreeMap<String, Offset>,
}

/// One row of Table II: p values as the paper prints them.
#[derive(Debug, Deserialize)]
pub struct Comparison {
    pub first: String,
    pub second: String,
    pub p: PValues,
}

/// The three tests of one row of Table II.
#[derive(Debug, Deserialize)]
pub struct PValues {
    pub rotation: String,
    pub translation: String,
    pub lce: String,
}

/// How the study was sampled.
#[derive(Debug, Deserialize)]
pub struct Sampling {
    /// Total rotation (deg) of the sampled fragment movements.
    pub fragment_rotation_total: MeanSd,
    /// Total translation (mm) of the sampled fragment movements.
    pub fragment_translation_total: MeanSd,
}

/// An offset of a pose: rotation in degrees, translation in mm.
#[derive(Debug, Deserialize)]
pub struct Offset {
    pub rotation: MeanSd,
    pub translation: MeanSd,
}

/// The embedded figures.
pub static PAPER: LazyLock<Reference> = LazyLock::new(|| {
    toml::from_str(include_str!("../../studies/paper/reference.toml"))
        .expect("the embedded reference file is checked by a test")
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scenario_has_all_its_figures() {
        assert_eq!(PAPER.table2.len(), 5);
        for scenario in PAPER.scenarios.keys() {
            assert_eq!(PAPER.table1[scenario].len(), 9);
            assert!(
                PAPER
                    .pelvis_offset_after_registration
                    .contains_key(scenario)
            );
            assert_eq!(PAPER.success_rates.len(), 3);
            assert!(
                PAPER
                    .success_rates
                    .values()
                    .all(|by| by.contains_key(scenario))
            );
        }
        assert_eq!(PAPER.table1["no_cuts_known"]["rot_total"], [2.19, 2.58]);
    }
}

//! The methods that `[registration.NAME]` sections configure.

use crate::registration::paper::{PaperParameters, PaperSliceParameters};
use serde::Serialize;

/// Parameters of one strategy. Its section may name the `method`; without it the section's name is
/// the method's, so `[registration.paper]` needs none, and
/// `[registration.sum] method = "paper", views = "sum"` compares a variant on the same cases.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "method", rename_all = "snake_case")]
pub enum StrategyParameters {
    /// The paper's method.
    Paper(PaperParameters),
    /// The paper's search with DRRs by slice resampling.
    PaperSlice(PaperSliceParameters),
}

impl StrategyParameters {
    /// Names of all methods.
    pub const METHODS: [&'static str; 2] = ["paper", "paper_slice"];

    /// Values out of range, as (field, what is wrong and what is expected).
    pub fn problems(&self) -> Vec<(String, String)> {
        match self {
            Self::Paper(parameters) => parameters.problems(),
            Self::PaperSlice(parameters) => parameters.problems(),
        }
    }
}

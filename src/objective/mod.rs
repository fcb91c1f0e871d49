//! The cost of candidate poses: similarity, regularization and the scorer.

pub mod comparison;
pub mod cpu_scorer;
#[cfg(test)]
mod cpu_scorer_tests;
#[cfg(test)]
mod direct;
pub mod drr;
mod lanes;
mod patch_cost;
mod patch_sums;
pub mod regularization;
mod run_sums;
pub mod scorer;
pub mod similarity;
mod view_cost;

pub use comparison::Comparison;
pub use cpu_scorer::{CpuScorer, ScorerParameters, ScorerView, Views};
pub use drr::drr;
pub use regularization::Regularization;
pub use scorer::Scorer;
pub use similarity::{FixedView, FixedViewError, SimilarityParameters};

//! The cost of candidate poses: similarity, regularization and the scorer.

pub mod regularization;
pub mod scorer;

pub use regularization::Regularization;
pub use scorer::Scorer;

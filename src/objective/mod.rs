//! The cost of candidate poses: similarity, regularization and the scorer.

pub mod scorer;

pub use scorer::Scorer;

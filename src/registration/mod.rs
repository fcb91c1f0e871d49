//! The registration strategies. They see an observation, never the truth.

pub mod observation;
pub mod outcome;

pub use observation::{Observation, ObservedView, Shape};
pub use outcome::{Outcome, StageRecord};

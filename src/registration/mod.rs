//! The registration strategies. They see an observation, never the truth.

pub mod models;
pub mod observation;
pub mod outcome;

pub mod paper;
pub mod pose_space;
pub mod stage;
pub mod strategy;

pub use models::ModelRecipe;
pub use observation::{BoneModels, Observation, ObservedView, Shape};
pub use outcome::{Outcome, ShapeOutcome, StageRecord};

pub use paper::{Paper, PaperParameters, PaperSlice, PaperSliceParameters};
pub use strategy::{RegistrationError, Strategy};

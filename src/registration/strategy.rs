//! The seam between the study and the methods.

use super::models::ModelError;
use super::{Observation, Outcome};
use crate::anatomy::frame::FrameError;
use crate::objective::FixedViewError;
use crate::optimize::BoxError;
use crate::xray::pyramid::PyramidError;

/// A registration method. It sees an observation and nothing else, and its result is a pure
/// function of it.
pub trait Strategy: Sync + std::fmt::Debug {
    /// The name in keys and tables: `paper`, ...
    fn name(&self) -> &'static str;

    /// Registers one observation on the calling thread.
    ///
    /// # Errors
    /// When the observation cannot be registered; the study records it as a failed row.
    fn register(&self, observation: &Observation) -> Result<Outcome, RegistrationError>;
}

/// A registration that came to no result, with the phase it failed in.
#[derive(Debug, thiserror::Error)]
#[error("{phase}: {cause}")]
pub struct RegistrationError {
    /// The stage or phase: `initialization`, `view2_search`, ...
    pub phase: &'static str,
    #[source]
    pub cause: RegistrationCause,
}

/// Why a registration came to no result.
#[derive(Debug, thiserror::Error)]
pub enum RegistrationCause {
    #[error(transparent)]
    Frame(#[from] FrameError),
    #[error(transparent)]
    Optimizer(#[from] BoxError),
    #[error("no candidate has a finite cost, so there is nothing to choose from")]
    NoFiniteCost,
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Reduction(#[from] PyramidError),
    #[error(transparent)]
    FixedView(#[from] FixedViewError),
}

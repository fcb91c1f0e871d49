//! The seam between the engine and the work.

use super::{CaseKey, RegistrationKey};
use crate::store::Row;

/// Simulates cases and registers them. Both are pure functions of configuration and key.
pub trait Worker: Sync {
    /// A simulated case: the images and the truth, shared by its registrations.
    type Case: Send + Sync;

    /// Simulates one case.
    ///
    /// # Errors
    /// When it cannot be simulated; each of its registrations then fails for this reason.
    fn simulate(&self, key: &CaseKey) -> Result<Self::Case, Failure>;

    /// Makes one registration and compares it with the truth. Sets columns of `row`, which has its key
    /// already; what is set before a failure stays in the row.
    ///
    /// # Errors
    /// When the registration comes to no result.
    fn register(
        &self,
        case: &Self::Case,
        key: &RegistrationKey,
        row: &mut Row,
    ) -> Result<(), Failure>;
}

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Where: `simulation`, `view2_search`, `panic`, ...
    pub phase: String,
    /// What was wrong and what to do.
    pub message: String,
}

impl Failure {
    /// A failure of a phase.
    pub fn new(phase: &str, cause: impl std::fmt::Display) -> Self {
        Self {
            phase: phase.to_owned(),
            message: cause.to_string(),
        }
    }
}

//! Configuration, plan, runner and resume of a study.

pub mod case_worker;
pub mod config;
mod config_difference;
mod config_errors;
mod config_file;
mod config_table;
#[cfg(test)]
mod engine_tests;
pub mod fingerprint;
pub mod folder;
pub mod key;
mod key_row;
pub mod plan;
pub mod preparation;
pub mod provenance;
mod queue;
mod record;
pub mod runner;
pub mod scenario;
pub mod session;
mod shared;
pub mod snapshot;
pub mod state;
pub mod status;
pub mod strategies;
pub mod worker;

pub use case_worker::{CaseWorker, SimulatedCase};
pub use config::{Config, SpecimenSource};
pub use config_difference::Difference;
pub use config_errors::{ConfigError, Mistake};
pub use config_file::Environment;
pub use folder::{StudyError, StudyFolder};
pub use key::{CaseKey, FragmentKey, KeyError, RegistrationKey};
pub use plan::Plan;
pub use provenance::Provenance;
pub use runner::{Ending, Event, RunOptions};
pub use scenario::Scenario;
pub use session::{OpenOptions, Outcome, Redo, Study};
pub use snapshot::Snapshot;
pub use state::State;
pub use status::Status;
pub use strategies::StrategyParameters;
pub use worker::{Failure, Worker};

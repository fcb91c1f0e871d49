//! A study as its folder has it, without a claim on it.

use super::folder::{StudyError, StudyFolder};
use super::{Config, Plan, Provenance, State};
use crate::simd::SimdLevel;
use crate::store::{Attempt, Row, write_parquet};

/// Configuration, plan and rows of a study at one moment, while others may work on it.
#[derive(Debug)]
pub struct Snapshot {
    pub folder: StudyFolder,
    pub config: Config,
    pub plan: Plan,
    pub state: State,
}

impl Snapshot {
    /// Reads a study's folder.
    ///
    /// # Errors
    /// When its configuration or journals cannot be read.
    pub fn read(folder: StudyFolder) -> Result<Self, StudyError> {
        let config = Config::read(&folder.config_file())?;
        let state = State::of(folder.store().read()?)?;
        Ok(Self {
            plan: Plan::of(&config),
            state,
            folder,
            config,
        })
    }

    /// Writes `registrations.parquet` from every row of the plan that is there, in the plan's order.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write_table(&self) -> Result<(), StudyError> {
        let _lock = self.folder.lock()?;
        write_table(&self.folder, &self.plan, &self.state)
    }

    /// Fixes the process' level of vector instructions to that of the study, so that what is
    /// computed again has the same bits.
    ///
    /// # Errors
    /// When the processor lacks it.
    pub fn select_simd(&self) -> Result<(), StudyError> {
        select_simd(&self.state.attempts)
    }
}

/// Writes the table of a plan's rows.
pub(super) fn write_table(
    folder: &StudyFolder,
    plan: &Plan,
    state: &State,
) -> Result<(), StudyError> {
    let rows: Vec<&Row> = state.planned_rows(plan).collect();
    Ok(write_parquet(&folder.table(), &rows)?)
}

/// The provenance of each attempt that has one of today's form, oldest first.
pub(super) fn provenances(attempts: &[Attempt]) -> Vec<Provenance> {
    let found = attempts.iter();
    found
        .filter_map(|attempt| serde_json::from_value(attempt.provenance.clone()).ok())
        .collect()
}

/// Fixes the process' level of vector instructions to that of the first attempt.
///
/// # Errors
/// When the processor lacks it, or another level is in use already.
pub fn select_simd(attempts: &[Attempt]) -> Result<(), StudyError> {
    match provenances(attempts).first() {
        Some(first) => Ok(SimdLevel::select(first.simd)?),
        None => Ok(()),
    }
}

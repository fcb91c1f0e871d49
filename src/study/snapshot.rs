//! A study as its folder has it, without a claim on it.

use super::folder::{StudyError, StudyFolder};
use super::{Config, Plan, Provenance, State};
use crate::simd::SimdLevel;
use crate::store::{Journal, Row, journal, write_parquet};

/// Configuration, plan and rows of a study at one moment, while others may work on it.
#[derive(Debug)]
pub struct Snapshot {
    pub folder: StudyFolder,
    pub config: Config,
    pub plan: Plan,
    pub state: State,
    pub journals: Vec<Journal>,
}

impl Snapshot {
    /// Reads a study's folder.
    ///
    /// # Errors
    /// When its configuration or journals cannot be read.
    pub fn read(folder: StudyFolder) -> Result<Self, StudyError> {
        let config = Config::read(&folder.config_file())?;
        let journals = journal::read_all(&folder.journals())?;
        Ok(Self {
            plan: Plan::of(&config),
            state: State::of(&journals),
            folder,
            config,
            journals,
        })
    }

    /// Writes `registrations.parquet` from every row of the plan that is there, in the plan's order.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write_table(&self) -> Result<(), StudyError> {
        write_table(&self.folder, &self.plan, &self.state)
    }

    /// Fixes the process' level of vector instructions to that of the study, so that what is
    /// computed again has the same bits.
    ///
    /// # Errors
    /// When the processor lacks it.
    pub fn select_simd(&self) -> Result<(), StudyError> {
        select_simd(&self.journals)
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

/// The provenance of each attempt that has one, oldest first.
pub(super) fn provenances(journals: &[Journal]) -> Vec<Provenance> {
    let headers = journals
        .iter()
        .filter_map(|journal| journal.header.as_ref());
    headers
        .filter_map(|header| serde_json::from_value(header.provenance.clone()).ok())
        .collect()
}

/// Fixes the level of vector instructions to that of the first attempt.
pub(super) fn select_simd(journals: &[Journal]) -> Result<(), StudyError> {
    match provenances(journals).first() {
        Some(first) => Ok(SimdLevel::select(first.simd)?),
        None => Ok(()),
    }
}

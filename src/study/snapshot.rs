//! A study as its folder has it, without a claim on it.

use super::fingerprint::fingerprints;
use super::folder::{StudyError, StudyFolder};
use super::opening::changes;
use super::{Config, Plan, Provenance, State};
use crate::anatomy::Source;
use crate::simd::SimdLevel;
use crate::store::{Attempt, Row, write_parquet};
use std::collections::BTreeSet;

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
        let config = Config::read_as_named(&folder.config_file())?;
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

    /// With what the rows were made, each different value once: what, and its values, sorted.
    pub fn provenance_summary(&self) -> Vec<(String, Vec<String>)> {
        let with_rows = self.state.attempts.iter().filter(|a| a.rows > 0 || a.alive);
        let all = provenances(&with_rows.cloned().collect::<Vec<_>>());
        let mut summary: Vec<(String, BTreeSet<String>)> = Vec::new();
        let mut add = |what: &str, of: &dyn Fn(&Provenance) -> Vec<String>| {
            let values = all.iter().flat_map(of).collect();
            summary.push((what.to_owned(), values));
        };
        add("version of the program", &|p| vec![p.version.clone()]);
        add("commit", &|p| vec![p.commit.clone()]);
        add("hash of the sources", &|p| vec![p.code.clone()]);
        add("hash of the configuration", &|p| vec![p.config.clone()]);
        add("fingerprints of specimens", &|p| {
            let pairs = p.specimens.iter();
            pairs.map(|(name, hash)| format!("{name} {hash}")).collect()
        });
        add("vector instructions", &|p| vec![p.simd.name().into()]);
        add("backend", &|p| vec![p.backend.clone()]);
        add("GPU and driver", &|p| p.gpu.iter().cloned().collect());
        add("platform", &|p| vec![p.platform.clone()]);
        add("processor", &|p| vec![p.cpu.clone()]);
        let filled = summary.into_iter().filter(|(_, values)| !values.is_empty());
        filled
            .map(|(what, values)| (what, values.into_iter().collect()))
            .collect()
    }

    /// Where each specimen of the plan comes from, as the last attempt found it.
    pub fn specimens(&self) -> Vec<(String, Source)> {
        let all = provenances(&self.state.attempts);
        let last = |name: &String| all.iter().rev().find_map(|p| p.sources.get(name).cloned());
        let names = self.config.population.sources();
        let names = names.iter().map(|source| source.name());
        names
            .filter_map(|name| last(&name).map(|source| (name, source)))
            .collect()
    }

    /// What has changed since the study's last attempt, a line each: data of specimens, the program.
    ///
    /// # Errors
    /// When a specimen's file cannot be read.
    pub fn changes(&self) -> Result<Vec<String>, StudyError> {
        let specimens = fingerprints(&self.config.population)?;
        let earlier = provenances(&self.state.attempts);
        let changes = changes(&self.folder, &self.config, &specimens, &earlier)?;
        Ok(changes.into_iter().map(|(_, line)| line).collect())
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

//! What a study costs, measured before it runs.

use super::folder::{StudyError, StudyFolder, io};
use super::runner::peak_memory_bytes;
use super::{Config, Plan, Provenance, RegistrationKey, Worker};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// Seconds of one thread, measured on one case of the study, and memory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Hash of the configuration's keys that results depend on.
    pub config: String,
    /// Hash of the program.
    pub code: String,
    /// Model of the processor.
    pub cpu: String,
    /// Specimen, hip and fragment, before the first case of a hip is simulated.
    pub preparation_seconds: f64,
    /// The simulation of a case.
    pub simulation_seconds: f64,
    /// A registration, by `scenario/strategy`.
    pub registration_seconds: BTreeMap<String, f64>,
    /// The most memory held, by a process with one thread.
    pub peak_memory_bytes: Option<u64>,
}

impl Calibration {
    /// Measures: simulates the study's first case twice, and makes one registration of it for each scenario
    /// and strategy. No row is kept. Run it in a pool of one thread.
    ///
    /// # Errors
    /// The reason, when the case cannot be simulated; a registration that fails counts with its time.
    pub fn measure<W: Worker>(
        config: &Config,
        plan: &Plan,
        worker: &W,
    ) -> Result<Self, super::Failure> {
        let case_key = &plan.cases[0];
        let seconds = |begin: Instant| begin.elapsed().as_secs_f64();
        let begin = Instant::now();
        drop(worker.simulate(case_key)?);
        let first = seconds(begin);
        let begin = Instant::now();
        let case = worker.simulate(case_key)?;
        let simulation_seconds = seconds(begin);
        let mut registration_seconds = BTreeMap::new();
        for key in plan.registrations(case_key) {
            if key.initialization == 0 {
                let begin = Instant::now();
                let _ = worker.register(&case, &key, &mut key.row());
                registration_seconds.insert(cell(&key), seconds(begin));
            }
        }
        let now = Provenance::now(config, BTreeMap::new(), 1);
        Ok(Self {
            config: now.config,
            code: now.code,
            cpu: now.cpu,
            preparation_seconds: (first - simulation_seconds).max(0.0),
            simulation_seconds,
            registration_seconds,
            peak_memory_bytes: peak_memory_bytes(),
        })
    }

    /// Where it is kept for a study.
    pub fn file(folder: &StudyFolder) -> PathBuf {
        folder.path().join("calibration.json")
    }

    /// Keeps it in the study's folder, which is made if it is not there.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, folder: &StudyFolder) -> Result<(), StudyError> {
        std::fs::create_dir_all(folder.path()).map_err(io("create", folder.path()))?;
        let text = serde_json::to_string_pretty(self).expect("it is plain data") + "\n";
        folder.write(&Self::file(folder), &text)
    }

    /// The one that was kept, if it is of this configuration and this program.
    pub fn read(folder: &StudyFolder, config: &Config) -> Option<Self> {
        let text = std::fs::read_to_string(Self::file(folder)).ok()?;
        let found: Self = serde_json::from_str(&text).ok()?;
        (found.config == config.hash() && found.code == Provenance::code_now()).then_some(found)
    }
}

/// `scenario/strategy`.
pub fn cell(key: &RegistrationKey) -> String {
    format!("{}/{}", key.scenario, key.strategy)
}

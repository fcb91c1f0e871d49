//! A study with its folder: opening, running, resuming.

use super::fingerprint::fingerprints;
use super::folder::{StudyError, StudyFolder, io};
use super::runner::{Ending, Event, RunOptions, run};
use super::snapshot::{provenances, select_simd, write_table};
use super::{Config, Plan, Provenance, State, Worker};
use crate::store::journal::{self, Writer};
use crate::store::{COMPLETE, Journal, Record, Row, SET_ASIDE};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use std::sync::Mutex;

/// A study that is open for work: no other process has it.
#[derive(Debug)]
pub struct Study {
    pub folder: StudyFolder,
    pub config: Config,
    pub plan: Plan,
    /// What was done before this process.
    pub state: State,
    /// Fingerprints of the specimens' files.
    specimens: BTreeMap<String, String>,
    _lock: File,
}

/// What a user accepts or asks for when a study is opened again.
#[derive(Clone, Debug, Default)]
pub struct OpenOptions {
    /// Configuration keys, `specimen.NAME` or `code`, that may differ from what the study was begun
    /// with.
    pub accept: Vec<String>,
}

/// Which rows are made again although they are there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Redo {
    Nothing,
    /// Those that failed or were set aside.
    Failed,
}

/// The numbers at the end of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    pub ending: Ending,
    /// Registrations of the plan.
    pub planned: usize,
    /// Of them, with a row.
    pub done: usize,
    /// Of those, failed or set aside.
    pub failed: usize,
}

impl Study {
    /// Opens the study of a configuration under `results`, or begins it. Fixes the process' level of
    /// vector instructions to that of the study.
    ///
    /// # Errors
    /// When the folder cannot be used, another process has it, a specimen's file cannot be read, or
    /// the study was begun with another configuration, other data or another program and that was
    /// not accepted.
    pub fn open(config: Config, results: &Path, options: &OpenOptions) -> Result<Self, StudyError> {
        let folder = StudyFolder::of(results, &config.study.name);
        let lock = folder.lock()?;
        let (journals, specimens) = examine(&folder, &config, options)?;
        let file = folder.config_file();
        folder.write(&file, &config.to_toml())?;
        let plan = Plan::of(&config);
        let state = State::of(&journals);
        for (path, bytes) in &state.torn {
            tracing::warn!(
                "{}: {bytes} bytes at its end could not be read; what they held is done again",
                path.display()
            );
        }
        Ok(Self {
            folder,
            config,
            plan,
            state,
            specimens,
            _lock: lock,
        })
    }

    /// How many registrations a configuration plans, and how many of them would count as done if the
    /// study were opened now. Makes, changes and claims nothing.
    ///
    /// # Errors
    /// As [`Self::open`], but for the claim.
    pub fn preview(
        config: &Config,
        results: &Path,
        options: &OpenOptions,
        redo: Redo,
    ) -> Result<(usize, usize), StudyError> {
        let folder = StudyFolder::of(results, &config.study.name);
        let (journals, _) = examine(&folder, config, options)?;
        let plan = Plan::of(config);
        let (done, _) = counted(&plan, &State::of(&journals), redo);
        Ok((plan.len(), done))
    }

    /// Does what is left, and writes the table and the manifest. Running again continues.
    ///
    /// # Errors
    /// When the journal or the table cannot be written; committed rows stay.
    pub fn run<W: Worker>(
        &mut self,
        worker: &W,
        redo: Redo,
        options: &RunOptions,
        events: &(dyn Fn(Event) + Sync),
    ) -> Result<Outcome, StudyError> {
        let again = |row: &Row| redo == Redo::Failed && row.text("status") != COMPLETE;
        let left = self.state.left(&self.plan, again);
        let specimens = self.specimens.clone();
        let provenance = Provenance::now(&self.config, specimens, options.threads);
        let provenance = serde_json::to_value(provenance).expect("provenance is plain data");
        let mut writer = Writer::create(&self.folder.journals(), provenance)?;
        self.write_manifest()?;

        let committed = Mutex::new(Vec::new());
        let keep = |event: Event| {
            if let Event::Row(row) = event {
                let mut rows = committed.lock().expect("no thread panics while it pushes");
                rows.push(row.clone());
            }
            events(event);
        };
        for mut row in left.set_aside_rows() {
            let known = |key| {
                self.state
                    .row(&key)
                    .is_some_and(|row| row.text("status") == SET_ASIDE)
            };
            if super::RegistrationKey::of_row(&row).is_some_and(known) {
                continue;
            }
            row.set("attempt", writer.attempt());
            writer.append(&Record::Row(Box::new(row.clone())))?;
            keep(Event::Row(&row));
        }
        let alone = RunOptions {
            threads: 1,
            cases_in_flight: 1,
            ..*options
        };
        let mut ending = run(worker, left.suspects, &mut writer, &alone, &keep)?;
        if ending == Ending::Done {
            ending = run(worker, left.others, &mut writer, options, &keep)?;
        }
        writer.append(&Record::Ended)?;
        writer.sync()?;
        drop(writer);
        for row in committed.into_inner().expect("no thread panicked") {
            self.state.insert(row);
        }
        write_table(&self.folder, &self.plan, &self.state)?;
        self.write_manifest()?;
        Ok(self.outcome(ending))
    }

    /// How many registrations of the plan count as done, and how many of those failed.
    pub fn counted(&self, redo: Redo) -> (usize, usize) {
        counted(&self.plan, &self.state, redo)
    }

    fn outcome(&self, ending: Ending) -> Outcome {
        let (done, failed) = self.counted(Redo::Nothing);
        Outcome {
            ending,
            planned: self.plan.len(),
            done,
            failed,
        }
    }

    /// `manifest.json`: the provenance of every attempt, from their journals.
    fn write_manifest(&self) -> Result<(), StudyError> {
        let journals = journal::read_all(&self.folder.journals())?;
        let attempts: Vec<Value> = journals
            .iter()
            .filter_map(|journal| {
                let header = journal.header.as_ref()?;
                let is_row = |record: &&Record| matches!(record, Record::Row(_));
                Some(json!({
                    "attempt": header.attempt,
                    "provenance": header.provenance,
                    "rows": journal.records.iter().filter(is_row).count(),
                    "ended_in_order": journal.ended(),
                    "unreadable_bytes": journal.torn_bytes,
                }))
            })
            .collect();
        let manifest = json!({
            "format": 1,
            "study": self.config.study.name,
            "attempts": attempts,
        });
        let text = serde_json::to_string_pretty(&manifest).expect("JSON is text") + "\n";
        self.folder.write(&self.folder.manifest(), &text)
    }
}

fn counted(plan: &Plan, state: &State, redo: Redo) -> (usize, usize) {
    let rows = || state.planned_rows(plan);
    let failed = rows().filter(|row| row.text("status") != COMPLETE).count();
    match redo {
        Redo::Nothing => (rows().count(), failed),
        Redo::Failed => (rows().count() - failed, 0),
    }
}

/// The journals of a study that may go on with this configuration, and the fingerprints of its
/// specimens. Fixes the process' level of vector instructions to that of the study.
fn examine(
    folder: &StudyFolder,
    config: &Config,
    options: &OpenOptions,
) -> Result<(Vec<Journal>, BTreeMap<String, String>), StudyError> {
    let journals = journal::read_all(&folder.journals())?;
    select_simd(&journals)?;
    let specimens = fingerprints(&config.population)?;
    check_unchanged(folder, config, &specimens, &provenances(&journals), options)?;
    Ok((journals, specimens))
}

fn check_unchanged(
    folder: &StudyFolder,
    config: &Config,
    specimens: &BTreeMap<String, String>,
    earlier: &[Provenance],
    options: &OpenOptions,
) -> Result<(), StudyError> {
    let (mut differences, mut keys) = (Vec::new(), Vec::new());
    let file = folder.config_file();
    if !earlier.is_empty() && file.is_file() {
        let text = std::fs::read_to_string(&file).map_err(io("read", &file))?;
        let before = Config::parse(&text, &file, &|_| None)?;
        for difference in before.differences(config) {
            differences.push(difference.to_string());
            keys.push(difference.key);
        }
    }
    for (name, now) in specimens {
        let last = earlier.iter().rev().find_map(|p| p.specimens.get(name));
        if let Some(before) = last
            && before != now
        {
            let short = |hash: &str| hash.chars().take(12).collect::<String>();
            let key = format!("specimen.{name}");
            differences.push(format!(
                "  {key}: was data of fingerprint {}, is {}: its files were changed",
                short(before),
                short(now)
            ));
            keys.push(key);
        }
    }
    let code = env!("PAO_SIM_CODE_HASH");
    if let Some(last) = earlier.last()
        && last.code != code
    {
        differences.push(format!(
            "  code: was {} of version {} (commit {}), is {code} of version {} (commit {})",
            last.code,
            last.version,
            last.commit,
            env!("CARGO_PKG_VERSION"),
            env!("PAO_SIM_COMMIT")
        ));
        keys.push("code".into());
    }
    if keys.iter().all(|key| options.accept.contains(key)) {
        return Ok(());
    }
    Err(StudyError::Mixed {
        path: folder.path().to_owned(),
        differences,
        keys,
    })
}

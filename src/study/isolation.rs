//! Who ended the process?
//!
//! When an attempt dies without a word, whatever it had in work is suspected: a crash looks like a kill
//! from outside. Suspects run in a process of their own, whose death this one survives and sees. It runs
//! all of them first; when it dies with several in work, each of these runs alone.

use super::queue::CaseWork;
use super::state::crashed_row;
use super::{CaseKey, RegistrationKey, Stop};
use crate::store::{JournalError, Record, Row};
use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

/// How a process of its own ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It did what it was given.
    Ended,
    /// It was told to stop, and dropped what it had in work.
    Dropped,
    /// It was killed: by itself, or by the system for its sake. The text says how.
    Died(String),
}

/// Runs registrations in a process of their own.
pub trait Isolation: Sync {
    /// Runs them on so many threads and hands on each record of the process as it comes.
    ///
    /// # Errors
    /// When the process cannot be started, or fails for another reason than its work.
    fn run(
        &self,
        keys: &[RegistrationKey],
        threads: usize,
        stop: &Stop,
        record: &mut dyn FnMut(Record),
    ) -> Result<Fate, String>;
}

/// What came of the suspects.
#[derive(Debug, Default)]
pub(super) struct Verdict {
    /// Cases whose simulation ends its process, and how.
    pub crashed_cases: Vec<(CaseKey, String)>,
    /// True when it was stopped before all were tried.
    pub stopped: bool,
}

/// Why suspects could not be tried.
#[derive(Debug)]
pub(super) enum Broken {
    Journal(JournalError),
    Process(String),
}

/// Tries the suspects and commits their records.
pub(super) fn try_suspects(
    isolation: &dyn Isolation,
    suspects: Vec<CaseWork>,
    threads: usize,
    stop: &Stop,
    commit: &mut dyn FnMut(Record) -> Result<(), JournalError>,
) -> Result<Verdict, Broken> {
    let all: Vec<RegistrationKey> = suspects.into_iter().flat_map(|w| w.registrations).collect();
    let mut groups = VecDeque::from([(all, threads)]);
    let mut verdict = Verdict::default();
    while let Some((mut keys, threads)) = groups.pop_front() {
        keys.retain(|key| {
            !verdict
                .crashed_cases
                .iter()
                .any(|(case, _)| *case == key.case)
        });
        if keys.is_empty() {
            continue;
        }
        if stop.forbids(Duration::ZERO) {
            verdict.stopped = true;
            break;
        }
        let mut trial = Trial::default();
        let mut result = Ok(());
        let fate = isolation.run(&keys, threads, stop, &mut |record| {
            trial.see(&record);
            if result.is_ok() {
                result = commit(record);
            }
        });
        result.map_err(Broken::Journal)?;
        keys.retain(|key| !trial.done.contains(&key.to_string()));
        match fate.map_err(Broken::Process)? {
            Fate::Dropped => {
                verdict.stopped = true;
                break;
            }
            Fate::Ended if keys.is_empty() => {}
            Fate::Ended => {
                let key = &keys[0];
                let problem = format!("the process that was to try {key} ended without its row");
                return Err(Broken::Process(problem));
            }
            Fate::Died(how) => {
                let of_case = |key: &RegistrationKey| trial.in_work.contains(&key.case.to_string());
                let own = |key: &RegistrationKey| trial.in_work.contains(&key.to_string());
                let (blamed, rest): (Vec<_>, Vec<_>) =
                    keys.into_iter().partition(|key| of_case(key) || own(key));
                if blamed.is_empty() && trial.done.is_empty() {
                    return Err(Broken::Process(format!(
                        "the process that was to try registrations of a dead attempt died ({how}) before it began"
                    )));
                }
                groups.push_back((rest, threads));
                if let [culprit] = &trial.in_work.iter().collect::<Vec<_>>()[..] {
                    let key = (*culprit).clone();
                    let how_text = how.clone();
                    commit(Record::Crashed { key, how: how_text }).map_err(Broken::Journal)?;
                    let simulation = blamed.iter().any(of_case);
                    for key in &blamed {
                        let row = crashed_row(key, simulation, &how);
                        commit(Record::Row(Box::new(row))).map_err(Broken::Journal)?;
                    }
                    if simulation && let Some(key) = blamed.first() {
                        verdict.crashed_cases.push((key.case.clone(), how));
                    }
                } else {
                    for group in alone(blamed, &trial.in_work) {
                        groups.push_front((group, 1));
                    }
                }
            }
        }
    }
    Ok(verdict)
}

/// One group a key in work: a registration, or all those of a case that was being simulated.
fn alone(blamed: Vec<RegistrationKey>, in_work: &BTreeSet<String>) -> Vec<Vec<RegistrationKey>> {
    let group = |name: &String| {
        let belongs =
            |key: &&RegistrationKey| key.to_string() == *name || key.case.to_string() == *name;
        blamed.iter().filter(belongs).cloned().collect()
    };
    in_work.iter().map(group).collect()
}

/// What a process tells while it runs.
#[derive(Debug, Default)]
struct Trial {
    in_work: BTreeSet<String>,
    /// Registrations with a row.
    done: BTreeSet<String>,
}

impl Trial {
    fn see(&mut self, record: &Record) {
        match record {
            Record::Started(key) => {
                self.in_work.insert(key.clone());
            }
            Record::Finished(key) => {
                self.in_work.remove(key);
            }
            Record::Row(row) => {
                if let Some(key) = key_of(row) {
                    self.in_work.remove(&key);
                    self.done.insert(key);
                }
            }
            Record::Crashed { .. } | Record::Ended(_) => {}
        }
    }
}

/// The name of a row's registration.
pub(super) fn key_of(row: &Row) -> Option<String> {
    RegistrationKey::of_row(row).map(|key| key.to_string())
}

//! What the records of a study say was done.

use super::{CaseKey, Plan, RegistrationKey, Shard, queue::CaseWork};
use crate::store::{Attempt, COMPLETE, CRASHED, Ledger, Row};
use std::collections::{BTreeMap, HashMap};
use std::path::PathBuf;

/// The rows that were committed, and what is known of deaths.
#[derive(Debug, Default)]
pub struct State {
    rows: HashMap<RegistrationKey, Row>,
    /// Keys (of a case's simulation, or of a registration) that were in work when an attempt ended
    /// without a word, and the last such attempt.
    suspects: HashMap<String, u32>,
    /// Keys that ended a process of their own, and how it died.
    crashed: BTreeMap<String, String>,
    /// Rows that were there twice, with equal results.
    pub repeated: usize,
    /// Every attempt, by number.
    pub attempts: Vec<Attempt>,
    /// Journals with bytes that could not be read, and how many.
    pub torn: Vec<(PathBuf, u64)>,
}

/// Two rows of one registration that ought to be equal and are not.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "attempts {} and {} have different results for {key} ({}): one of them was made by another program, on another machine or from other data; `pao-sim replay STUDY {key}` tells what this program makes of it; then move the part or journal of the wrong attempt out of the study's folder and run again",
    attempts[0], attempts[1], columns.join(", ")
)]
pub struct Conflict {
    pub key: String,
    pub attempts: [i64; 2],
    /// Columns that differ.
    pub columns: Vec<String>,
}

impl State {
    /// The state that the records tell. Of several rows of a registration a complete one counts, and the
    /// last one when all failed; rows without a key are made again.
    ///
    /// # Errors
    /// When two rows of one registration contradict each other.
    pub fn of(ledger: Ledger) -> Result<Self, Conflict> {
        let mut state = Self {
            torn: ledger.torn,
            ..Self::default()
        };
        let mut last_row: HashMap<String, u32> = HashMap::new();
        let deaths = ledger.attempts.iter().filter(|attempt| attempt.died());
        for attempt in deaths {
            for key in &attempt.in_work {
                let last = state.suspects.entry(key.clone()).or_default();
                *last = (*last).max(attempt.attempt);
            }
        }
        let crashes = ledger.attempts.iter().flat_map(|a| &a.crashed);
        state.crashed.extend(crashes.cloned());
        for row in ledger.rows {
            if !state.suspects.is_empty()
                && row.text("status") != CRASHED
                && let Some(key) = RegistrationKey::of_row(&row)
                && let Some(number) = row.integer("attempt").and_then(|n| u32::try_from(n).ok())
            {
                for key in [key.to_string(), key.case.to_string()] {
                    let last = last_row.entry(key).or_default();
                    *last = (*last).max(number);
                }
            }
            state.add(row)?;
        }
        // A later attempt came through with it.
        let survived = |key: &String, died: u32| last_row.get(key).is_some_and(|&row| row > died);
        state.suspects.retain(|key, died| !survived(key, *died));
        state.attempts = ledger.attempts;
        Ok(state)
    }

    fn add(&mut self, row: Row) -> Result<(), Conflict> {
        let Some(key) = RegistrationKey::of_row(&row) else {
            return Ok(());
        };
        let Some(before) = self.rows.get(&key) else {
            self.rows.insert(key, row);
            return Ok(());
        };
        let differences = before.differences(&row);
        if before.text("status") != COMPLETE {
            self.rows.insert(key, row);
        } else if !differences.is_empty() {
            return Err(Conflict {
                key: key.to_string(),
                attempts: [before, &row].map(|row| row.integer("attempt").unwrap_or(0)),
                columns: differences.into_iter().map(|d| d.0.to_owned()).collect(),
            });
        }
        self.repeated += usize::from(differences.is_empty());
        Ok(())
    }

    /// Takes in a row that was just committed.
    pub fn insert(&mut self, row: Row) {
        if let Some(key) = RegistrationKey::of_row(&row) {
            self.rows.insert(key, row);
        }
    }

    /// Forgets the rows of other shares: a process needs its own only.
    pub fn keep_only(&mut self, plan: &Plan, shard: Shard) {
        if !shard.is_whole() {
            let own: std::collections::HashSet<&CaseKey> =
                shard.cases(plan).map(|(_, case)| case).collect();
            self.rows.retain(|key, _| own.contains(&key.case));
            self.rows.shrink_to_fit();
        }
    }

    /// The row of a registration, if it was committed.
    pub fn row(&self, key: &RegistrationKey) -> Option<&Row> {
        self.rows.get(key)
    }

    /// True when an attempt ended without a word while this key was in work, and none came through
    /// with it since.
    pub fn is_suspect(&self, key: &str) -> bool {
        self.suspects.contains_key(key)
    }

    /// The rows of a plan that are there, in the plan's order.
    pub fn planned_rows<'a>(&'a self, plan: &'a Plan) -> impl Iterator<Item = &'a Row> {
        self.rows_of(plan, Shard::WHOLE)
    }

    /// The rows of a share that are there, in the plan's order.
    pub fn rows_of<'a>(&'a self, plan: &'a Plan, shard: Shard) -> impl Iterator<Item = &'a Row> {
        let keys = shard
            .cases(plan)
            .flat_map(|(_, case)| plan.registrations(case));
        keys.filter_map(|key| self.rows.get(&key))
    }

    /// The work of a share that is left, in the plan's order. `redo` says which rows do not count as done.
    pub fn left(&self, plan: &Plan, shard: Shard, redo: impl Fn(&Row) -> bool) -> Left {
        let mut left = Left::default();
        for (_, case) in shard.cases(plan) {
            let mut registrations = plan.registrations(case);
            registrations.retain(|key| self.rows.get(key).is_none_or(&redo));
            self.part(case, registrations, &mut left);
        }
        left
    }

    /// Parts a case's registrations by what is known of deaths.
    fn part(&self, case: &CaseKey, registrations: Vec<RegistrationKey>, left: &mut Left) {
        let case_name = case.to_string();
        let case_crashed = self.crashed.get(&case_name);
        let case_suspect = self.is_suspect(&case_name);
        let mut suspects = Vec::new();
        let mut others = Vec::new();
        for key in registrations {
            let name = key.to_string();
            let crashed = case_crashed.or_else(|| self.crashed.get(&name));
            match crashed {
                // The process ended between the proof and the row.
                Some(how) if self.row(&key).is_none() => {
                    left.crashed
                        .push(crashed_row(&key, case_crashed.is_some(), how));
                }
                Some(_) => suspects.push(key),
                None if case_suspect || self.is_suspect(&name) => suspects.push(key),
                None => others.push(key),
            }
        }
        for (list, registrations) in [(&mut left.suspects, suspects), (&mut left.others, others)] {
            if !registrations.is_empty() {
                let case = case.clone();
                list.push(CaseWork {
                    case,
                    registrations,
                });
            }
        }
    }
}

/// The work that is left of a study.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Left {
    /// To be done in a process of their own.
    pub suspects: Vec<CaseWork>,
    /// To be done.
    pub others: Vec<CaseWork>,
    /// Rows of those that are known to end their process.
    pub crashed: Vec<Row>,
}

impl Left {
    /// Registrations that are to be done.
    pub fn registrations(&self) -> usize {
        let work = self.suspects.iter().chain(&self.others);
        work.map(|case| case.registrations.len()).sum()
    }
}

/// The row of a registration that is set aside: it, or its case's simulation, ended a process that did
/// nothing else.
pub(super) fn crashed_row(key: &RegistrationKey, simulation: bool, how: &str) -> Row {
    let mut row = key.row();
    row.set("status", CRASHED);
    let (phase, what) = if simulation {
        ("simulation", "the case's simulation")
    } else {
        ("registration", "the registration")
    };
    row.set("phase", phase);
    let message = format!(
        "{what} ended its process twice, the second time alone ({how}); to see why, run `pao-sim replay STUDY {key}`"
    );
    row.set("message", message);
    row
}

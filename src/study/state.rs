//! What the journals of a study say was done.

use super::{CaseKey, Plan, RegistrationKey, queue::CaseWork};
use crate::store::{Journal, Record, Row, SET_ASIDE};
use std::collections::{BTreeSet, HashMap};
use std::path::PathBuf;

/// How often a key may be in work when its process ends without a word, before it is set aside.
pub const MAX_CRASHES: u32 = 3;

/// From this number of crashes on a key is tried alone, so that it takes no other with it and none
/// is blamed for it.
const SUSPECT_CRASHES: u32 = 2;

/// The rows that were committed, and the work that was not finished.
#[derive(Debug, Default)]
pub struct State {
    /// The last committed row of each registration, its attempt's number before it.
    rows: HashMap<RegistrationKey, Row>,
    /// How many attempts ended without a word while a key (of a case's simulation, or of a
    /// registration) was in work.
    crashes: HashMap<String, u32>,
    /// Journals with bytes that could not be read, and how many.
    pub torn: Vec<(PathBuf, u64)>,
}

impl State {
    /// The state after the journals, oldest first. Rows without a key are counted as torn: they are
    /// done again.
    pub fn of(journals: &[Journal]) -> Self {
        let mut state = Self::default();
        for journal in journals {
            state.add(journal);
        }
        state
    }

    fn add(&mut self, journal: &Journal) {
        let mut in_work = BTreeSet::new();
        for record in &journal.records {
            match record {
                Record::Started(key) => {
                    in_work.insert(key.clone());
                }
                Record::Finished(key) => {
                    in_work.remove(key);
                }
                Record::Row(row) => {
                    if let Some(key) = RegistrationKey::of_row(row) {
                        in_work.remove(&key.to_string());
                        self.rows.insert(key, (**row).clone());
                    }
                }
                Record::Ended => {}
            }
        }
        if !journal.ended() {
            for key in in_work {
                *self.crashes.entry(key).or_default() += 1;
            }
        }
        if journal.torn_bytes > 0 {
            self.torn.push((journal.path.clone(), journal.torn_bytes));
        }
    }

    /// Takes in a row that was just committed.
    pub fn insert(&mut self, row: Row) {
        if let Some(key) = RegistrationKey::of_row(&row) {
            self.rows.insert(key, row);
        }
    }

    /// The row of a registration, if it was committed.
    pub fn row(&self, key: &RegistrationKey) -> Option<&Row> {
        self.rows.get(key)
    }

    /// The rows of a plan that are there, in the plan's order.
    pub fn planned_rows<'a>(&'a self, plan: &'a Plan) -> impl Iterator<Item = &'a Row> {
        let keys = plan.cases.iter().flat_map(|case| plan.registrations(case));
        keys.filter_map(|key| self.rows.get(&key))
    }

    /// The work that is left, in the plan's order. `redo` says which rows do not count as done.
    pub fn left(&self, plan: &Plan, redo: impl Fn(&Row) -> bool) -> Left {
        let mut left = Left::default();
        for case in &plan.cases {
            let mut registrations = plan.registrations(case);
            registrations.retain(|key| self.rows.get(key).is_none_or(&redo));
            if !registrations.is_empty() {
                self.part(case, registrations, &mut left);
            }
        }
        left
    }

    /// Parts a case's registrations by what is known of crashes.
    fn part(&self, case: &CaseKey, registrations: Vec<RegistrationKey>, left: &mut Left) {
        let crashes =
            |key: &dyn std::fmt::Display| self.crashes.get(&key.to_string()).copied().unwrap_or(0);
        let of_case = crashes(case);
        let mut add = |list: fn(&mut Left) -> &mut Vec<CaseWork>, keys: Vec<RegistrationKey>| {
            if !keys.is_empty() {
                let case = case.clone();
                list(left).push(CaseWork {
                    case,
                    registrations: keys,
                });
            }
        };
        if of_case >= MAX_CRASHES {
            add(|left| &mut left.set_aside, registrations);
            return;
        }
        let (set_aside, rest): (Vec<_>, Vec<_>) = registrations
            .into_iter()
            .partition(|key| crashes(key) >= MAX_CRASHES);
        let (mut suspects, mut others): (Vec<_>, Vec<_>) = rest
            .into_iter()
            .partition(|key| crashes(key) >= SUSPECT_CRASHES);
        if of_case >= SUSPECT_CRASHES && suspects.is_empty() && !others.is_empty() {
            // One registration makes the case be simulated alone.
            suspects.push(others.remove(0));
        }
        add(|left| &mut left.set_aside, set_aside);
        add(|left| &mut left.suspects, suspects);
        add(|left| &mut left.others, others);
    }
}

/// The work that is left of a study.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Left {
    /// To be done one after the other, alone.
    pub suspects: Vec<CaseWork>,
    /// To be done.
    pub others: Vec<CaseWork>,
    /// Given up: each ended its process [`MAX_CRASHES`] times.
    pub set_aside: Vec<CaseWork>,
}

impl Left {
    /// Registrations that are to be done.
    pub fn registrations(&self) -> usize {
        let work = self.suspects.iter().chain(&self.others);
        work.map(|case| case.registrations.len()).sum()
    }

    /// The rows of those that are given up.
    pub fn set_aside_rows(&self) -> Vec<Row> {
        let keys = self.set_aside.iter().flat_map(|case| &case.registrations);
        keys.map(|key| {
            let mut row = key.row();
            row.set("status", SET_ASIDE);
            row.set("phase", "process");
            let message = format!("the process ended {MAX_CRASHES} times while this was in work; replay it alone to see why (pao-sim replay STUDY {key})");
            row.set("message", message);
            row
        })
        .collect()
    }
}

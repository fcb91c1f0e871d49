//! What is known of one attempt, whether it lives, ended or died.

use super::journal::{End, Header, Journal};
use super::{Record, Row};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// One process' work on a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attempt {
    /// Its number, from 1.
    pub attempt: u32,
    /// Its share of the study: a place from 0 and a number of shares.
    pub share: (u32, u32),
    /// Where, with what and how it ran.
    pub provenance: serde_json::Value,
    /// Rows that it committed.
    pub rows: usize,
    /// Keys whose work it began and did not finish, sorted.
    pub in_work: Vec<String>,
    /// Keys that ended a process of their own, and how it died.
    pub crashed: Vec<(String, String)>,
    /// How it ended; `None` while it lives or when it died.
    pub end: Option<End>,
    /// Bytes at the end of its journal that could not be read.
    pub unreadable_bytes: u64,
    /// When it last wrote, in seconds since 1970 (UTC).
    pub last_sign_unix: u64,
    /// True while its process holds the journal.
    #[serde(skip)]
    pub alive: bool,
}

/// The name of a row's registration; `None` when the row has no whole key.
pub type KeyOf = fn(&Row) -> Option<String>;

impl Attempt {
    /// An attempt of which only the header was read.
    pub(super) fn begun(header: Header, last_sign_unix: u64, alive: bool) -> Self {
        Self {
            attempt: header.attempt,
            share: header.share,
            provenance: header.provenance,
            rows: 0,
            in_work: Vec::new(),
            crashed: Vec::new(),
            end: None,
            unreadable_bytes: 0,
            last_sign_unix,
            alive,
        }
    }

    /// The attempt of a journal, and its rows in the order in which they were committed. `None` when the
    /// attempt died before it had written its header.
    pub(super) fn of(
        journal: Journal,
        key_of: KeyOf,
        last_sign_unix: u64,
        alive: bool,
    ) -> Option<(Self, Vec<Row>)> {
        let end = journal.end().cloned();
        let mut attempt = Self::begun(journal.header?, last_sign_unix, alive);
        let (mut in_work, mut rows) = (BTreeSet::new(), Vec::new());
        for record in journal.records {
            match record {
                Record::Started(key) => {
                    in_work.insert(key);
                }
                Record::Finished(key) => {
                    in_work.remove(&key);
                }
                Record::Crashed { key, how } => {
                    in_work.remove(&key);
                    attempt.crashed.push((key, how));
                }
                Record::Row(row) => {
                    if let Some(key) = key_of(&row) {
                        in_work.remove(&key);
                    }
                    rows.push(*row);
                }
                Record::Ended(_) => {}
            }
        }
        attempt.rows = rows.len();
        attempt.in_work = in_work.into_iter().collect();
        attempt.end = end;
        attempt.unreadable_bytes = journal.torn_bytes;
        Some((attempt, rows))
    }

    /// True when something would be lost with it: rows, what is known of deaths, or a change that its
    /// user accepted.
    pub(super) fn left_a_trace(&self) -> bool {
        let accepted = self.provenance["accepted"].as_array();
        let suspects = self.died() && !self.in_work.is_empty();
        self.rows > 0
            || !self.crashed.is_empty()
            || suspects
            || accepted.is_some_and(|keys| !keys.is_empty())
    }

    /// True when it ended without a word: what it had in work may be the cause.
    pub fn died(&self) -> bool {
        !self.alive && self.end.is_none()
    }
}

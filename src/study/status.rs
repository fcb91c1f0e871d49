//! How far a study is, read from its folder while others may work on it.

use super::{Plan, Provenance, RegistrationKey, Snapshot};
use crate::store::journal;
use crate::store::{COMPLETE, Record, Row};
use serde::Serialize;
use std::time::UNIX_EPOCH;

/// Counts of one cell of the table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Cell {
    pub scenario: String,
    pub strategy: String,
    pub planned: usize,
    /// With a row.
    pub done: usize,
    /// Of those, failed or set aside.
    pub failed: usize,
}

/// A registration without a result.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FailedRow {
    pub key: String,
    pub status: String,
    pub phase: String,
    pub message: String,
}

/// How far a study is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    pub study: String,
    pub planned: usize,
    pub done: usize,
    pub failed: usize,
    /// True while a process works on it.
    pub running: bool,
    /// Number of attempts so far.
    pub attempts: usize,
    pub cells: Vec<Cell>,
    pub failures: Vec<FailedRow>,
    /// Registrations an hour of the last attempt that made any.
    pub rate_per_hour: Option<f64>,
    /// Time that the rest takes at this rate, in seconds.
    pub remaining_seconds: Option<f64>,
    /// Mean seconds of one thread for a registration, and for a case's simulation.
    pub registration_seconds: Option<f64>,
    pub simulation_seconds: Option<f64>,
}

impl Status {
    /// The status of a study.
    pub fn of(study: &Snapshot) -> Self {
        let Snapshot {
            folder,
            config,
            plan,
            state,
            journals,
        } = study;
        let rows: Vec<&Row> = state.planned_rows(plan).collect();
        let rate_per_hour = journals.iter().rev().find_map(rate);
        let left = plan.len() - rows.len();
        Self {
            study: config.study.name.clone(),
            planned: plan.len(),
            done: rows.len(),
            failed: rows.iter().filter(|row| is_failed(row)).count(),
            running: folder.is_locked(),
            attempts: journals.len(),
            cells: cells(plan, &rows),
            failures: rows.iter().filter_map(|row| failure(row)).collect(),
            rate_per_hour,
            remaining_seconds: rate_per_hour.map(|rate| 3600.0 * left as f64 / rate),
            registration_seconds: mean(&rows, "registration_seconds"),
            simulation_seconds: mean(&rows, "simulation_seconds"),
        }
    }
}

fn cells(plan: &Plan, rows: &[&Row]) -> Vec<Cell> {
    let cells = plan.cells();
    cells
        .into_iter()
        .map(|(scenario, strategy, planned)| {
            let own = |row: &&&Row| {
                row.text("scenario") == scenario.name() && row.text("strategy") == strategy
            };
            Cell {
                scenario: scenario.name().into(),
                strategy: strategy.into(),
                planned,
                done: rows.iter().filter(own).count(),
                failed: rows.iter().filter(own).filter(|row| is_failed(row)).count(),
            }
        })
        .collect()
}

fn is_failed(row: &Row) -> bool {
    row.text("status") != COMPLETE
}

fn failure(row: &Row) -> Option<FailedRow> {
    is_failed(row).then(|| FailedRow {
        key: RegistrationKey::of_row(row).map_or_else(String::new, |key| key.to_string()),
        status: row.text("status").into(),
        phase: row.text("phase").into(),
        message: row.text("message").into(),
    })
}

/// Rows an hour between the attempt's start and the last change of its journal.
fn rate(journal: &journal::Journal) -> Option<f64> {
    let provenance = journal.header.as_ref()?.provenance.clone();
    let started = serde_json::from_value::<Provenance>(provenance)
        .ok()?
        .started_unix;
    let changed = journal.path.metadata().ok()?.modified().ok()?;
    let changed = changed.duration_since(UNIX_EPOCH).ok()?.as_secs_f64();
    let rows = journal
        .records
        .iter()
        .filter(|record| matches!(record, Record::Row(_)));
    let (rows, seconds) = (rows.count(), changed - started as f64);
    (rows > 0 && seconds > 0.0).then(|| 3600.0 * rows as f64 / seconds)
}

/// The mean over rows in which the column was measured and took time.
fn mean(rows: &[&Row], column: &str) -> Option<f64> {
    let values: Vec<f64> = rows
        .iter()
        .filter(|row| !is_failed(row))
        .filter_map(|row| row.number(column))
        .collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

//! How far a study is, read from its folder while others may work on it.

use super::{Plan, Provenance, RegistrationKey, Shard, Snapshot};
use crate::store::{Attempt, COMPLETE, Row};
use serde::Serialize;
use std::time::{SystemTime, UNIX_EPOCH};

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

/// How an attempt is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Condition {
    /// Its process holds its journal.
    Running,
    /// It holds it, but has not given a sign of life for [`STALE_SECONDS`].
    Stale,
    /// It ended in order.
    Ended,
    /// It ended without a word.
    Died,
}

/// A living process touches its journal far more often.
pub const STALE_SECONDS: u64 = 300;

/// One attempt, as far as it is of interest while a study goes on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AttemptStatus {
    pub attempt: u32,
    pub shard: String,
    pub condition: Condition,
    pub host: String,
    pub slurm_job: String,
    pub threads: usize,
    pub rows: usize,
    /// Since it last wrote.
    pub silent_seconds: u64,
    /// Keys in work, now or when it died.
    pub in_work: Vec<String>,
}

/// How far a study is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Version of this form.
    pub format: u32,
    pub study: String,
    pub planned: usize,
    pub done: usize,
    pub failed: usize,
    /// True while a process works on it.
    pub running: bool,
    /// Number of attempts so far.
    pub attempts: usize,
    /// Attempts that run, or that died.
    pub notable_attempts: Vec<AttemptStatus>,
    /// Rows that were made twice, with equal results.
    pub repeated: usize,
    pub cells: Vec<Cell>,
    pub failures: Vec<FailedRow>,
    /// Registrations an hour of the attempts that run; of the last that made any when none runs.
    pub rate_per_hour: Option<f64>,
    /// Time that the rest takes at this rate, in seconds.
    pub remaining_seconds: Option<f64>,
    /// Mean seconds of one thread for a registration, and for a case's simulation.
    pub registration_seconds: Option<f64>,
    pub simulation_seconds: Option<f64>,
    /// The most memory that an attempt which ended in order held at once, and its threads.
    pub peak_memory_bytes: Option<(u64, usize)>,
}

impl Status {
    /// The status of a study now.
    pub fn of(study: &Snapshot) -> Self {
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        Self::at(study, now.map_or(0, |elapsed| elapsed.as_secs()))
    }

    /// The status of a study at a time, in seconds since 1970 (UTC).
    pub fn at(study: &Snapshot, now: u64) -> Self {
        let Snapshot {
            config,
            plan,
            state,
            ..
        } = study;
        let rows: Vec<&Row> = state.planned_rows(plan).collect();
        let attempts: Vec<AttemptStatus> =
            state.attempts.iter().map(|a| of_attempt(a, now)).collect();
        let rate_per_hour = rate(&state.attempts);
        let left = plan.len() - rows.len();
        let peaks = state.attempts.iter().filter_map(|attempt| {
            let bytes = attempt.end.as_ref()?.peak_memory_bytes?;
            Some((bytes, provenance(attempt)?.threads))
        });
        Self {
            format: 1,
            study: config.study.name.clone(),
            planned: plan.len(),
            done: rows.len(),
            failed: rows.iter().filter(|row| is_failed(row)).count(),
            running: state.attempts.iter().any(|attempt| attempt.alive),
            attempts: attempts.len(),
            notable_attempts: attempts
                .into_iter()
                .filter(|attempt| attempt.condition != Condition::Ended)
                .collect(),
            repeated: state.repeated,
            cells: cells(plan, &rows),
            failures: rows.iter().filter_map(|row| failure(row)).collect(),
            rate_per_hour,
            remaining_seconds: rate_per_hour.map(|rate| 3600.0 * left as f64 / rate),
            registration_seconds: mean(&rows, "registration_seconds"),
            simulation_seconds: mean(&rows, "simulation_seconds"),
            peak_memory_bytes: peaks.max(),
        }
    }
}

fn provenance(attempt: &Attempt) -> Option<Provenance> {
    serde_json::from_value(attempt.provenance.clone()).ok()
}

fn of_attempt(attempt: &Attempt, now: u64) -> AttemptStatus {
    let silent_seconds = now.saturating_sub(attempt.last_sign_unix);
    let condition = match (attempt.alive, &attempt.end) {
        (true, _) if silent_seconds > STALE_SECONDS => Condition::Stale,
        (true, _) => Condition::Running,
        (false, Some(_)) => Condition::Ended,
        (false, None) => Condition::Died,
    };
    let text = |name: &str| attempt.provenance[name].as_str().unwrap_or("").to_owned();
    let (index, count) = attempt.share;
    AttemptStatus {
        attempt: attempt.attempt,
        shard: Shard::new(index, count).unwrap_or(Shard::WHOLE).to_string(),
        condition,
        host: text("host"),
        slurm_job: text("slurm_job"),
        threads: provenance(attempt).map_or(0, |p| p.threads),
        rows: attempt.rows,
        silent_seconds,
        in_work: attempt.in_work.clone(),
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

/// Rows an hour of all attempts that run, or of the last one that made any.
fn rate(attempts: &[Attempt]) -> Option<f64> {
    let own = |attempt: &Attempt| {
        let started = provenance(attempt)?.started_unix;
        let seconds = attempt.last_sign_unix.saturating_sub(started) as f64;
        (attempt.rows > 0 && seconds > 0.0).then(|| 3600.0 * attempt.rows as f64 / seconds)
    };
    let running: f64 = attempts.iter().filter(|a| a.alive).filter_map(own).sum();
    if running > 0.0 {
        return Some(running);
    }
    attempts.iter().rev().find_map(own)
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

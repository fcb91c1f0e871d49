//! The engine with a worker that takes no time: runs, stops, kills and continuations.

mod deaths;
mod decisions;
mod resuming;
mod shares;

use super::isolation::{Fate, Isolation};
use super::*;
use crate::store::{CRASHED, FAILED, Record, Role, Row, SCHEMA, Value};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{LazyLock, Mutex};

const STUDY: &str = "
[study]
name = \"engine\"
initializations = 2
[population]
phantoms = 1
[surgery]
fragments = 2
[movement]
movements = 3
";

/// 1 specimen x 2 sides x 2 fragments x 3 movements x 2 initializations x 4 scenarios.
const ROWS: usize = 96;

/// Makes rows from keys; fails, panics or stops where it is told to.
#[derive(Default)]
struct Fake {
    fail_case: Option<&'static str>,
    panic_at: Option<&'static str>,
    /// Asks for a soft stop once so many rows were made.
    stop_after: Option<usize>,
    stop: Stop,
    /// A registration that waits until `go_on` is set.
    wait_at: Option<&'static str>,
    waiting: AtomicBool,
    go_on: AtomicBool,
    /// Registrations whose process dies, when it runs suspects.
    deadly: Vec<&'static str>,
    /// Cases whose simulation does.
    deadly_cases: Vec<&'static str>,
    /// Keys and threads of each process that ran suspects.
    processes: Mutex<Vec<(Vec<String>, usize)>>,
    made: AtomicUsize,
    held: AtomicUsize,
    most_held: AtomicUsize,
    seen: Mutex<Vec<String>>,
}

struct FakeCase<'a>(&'a Fake, CaseKey);

impl Drop for FakeCase<'_> {
    fn drop(&mut self) {
        self.0.held.fetch_sub(1, Ordering::SeqCst);
    }
}

/// A worker for one run: cases borrow the fake.
struct FakeWorker<'a>(&'a Fake);

impl<'a> Worker for FakeWorker<'a> {
    type Case = FakeCase<'a>;

    fn simulate(&self, key: &CaseKey) -> Result<FakeCase<'a>, Failure> {
        if self.0.fail_case == Some(key.to_string().as_str()) {
            return Err(Failure::new(
                "movement",
                "no movement is free of collisions",
            ));
        }
        let held = self.0.held.fetch_add(1, Ordering::SeqCst) + 1;
        self.0.most_held.fetch_max(held, Ordering::SeqCst);
        Ok(FakeCase(self.0, key.clone()))
    }

    fn register(
        &self,
        case: &FakeCase,
        key: &RegistrationKey,
        row: &mut Row,
    ) -> Result<(), Failure> {
        assert_eq!(case.1, key.case, "a registration gets its own case");
        row.set("true_lce_deg", 30.0);
        if self.0.wait_at == Some(key.to_string().as_str()) {
            self.0.waiting.store(true, Ordering::SeqCst);
            while !self.0.go_on.load(Ordering::SeqCst) {
                std::thread::yield_now();
            }
        }
        assert_ne!(self.0.panic_at, Some(key.to_string().as_str()), "told to");
        let hash = blake3::hash(key.to_string().as_bytes());
        row.set("rotation_error_deg", f64::from(hash.as_bytes()[0]) / 64.0);
        self.0.seen.lock().unwrap().push(key.to_string());
        let made = self.0.made.fetch_add(1, Ordering::SeqCst) + 1;
        if self.0.stop_after.is_some_and(|limit| made >= limit) {
            self.0.stop.ask();
        }
        Ok(())
    }
}

/// Processes that are none: two keys are in work at a time where there are two threads.
impl Isolation for Fake {
    fn run(
        &self,
        keys: &[RegistrationKey],
        threads: usize,
        _: &Stop,
        record: &mut dyn FnMut(Record),
    ) -> Result<Fate, String> {
        let names: Vec<String> = keys.iter().map(RegistrationKey::to_string).collect();
        self.processes.lock().unwrap().push((names, threads));
        let mut simulated = None;
        for pair in keys.chunks(threads.min(2)) {
            for key in pair {
                if simulated != Some(&key.case) {
                    record(Record::Started(key.case.to_string()));
                    if self.deadly_cases.contains(&key.case.to_string().as_str()) {
                        return Ok(Fate::Died("killed by SIGSEGV".into()));
                    }
                    record(Record::Finished(key.case.to_string()));
                    simulated = Some(&key.case);
                }
                record(Record::Started(key.to_string()));
            }
            if pair
                .iter()
                .any(|key| self.deadly.contains(&key.to_string().as_str()))
            {
                return Ok(Fate::Died("killed by SIGSEGV".into()));
            }
            for key in pair {
                let mut row = key.row();
                let case = FakeWorker(self).simulate(&key.case).unwrap();
                FakeWorker(self).register(&case, key, &mut row).unwrap();
                row.set("status", crate::store::COMPLETE);
                record(Record::Row(Box::new(row)));
            }
        }
        Ok(Fate::Ended)
    }
}

fn parse(text: &str) -> Config {
    Config::parse(text, Path::new("engine.toml"), &|_| None).unwrap()
}

fn open(results: &Path, text: &str) -> Result<Study, StudyError> {
    Study::open(parse(text), results, &OpenOptions::default(), 1)
}

fn snapshot(results: &Path) -> Snapshot {
    Snapshot::read(StudyFolder::of(results, "engine")).unwrap()
}

fn run_share(
    results: &Path,
    fake: &Fake,
    threads: usize,
    redo: Redo,
    shard: Shard,
) -> Result<Outcome, StudyError> {
    let options = RunOptions {
        threads,
        cases_in_flight: 0,
        stop: &fake.stop,
        leave: &|_| {},
    };
    let open = OpenOptions {
        shard,
        ..OpenOptions::default()
    };
    let study = Study::open(parse(STUDY), results, &open, threads)?;
    study.run(&FakeWorker(fake), redo, &options, fake, &|_| {})
}

fn run_with(results: &Path, fake: &Fake, threads: usize, redo: Redo) -> Outcome {
    run_share(results, fake, threads, redo, Shard::WHOLE).unwrap()
}

fn rows(results: &Path) -> Vec<Row> {
    let study = snapshot(results);
    study.state.planned_rows(&study.plan).cloned().collect()
}

/// Every promised value, with the bits of numbers.
fn promised(rows: &[Row]) -> Vec<String> {
    let text = |row: &Row| {
        let columns = SCHEMA
            .columns
            .iter()
            .filter(|c| c.role != Role::Measurement);
        let values = columns.map(|column| match row.get(&column.name) {
            Some(Value::Number(number)) => format!("{:x}", number.to_bits()),
            other => format!("{other:?}"),
        });
        values.collect::<Vec<_>>().join(",")
    };
    rows.iter().map(text).collect()
}

/// The rows of one undisturbed run.
fn whole_run() -> Vec<String> {
    static ROWS_OF_IT: LazyLock<Vec<String>> = LazyLock::new(|| {
        let results = tempfile::tempdir().unwrap();
        let outcome = run_with(results.path(), &Fake::default(), 1, Redo::Nothing);
        assert_eq!((outcome.share.done, outcome.share.failed), (ROWS, 0));
        promised(&rows(results.path()))
    });
    ROWS_OF_IT.clone()
}

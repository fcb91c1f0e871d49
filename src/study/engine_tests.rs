//! The engine with a worker that takes no time: runs, stops, kills and continuations.

use super::*;
use crate::store::{FAILED, Role, Row, SCHEMA, SET_ASIDE, Value};
use polars::prelude::{ParquetReader, SerReader};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

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
    stop: AtomicBool,
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
        assert_ne!(self.0.panic_at, Some(key.to_string().as_str()), "told to");
        let hash = blake3::hash(key.to_string().as_bytes());
        row.set("rotation_error_deg", f64::from(hash.as_bytes()[0]) / 64.0);
        self.0.seen.lock().unwrap().push(key.to_string());
        let made = self.0.made.fetch_add(1, Ordering::SeqCst) + 1;
        if self.0.stop_after.is_some_and(|limit| made >= limit) {
            self.0.stop.store(true, Ordering::SeqCst);
        }
        Ok(())
    }
}

fn open(results: &Path, text: &str) -> Study {
    let config = Config::parse(text, Path::new("engine.toml"), &|_| None).unwrap();
    Study::open(config, results, &OpenOptions::default()).unwrap()
}

fn run_with(results: &Path, fake: &Fake, threads: usize, redo: Redo) -> Outcome {
    let options = RunOptions {
        threads,
        cases_in_flight: 0,
        stop: &fake.stop,
        deadline: None,
    };
    let mut study = open(results, STUDY);
    study
        .run(&FakeWorker(fake), redo, &options, &|_| {})
        .unwrap()
}

fn rows(results: &Path) -> Vec<Row> {
    let study = open(results, STUDY);
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

fn whole_run() -> Vec<String> {
    let results = tempfile::tempdir().unwrap();
    let outcome = run_with(results.path(), &Fake::default(), 1, Redo::Nothing);
    assert_eq!((outcome.done, outcome.failed), (ROWS, 0));
    promised(&rows(results.path()))
}

#[test]
fn any_number_of_threads_gives_the_same_rows() {
    let expected = whole_run();
    assert_eq!(expected.len(), ROWS);
    for threads in [2, 5, 16] {
        let results = tempfile::tempdir().unwrap();
        let fake = Fake::default();
        let outcome = run_with(results.path(), &fake, threads, Redo::Nothing);
        assert_eq!(outcome.ending, Ending::Done);
        assert_eq!(
            promised(&rows(results.path())),
            expected,
            "{threads} threads"
        );
        // 8 registrations a case: so many cases keep the threads busy, and one more.
        let most = fake.most_held.load(Ordering::SeqCst);
        assert!(
            most <= threads.div_ceil(8) + 1,
            "{most} cases for {threads} threads"
        );
        assert_eq!(fake.held.load(Ordering::SeqCst), 0);
    }
}

#[test]
fn a_stopped_run_continues_where_it_was() {
    let expected = whole_run();
    let results = tempfile::tempdir().unwrap();
    let first = Fake {
        stop_after: Some(10),
        ..Fake::default()
    };
    let outcome = run_with(results.path(), &first, 2, Redo::Nothing);
    assert_eq!(outcome.ending, Ending::Stopped);
    assert!((10..ROWS).contains(&outcome.done), "{outcome:?}");
    let second = Fake::default();
    let end = run_with(results.path(), &second, 2, Redo::Nothing);
    assert_eq!((end.ending, end.done), (Ending::Done, ROWS));
    assert_eq!(second.made.load(Ordering::SeqCst), ROWS - outcome.done);
    assert_eq!(promised(&rows(results.path())), expected);
    // A third run has nothing to do.
    let third = Fake::default();
    run_with(results.path(), &third, 2, Redo::Nothing);
    assert_eq!(third.made.load(Ordering::SeqCst), 0);
}

/// kill -9 and a power cut leave a journal that ends anywhere.
#[test]
fn a_journal_cut_anywhere_continues_to_the_same_rows() {
    let expected = whole_run();
    let results = tempfile::tempdir().unwrap();
    run_with(results.path(), &Fake::default(), 2, Redo::Nothing);
    let journal = results.path().join("engine/journal/0001.journal");
    let bytes = std::fs::read(&journal).unwrap();
    for part in 0..16 {
        let results = tempfile::tempdir().unwrap();
        let folder = results.path().join("engine/journal");
        std::fs::create_dir_all(&folder).unwrap();
        let cut = (bytes.len() - 1) * part / 15;
        std::fs::write(folder.join("0001.journal"), &bytes[..cut]).unwrap();
        let before = rows(results.path()).len();
        let fake = Fake::default();
        run_with(results.path(), &fake, 3, Redo::Nothing);
        assert_eq!(
            fake.made.load(Ordering::SeqCst),
            ROWS - before,
            "cut at {cut}"
        );
        assert_eq!(promised(&rows(results.path())), expected, "cut at {cut}");
    }
}

#[test]
fn failures_are_rows_with_their_reason_and_can_be_redone() {
    let results = tempfile::tempdir().unwrap();
    let fake = Fake {
        fail_case: Some("phantom-1/left/f00/m01"),
        panic_at: Some("phantom-1/right/f01/m02/i1/no_cuts_known/paper"),
        ..Fake::default()
    };
    let outcome = run_with(results.path(), &fake, 4, Redo::Nothing);
    assert_eq!((outcome.done, outcome.failed), (ROWS, 9));
    let rows = rows(results.path());
    let failed: Vec<&Row> = rows.iter().filter(|r| r.text("status") == FAILED).collect();
    assert_eq!(failed[0].text("phase"), "movement");
    assert_eq!(
        failed[0].text("message"),
        "no movement is free of collisions"
    );
    assert_eq!(failed[8].text("phase"), "panic");
    assert!(failed[8].text("message").contains("told to"));
    // What was known before the failure stays.
    assert_eq!(failed[8].number("true_lce_deg"), Some(30.0));

    let again = Fake::default();
    assert_eq!(run_with(results.path(), &again, 4, Redo::Nothing).failed, 9);
    assert_eq!(again.made.load(Ordering::SeqCst), 0);
    assert_eq!(run_with(results.path(), &again, 4, Redo::Failed).failed, 0);
    assert_eq!(again.made.load(Ordering::SeqCst), 9);
}

/// Journals of attempts that ended without a word while `key` was in work.
fn crash(results: &Path, key: &str, times: usize) {
    use crate::store::{Record, journal::Writer};
    let study = open(results, STUDY);
    for _ in 0..times {
        let provenance =
            serde_json::to_value(Provenance::now(&study.config, Default::default(), 1)).unwrap();
        let mut writer = Writer::create(&study.folder.journals(), provenance).unwrap();
        writer
            .append(&Record::Started("phantom-1/left/f00/m00".into()))
            .unwrap();
        writer
            .append(&Record::Finished("phantom-1/left/f00/m00".into()))
            .unwrap();
        writer.append(&Record::Started(key.into())).unwrap();
    }
}

#[test]
fn what_ends_its_process_twice_is_tried_alone_and_then_set_aside() {
    let key = "phantom-1/right/f01/m02/i1/no_cuts_known/paper";
    let results = tempfile::tempdir().unwrap();
    crash(results.path(), key, 2);
    let fake = Fake::default();
    run_with(results.path(), &fake, 4, Redo::Nothing);
    assert_eq!(fake.seen.lock().unwrap()[0], key, "the suspect comes first");
    assert_eq!(fake.made.load(Ordering::SeqCst), ROWS);

    let results = tempfile::tempdir().unwrap();
    crash(results.path(), key, 3);
    for attempt in 0..2 {
        let fake = Fake::default();
        let outcome = run_with(results.path(), &fake, 4, Redo::Nothing);
        assert_eq!((outcome.done, outcome.failed), (ROWS, 1));
        let made = if attempt == 0 { ROWS - 1 } else { 0 };
        assert_eq!(fake.made.load(Ordering::SeqCst), made);
    }
    let rows = rows(results.path());
    let row = rows
        .iter()
        .find(|row| row.text("status") == SET_ASIDE)
        .unwrap();
    assert_eq!(RegistrationKey::of_row(row).unwrap().to_string(), key);
    assert!(
        row.text("message")
            .contains(&format!("pao-sim replay STUDY {key}"))
    );
}

#[test]
fn a_case_that_ends_its_process_is_set_aside_with_its_registrations() {
    let results = tempfile::tempdir().unwrap();
    crash(results.path(), "phantom-1/left/f01/m01", 3);
    let outcome = run_with(results.path(), &Fake::default(), 2, Redo::Nothing);
    assert_eq!((outcome.done, outcome.failed), (ROWS, 8));
}

#[test]
fn another_configuration_is_refused_by_name_and_a_larger_study_goes_on() {
    let results = tempfile::tempdir().unwrap();
    run_with(results.path(), &Fake::default(), 2, Redo::Nothing);
    let parse = |text: &str| Config::parse(text, Path::new("engine.toml"), &|_| None).unwrap();
    let other = parse(&STUDY.replace("[study]", "[study]\nseed = 5"));
    let refused = Study::open(other.clone(), results.path(), &OpenOptions::default());
    let message = refused.unwrap_err().to_string();
    assert!(
        message.contains("study.seed: was 20190506, is 5"),
        "{message}"
    );
    assert!(message.contains("--accept study.seed"), "{message}");

    let larger = STUDY.replace("movements = 3", "movements = 4");
    let study = open(results.path(), &larger);
    assert_eq!(
        study.state.left(&study.plan, |_| false).registrations(),
        2 * 2 * 8
    );
    drop(study);

    let accept = OpenOptions {
        accept: vec!["study.seed".into()],
    };
    assert!(Study::open(other, results.path(), &accept).is_ok());
}

#[test]
fn one_process_at_a_time_has_a_study() {
    let results = tempfile::tempdir().unwrap();
    let study = open(results.path(), STUDY);
    let again = Study::open(
        study.config.clone(),
        results.path(),
        &OpenOptions::default(),
    );
    assert!(matches!(again.unwrap_err(), StudyError::Busy { .. }));
}

#[test]
fn the_folder_holds_what_its_readme_says() {
    let results = tempfile::tempdir().unwrap();
    run_with(results.path(), &Fake::default(), 2, Redo::Nothing);
    let folder = results.path().join("engine");
    for file in [
        "study.toml",
        "manifest.json",
        "registrations.parquet",
        "journal/0001.journal",
    ] {
        assert!(folder.join(file).is_file(), "{file}");
    }
    let manifest = std::fs::read_to_string(folder.join("manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&manifest).unwrap();
    assert_eq!(manifest["attempts"][0]["rows"], ROWS);
    assert_eq!(manifest["attempts"][0]["ended_in_order"], true);
    let hash = manifest["attempts"][0]["provenance"]["config"]
        .as_str()
        .unwrap();
    assert_eq!(hash.len(), 64);
    let table = std::fs::File::open(folder.join("registrations.parquet")).unwrap();
    let table = ParquetReader::new(table).finish().unwrap();
    assert_eq!(table.height(), ROWS);
    let scenario = table.column("scenario").unwrap().str().unwrap().get(1);
    assert_eq!(scenario, Some("no_cuts_known"));
}

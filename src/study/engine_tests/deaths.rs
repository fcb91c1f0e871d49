//! Attempts that end without a word.

use super::*;
use crate::store::journal::Writer;

const KEY: &str = "phantom-1/right/f01/m02/i1/no_cuts_known/paper";
const OTHER: &str = "phantom-1/right/f01/m02/i0/all_cuts_known/paper";

/// An attempt that died while these keys were in work.
fn die(results: &Path, keys: &[&str]) {
    let study = open(results, STUDY).unwrap();
    let (folder, number) = (study.folder.clone(), study.attempt());
    drop(study);
    std::fs::remove_file(folder.journals().join(format!("{number:04}.journal"))).unwrap();
    let provenance = Provenance::now(&parse(STUDY), Default::default(), 1);
    let provenance = serde_json::to_value(provenance).unwrap();
    let mut writer = Writer::create(&folder.journals(), number, (0, 1), provenance).unwrap();
    let case = "phantom-1/left/f00/m00".to_owned();
    writer.append(&Record::Started(case.clone())).unwrap();
    writer.append(&Record::Finished(case)).unwrap();
    for key in keys {
        writer.append(&Record::Started((*key).into())).unwrap();
    }
}

fn by_status(results: &Path, status: &str) -> Vec<Row> {
    let mut rows = rows(results);
    rows.retain(|row| row.text("status") == status);
    rows
}

#[test]
fn suspects_run_apart_and_first_and_are_cleared() {
    let results = tempfile::tempdir().unwrap();
    die(results.path(), &[KEY, OTHER]);
    let fake = Fake::default();
    let outcome = run_with(results.path(), &fake, 4, Redo::Nothing);
    assert_eq!((outcome.share.done, outcome.share.failed), (ROWS, 0));
    let processes = fake.processes.lock().unwrap();
    // In the order of the plan, and with all threads.
    assert_eq!(*processes, [(vec![OTHER.to_owned(), KEY.to_owned()], 4)]);
    assert_eq!(fake.seen.lock().unwrap()[0], OTHER, "suspects come first");
    assert_eq!(promised(&rows(results.path())), whole_run());
}

#[test]
fn the_one_that_ends_its_process_alone_is_set_aside() {
    let results = tempfile::tempdir().unwrap();
    die(results.path(), &[KEY, OTHER]);
    let fake = Fake {
        deadly: vec![KEY],
        ..Fake::default()
    };
    let outcome = run_with(results.path(), &fake, 4, Redo::Nothing);
    assert_eq!((outcome.share.done, outcome.share.failed), (ROWS, 1));
    // Both were in work when the first process died; then each had one of its own.
    let processes = fake.processes.lock().unwrap().clone();
    let threads: Vec<usize> = processes.iter().map(|(_, threads)| *threads).collect();
    assert_eq!(threads, [4, 1, 1]);
    let crashed = by_status(results.path(), CRASHED);
    assert_eq!(crashed.len(), 1);
    assert_eq!(
        RegistrationKey::of_row(&crashed[0]).unwrap().to_string(),
        KEY
    );
    let message = crashed[0].text("message");
    assert!(message.contains("killed by SIGSEGV"), "{message}");
    assert!(
        message.contains(&format!("pao-sim replay STUDY {KEY}")),
        "{message}"
    );

    // It stays aside, and comes back, apart, when it is asked for.
    let fake = Fake::default();
    run_with(results.path(), &fake, 4, Redo::Nothing);
    assert_eq!(fake.made.load(Ordering::SeqCst), 0);
    run_with(results.path(), &fake, 4, Redo::Failed);
    assert_eq!(fake.processes.lock().unwrap().len(), 1);
    assert_eq!(promised(&rows(results.path())), whole_run());
}

#[test]
fn a_case_that_ends_its_process_is_set_aside_with_its_registrations() {
    let results = tempfile::tempdir().unwrap();
    die(results.path(), &["phantom-1/right/f01/m02"]);
    let fake = Fake {
        deadly_cases: vec!["phantom-1/right/f01/m02"],
        ..Fake::default()
    };
    let outcome = run_with(results.path(), &fake, 2, Redo::Nothing);
    assert_eq!((outcome.share.done, outcome.share.failed), (ROWS, 8));
    let crashed = by_status(results.path(), CRASHED);
    assert!(crashed.iter().all(|row| row.text("phase") == "simulation"));
}

/// Only one registration of a case was suspected, and its simulation is what ends the process.
#[test]
fn a_case_found_deadly_takes_the_others_along() {
    let results = tempfile::tempdir().unwrap();
    die(results.path(), &[KEY]);
    let fake = Fake {
        deadly_cases: vec!["phantom-1/right/f01/m02"],
        ..Fake::default()
    };
    let outcome = run_with(results.path(), &fake, 2, Redo::Nothing);
    assert_eq!((outcome.share.done, outcome.share.failed), (ROWS, 8));
}

/// Being killed from outside, again and again, makes nobody guilty.
#[test]
fn many_deaths_alone_set_nothing_aside() {
    let results = tempfile::tempdir().unwrap();
    for _ in 0..5 {
        die(results.path(), &[KEY]);
    }
    run_with(results.path(), &Fake::default(), 2, Redo::Nothing);
    assert_eq!(promised(&rows(results.path())), whole_run());
}

/// The process ended between the proof and the row.
#[test]
fn a_proof_without_its_row_is_enough() {
    let results = tempfile::tempdir().unwrap();
    die(results.path(), &[]);
    let folder = StudyFolder::of(results.path(), "engine");
    let provenance = Provenance::now(&parse(STUDY), Default::default(), 1);
    let provenance = serde_json::to_value(provenance).unwrap();
    let mut writer = Writer::create(&folder.journals(), 2, (0, 1), provenance).unwrap();
    let how = "killed by SIGABRT".to_owned();
    let key = KEY.to_owned();
    writer.append(&Record::Crashed { key, how }).unwrap();
    drop(writer);
    let fake = Fake::default();
    let outcome = run_with(results.path(), &fake, 2, Redo::Nothing);
    assert_eq!((outcome.share.done, outcome.share.failed), (ROWS, 1));
    assert!(fake.processes.lock().unwrap().is_empty());
}

/// Time is up while work goes on: it is dropped, and nobody is suspected.
#[test]
fn what_is_dropped_in_time_is_not_suspected() {
    let results = tempfile::tempdir().unwrap();
    let fake = Fake {
        wait_at: Some("phantom-1/left/f00/m02/i0/all_cuts_known/paper"),
        ..Fake::default()
    };
    let left = Mutex::new(None);
    let options = RunOptions {
        threads: 2,
        cases_in_flight: 0,
        stop: &fake.stop,
        // The program would end here.
        leave: &|rows| {
            *left.lock().unwrap() = Some(rows);
            fake.go_on.store(true, Ordering::SeqCst);
        },
    };
    let study = open(results.path(), STUDY).unwrap();
    let outcome = std::thread::scope(|scope| {
        scope.spawn(|| {
            while !fake.waiting.load(Ordering::SeqCst) {
                std::thread::yield_now();
            }
            fake.stop.leave();
        });
        study.run(&FakeWorker(&fake), Redo::Nothing, &options, &fake, &|_| {})
    })
    .unwrap();
    assert_eq!(outcome.ending, Ending::Left);
    assert_eq!(*left.lock().unwrap(), Some(outcome.share.done));
    let state = snapshot(results.path()).state;
    assert!(
        state.attempts[0]
            .in_work
            .contains(&fake.wait_at.unwrap().to_owned())
    );
    assert!(!state.is_suspect(fake.wait_at.unwrap()));
    let again = Fake::default();
    run_with(results.path(), &again, 2, Redo::Nothing);
    assert!(again.processes.lock().unwrap().is_empty());
    assert_eq!(promised(&rows(results.path())), whole_run());
}

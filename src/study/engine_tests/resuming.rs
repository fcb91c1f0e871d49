//! Runs, stops and continuations.

use super::*;
use polars::prelude::{ParquetReader, SerReader};

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
    assert!((10..ROWS).contains(&outcome.share.done), "{outcome:?}");
    let second = Fake::default();
    let end = run_with(results.path(), &second, 2, Redo::Nothing);
    assert_eq!((end.ending, end.share.done), (Ending::Done, ROWS));
    assert_eq!(
        second.made.load(Ordering::SeqCst),
        ROWS - outcome.share.done
    );
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
    let fake = Fake::default();
    let study = open(results.path(), STUDY).unwrap();
    let config = std::fs::read(study.folder.config_file()).unwrap();
    let journal = study.folder.journals().join("0001.journal");
    let bytes = Mutex::new(Vec::new());
    let options = RunOptions {
        threads: 2,
        cases_in_flight: 0,
        stop: &fake.stop,
        leave: &|_| {},
    };
    // The journal as it is after each row.
    let copy = |event: Event| {
        if let Event::Row(_) = event {
            *bytes.lock().unwrap() = std::fs::read(&journal).unwrap();
        }
    };
    study
        .run(&FakeWorker(&fake), Redo::Nothing, &options, &fake, &copy)
        .unwrap();
    let bytes = bytes.into_inner().unwrap();
    for part in 0..16 {
        let results = tempfile::tempdir().unwrap();
        let folder = results.path().join("engine/journal");
        std::fs::create_dir_all(&folder).unwrap();
        let cut = (bytes.len() - 1) * part / 15;
        std::fs::write(folder.join("0001.journal"), &bytes[..cut]).unwrap();
        std::fs::write(results.path().join("engine/study.toml"), &config).unwrap();
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
    assert_eq!((outcome.share.done, outcome.share.failed), (ROWS, 9));
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
    assert_eq!(
        run_with(results.path(), &again, 4, Redo::Nothing)
            .share
            .failed,
        9
    );
    assert_eq!(again.made.load(Ordering::SeqCst), 0);
    assert_eq!(
        run_with(results.path(), &again, 4, Redo::Failed)
            .share
            .failed,
        0
    );
    assert_eq!(again.made.load(Ordering::SeqCst), 9);
}

#[test]
fn another_configuration_is_refused_by_name_and_a_larger_study_goes_on() {
    let results = tempfile::tempdir().unwrap();
    run_with(results.path(), &Fake::default(), 2, Redo::Nothing);
    let other = parse(&STUDY.replace("[study]", "[study]\nseed = 5"));
    let refused = Study::open(other.clone(), results.path(), &OpenOptions::default(), 1);
    let message = refused.unwrap_err().to_string();
    assert!(
        message.contains("study.seed: was 20190506, is 5"),
        "{message}"
    );
    assert!(message.contains("--accept study.seed"), "{message}");

    let larger = STUDY.replace("movements = 3", "movements = 4");
    let study = open(results.path(), &larger).unwrap();
    let left = study.state.left(&study.plan, Shard::WHOLE, |_| false);
    assert_eq!(left.registrations(), 2 * 2 * 8);
    drop(study);

    let accept = OpenOptions {
        accept: vec!["study.seed".into()],
        ..OpenOptions::default()
    };
    assert!(Study::open(other, results.path(), &accept, 1).is_ok());
}

#[test]
fn the_folder_holds_what_its_readme_says() {
    let results = tempfile::tempdir().unwrap();
    run_with(results.path(), &Fake::default(), 2, Redo::Nothing);
    let folder = results.path().join("engine");
    for file in ["study.toml", "manifest.json", "registrations.parquet"] {
        assert!(folder.join(file).is_file(), "{file}");
    }
    assert_eq!(std::fs::read_dir(folder.join("parts")).unwrap().count(), 1);
    assert_eq!(
        std::fs::read_dir(folder.join("journal")).unwrap().count(),
        0
    );
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

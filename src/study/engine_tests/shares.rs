//! Several processes on one study, one after the other or at once.

use super::*;
use proptest::prelude::*;

fn share(text: &str) -> Shard {
    text.parse().unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    /// Whatever number of shares and threads each submission has, whatever was stopped before: the rows
    /// are those of one undisturbed run, and none is made twice.
    #[test]
    fn submissions_with_any_shares_give_the_same_rows(
        submissions in prop::collection::vec((1u32..7, 1usize..5, prop::option::of(1usize..30)), 1..5),
        last in 1u32..5,
    ) {
        let results = tempfile::tempdir().unwrap();
        let mut made = 0;
        for (count, threads, stop_after) in submissions {
            for index in 0..count {
                // From the last to the first: the order must not matter.
                let shard = Shard::new(count - 1 - index, count).unwrap();
                let fake = Fake { stop_after, ..Fake::default() };
                run_share(results.path(), &fake, threads, Redo::Nothing, shard).unwrap();
                made += fake.made.load(Ordering::SeqCst);
            }
        }
        for index in 0..last {
            let fake = Fake::default();
            let shard = Shard::new(index, last).unwrap();
            run_share(results.path(), &fake, 2, Redo::Nothing, shard).unwrap();
            made += fake.made.load(Ordering::SeqCst);
        }
        prop_assert_eq!(made, ROWS);
        prop_assert!(promised(&rows(results.path())) == whole_run());
    }
}

#[test]
fn shares_run_at_once_and_overlapping_ones_are_refused() {
    let results = tempfile::tempdir().unwrap();
    let open = |text: &str| {
        let options = OpenOptions {
            shard: share(text),
            ..OpenOptions::default()
        };
        Study::open(parse(STUDY), results.path(), &options, 1)
    };
    let first = open("1/4").unwrap();
    let second = open("2/4").unwrap();
    assert_eq!((first.attempt(), second.attempt()), (1, 2));
    for overlapping in ["1/4", "1/2", "1/1", "3/6"] {
        let refused = open(overlapping).unwrap_err();
        let StudyError::Busy { theirs, .. } = &refused else {
            panic!("{overlapping}: {refused}")
        };
        assert!(["1/4", "2/4"].contains(&theirs.as_str()));
        assert!(refused.to_string().contains("wait for it or stop it"));
    }
    let others = open("3/4").unwrap();
    drop((first, second));
    // What ended may be taken over, with another number of shares too.
    assert!(open("1/2").is_err(), "the third of four is still at work");
    drop(others);
    assert!(open("1/2").is_ok());
}

/// Two shares cannot be told apart when their studies have different cases.
#[test]
fn another_plan_waits_until_nobody_works() {
    let results = tempfile::tempdir().unwrap();
    let first = open(results.path(), STUDY).unwrap();
    let larger = STUDY.replace("movements = 3", "movements = 4");
    let refused = open(results.path(), &larger).unwrap_err();
    assert!(matches!(refused, StudyError::Diverging { .. }), "{refused}");
    assert!(
        refused
            .to_string()
            .contains("movement.movements: was 3, is 4")
    );
    drop(first);
    assert!(open(results.path(), &larger).is_ok());
}

#[test]
fn many_attempts_leave_few_files() {
    let results = tempfile::tempdir().unwrap();
    for index in 0..40 {
        let shard = Shard::new(index % 12, 12).unwrap();
        let fake = Fake {
            // A quarter of a share each time, so that there is something left for 40 attempts.
            stop_after: Some(2),
            ..Fake::default()
        };
        run_share(results.path(), &fake, 1, Redo::Nothing, shard).unwrap();
    }
    let parts = std::fs::read_dir(results.path().join("engine/parts"))
        .unwrap()
        .count();
    assert!(parts < 16 + 2, "{parts} parts");
    let journals = std::fs::read_dir(results.path().join("engine/journal")).unwrap();
    assert_eq!(journals.count(), 0);
    let state = snapshot(results.path()).state;
    let numbers: Vec<u32> = state.attempts.iter().map(|a| a.attempt).collect();
    assert_eq!(numbers, (1..=40).collect::<Vec<_>>());
    run_with(results.path(), &Fake::default(), 2, Redo::Nothing);
    assert_eq!(promised(&rows(results.path())), whole_run());
}

/// Rows that two processes made without knowing of each other, as on a file system without locks.
fn write_twice(results: &Path, change: impl Fn(&mut Row)) {
    run_with(results, &Fake::default(), 1, Redo::Nothing);
    let store = snapshot(results).folder.store();
    let mut ledger = store.read().unwrap();
    let mut attempt = ledger.attempts.remove(0);
    attempt.attempt = 2;
    for row in &mut ledger.rows {
        row.set("attempt", 2u32);
        row.set("registration_seconds", 7.0);
    }
    change(&mut ledger.rows[5]);
    crate::store::parts::write(&store.parts, vec![attempt], &ledger.rows).unwrap();
}

#[test]
fn rows_that_are_there_twice_are_merged_when_equal() {
    let results = tempfile::tempdir().unwrap();
    write_twice(results.path(), |_| {});
    let study = snapshot(results.path());
    assert_eq!(study.state.repeated, ROWS);
    assert_eq!(promised(&rows(results.path())), whole_run());
    assert_eq!(Status::of(&study).repeated, ROWS);
}

#[test]
fn rows_that_contradict_each_other_are_an_error_that_names_both() {
    let results = tempfile::tempdir().unwrap();
    write_twice(results.path(), |row| row.set("rotation_error_deg", 77.0));
    let folder = StudyFolder::of(results.path(), "engine");
    let message = Snapshot::read(folder).unwrap_err().to_string();
    for expected in [
        "attempts 1 and 2",
        "phantom-1/left/f00/m00/i1/no_cuts_known/paper",
        "(rotation_error_deg)",
        "pao-sim replay",
    ] {
        assert!(message.contains(expected), "{expected} not in {message}");
    }
    assert!(open(results.path(), STUDY).is_err());
}

#[test]
fn a_study_is_thrown_away_only_by_its_name() {
    let results = tempfile::tempdir().unwrap();
    let config = parse(STUDY);
    throw_away(&config, results.path(), "").unwrap();
    run_with(results.path(), &Fake::default(), 1, Redo::Nothing);
    for name in ["", "other"] {
        let refused = throw_away(&config, results.path(), name).unwrap_err();
        let message = refused.to_string();
        assert!(
            message.contains("throws away 96 rows of 1 attempts"),
            "{message}"
        );
        assert!(message.contains("--fresh=engine"), "{message}");
    }
    let running = open(results.path(), STUDY).unwrap();
    let refused = throw_away(&config, results.path(), "engine").unwrap_err();
    assert!(matches!(refused, StudyError::Busy { .. }), "{refused}");
    drop(running);
    throw_away(&config, results.path(), "engine").unwrap();
    assert_eq!(std::fs::read_dir(results.path()).unwrap().count(), 0);
}

#[test]
fn a_newer_store_is_not_written_over() {
    let results = tempfile::tempdir().unwrap();
    run_with(results.path(), &Fake::default(), 1, Redo::Nothing);
    let manifest = results.path().join("engine/manifest.json");
    let text = std::fs::read_to_string(&manifest).unwrap();
    std::fs::write(&manifest, text.replace("\"format\": 2", "\"format\": 3")).unwrap();
    let refused = open(results.path(), STUDY).unwrap_err();
    assert!(
        refused.to_string().contains("format 3, expected at most 2"),
        "{refused}"
    );
}

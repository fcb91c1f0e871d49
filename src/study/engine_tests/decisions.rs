//! What is done with a registration when a study goes on: the engine against a table that was written
//! without it.

use super::*;
use crate::store::journal::Writer;
use proptest::prelude::*;

const SMALL: &str = "
[study]
name = \"engine\"
initializations = 1
scenarios = [\"no_cuts_known\"]
[population]
phantoms = 1
sides = [\"left\"]
[surgery]
fragments = 1
[movement]
movements = 6
";

/// How it stands with one registration.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Before {
    Nothing,
    Complete,
    Failed,
    /// In work when an attempt died.
    Suspect,
    /// Its case was.
    SuspectCase,
    /// Died with its attempt, and came through since.
    Cleared,
    /// Set aside.
    Crashed,
    /// Known to crash, but the row is missing.
    CrashedWithoutRow,
    /// Dropped in time.
    Dropped,
    /// Complete, after it had failed before.
    FailedThenComplete,
}

const ALL: [Before; 10] = [
    Before::Nothing,
    Before::Complete,
    Before::Failed,
    Before::Suspect,
    Before::SuspectCase,
    Before::Cleared,
    Before::Crashed,
    Before::CrashedWithoutRow,
    Before::Dropped,
    Before::FailedThenComplete,
];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Expected {
    /// Its row stays as it is.
    Kept,
    /// Made with the others.
    Made,
    /// Made in a process of its own.
    MadeApart,
    /// A row says that it is set aside, without another try.
    SetAside,
}

/// The oracle.
fn expected(before: Before, retry: bool) -> Expected {
    use Before::*;
    match (before, retry) {
        (Complete | Cleared | FailedThenComplete, _) => Expected::Kept,
        (Nothing | Dropped, _) => Expected::Made,
        (Suspect | SuspectCase, _) => Expected::MadeApart,
        (CrashedWithoutRow, _) => Expected::SetAside,
        (Failed, false) | (Crashed, false) => Expected::Kept,
        (Failed, true) => Expected::Made,
        (Crashed, true) => Expected::MadeApart,
    }
}

fn key(number: usize) -> String {
    format!("phantom-1/left/f00/m{number:02}/i0/no_cuts_known/paper")
}

/// A row as the fake makes it, or a failed one.
fn row(number: usize, status: &str, attempt: u32) -> Record {
    let key: RegistrationKey = key(number).parse().unwrap();
    let mut row = key.row();
    row.set("status", status);
    row.set("true_lce_deg", -7.0);
    row.set("attempt", attempt);
    Record::Row(Box::new(row))
}

/// Two attempts that leave the registrations as wanted.
fn prepare(results: &Path, before: &[Before], code: &str) {
    let config = parse(SMALL);
    let study = open(results, SMALL).unwrap();
    let folder = study.folder.clone();
    drop(study);
    std::fs::remove_file(folder.journals().join("0001.journal")).unwrap();
    let mut provenance = Provenance::now(&config, Default::default(), 1);
    provenance.code = code.into();
    let provenance = serde_json::to_value(provenance).unwrap();
    let begin = || Writer::create(&folder.journals(), 1, (0, 1), provenance.clone()).unwrap();
    let (mut dead, mut ended) = (begin(), begin());
    for (number, before) in before.iter().enumerate() {
        let case = key(number).rsplitn(4, '/').last().unwrap().to_owned();
        let crashed = Record::Crashed {
            key: key(number),
            how: "killed by SIGSEGV".into(),
        };
        let (first, second): (Vec<Record>, Vec<Record>) = match before {
            Before::Nothing => (vec![], vec![]),
            Before::Complete => (vec![row(number, "complete", 1)], vec![]),
            Before::Failed => (vec![row(number, "failed", 1)], vec![]),
            Before::Suspect => (vec![Record::Started(key(number))], vec![]),
            Before::SuspectCase => (vec![Record::Started(case)], vec![]),
            Before::Cleared => (
                vec![Record::Started(key(number))],
                vec![row(number, "complete", 2)],
            ),
            Before::Crashed => (
                vec![Record::Started(key(number))],
                vec![crashed, row(number, CRASHED, 2)],
            ),
            Before::CrashedWithoutRow => (vec![Record::Started(key(number))], vec![crashed]),
            Before::Dropped => (vec![], vec![Record::Started(key(number))]),
            Before::FailedThenComplete => (
                vec![row(number, "failed", 1)],
                vec![row(number, "complete", 2)],
            ),
        };
        for record in first {
            dead.append(&record).unwrap();
        }
        for record in second {
            ended.append(&record).unwrap();
        }
    }
    let end = crate::store::End {
        left: true,
        peak_memory_bytes: None,
    };
    ended.append(&Record::Ended(end)).unwrap();
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn what_is_done_is_what_the_table_says(
        before in prop::collection::vec(prop::sample::select(&ALL[..]), 6),
        config_changed in any::<bool>(),
        code_changed in any::<bool>(),
        accept_config in any::<bool>(),
        accept_code in any::<bool>(),
        retry in any::<bool>(),
    ) {
        let results = tempfile::tempdir().unwrap();
        let code = if code_changed { "of another program" } else { Provenance::code_now() };
        prepare(results.path(), &before, code);
        let text = if config_changed {
            SMALL.replace("[study]", "[study]\nseed = 5")
        } else {
            SMALL.to_owned()
        };
        let mut accept = Vec::new();
        accept.extend(accept_config.then(|| "study.seed".to_owned()));
        accept.extend(accept_code.then(|| "code".to_owned()));
        let options = OpenOptions { accept, ..OpenOptions::default() };
        let redo = if retry { Redo::Failed } else { Redo::Nothing };

        let opened = Study::open(parse(&text), results.path(), &options, 1);
        let refused = (config_changed && !accept_config) || (code_changed && !accept_code);
        if refused {
            let named = opened.unwrap_err().to_string();
            prop_assert_eq!(named.contains("study.seed: was"), config_changed, "{}", named);
            prop_assert_eq!(named.contains("code: was"), code_changed, "{}", named);
            return Ok(());
        }
        let fake = Fake::default();
        let run = RunOptions { threads: 2, cases_in_flight: 0, stop: &fake.stop, leave: &|_| {} };
        opened.unwrap().run(&FakeWorker(&fake), redo, &run, &fake, &|_| {}).unwrap();

        let state = snapshot(results.path()).state;
        let apart: Vec<String> =
            fake.processes.lock().unwrap().iter().flat_map(|(keys, _)| keys.clone()).collect();
        let seen = fake.seen.lock().unwrap().clone();
        for (number, before) in before.iter().enumerate() {
            let name = key(number);
            let row = state.row(&name.parse().unwrap()).expect("every registration has a row");
            let kept = row.number("true_lce_deg") == Some(-7.0);
            let found = match (kept, seen.contains(&name), apart.contains(&name)) {
                (true, false, false) => Expected::Kept,
                (false, true, false) => Expected::Made,
                (false, true, true) => Expected::MadeApart,
                (false, false, false) if row.text("status") == CRASHED => Expected::SetAside,
                other => panic!("{name}: {other:?}"),
            };
            prop_assert_eq!(found, expected(*before, retry), "{:?}", before);
            prop_assert_eq!(seen.iter().filter(|key| **key == name).count() <= 1, true);
        }
    }
}

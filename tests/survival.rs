//! Processes that are killed: at random, and at every named place. Whatever happens, the rows of the
//! study that was continued are those of one undisturbed run.
//!
//! `PAO_SIM_KILLS=200 cargo test --release --features fail-points --test survival -- --nocapture` makes so
//! many random kills with either kind of process.

#![cfg(all(unix, feature = "fail-points"))]

mod noop;
mod rows;

use pao_sim::fail_point::NAMES;
use pao_sim::study::Shard;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rows::promised;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::LazyLock;
use std::time::Duration;
use tempfile::TempDir;

/// 2 hips x 3 fragments x 5 movements x 2 initializations x 4 scenarios = 240 registrations.
const STUDY: &str = "
[study]
name = \"survival\"
initializations = 2
[population]
phantoms = 1
[surgery]
fragments = 3
[movement]
movements = 5
";
const ROWS: usize = 240;
const PAUSE: Duration = Duration::from_millis(1);

/// The rows of one undisturbed run.
static WHOLE: LazyLock<Vec<(String, Vec<String>)>> = LazyLock::new(|| {
    let results = tempfile::tempdir().unwrap();
    noop::run_share(STUDY, results.path(), Shard::WHOLE, 1, Duration::ZERO).unwrap();
    let rows = promised(&table(results.path()));
    assert_eq!(rows[0].1.len(), ROWS);
    rows
});

fn table(results: &Path) -> std::path::PathBuf {
    results.join("survival/registrations.parquet")
}

/// Not a test: the process that the tests below start and kill.
#[test]
#[ignore = "a process of the other tests"]
fn process() {
    let variable = |name: &str| std::env::var(name).expect(name);
    let results = variable("PAO_SIM_TEST_RESULTS");
    let shard = variable("PAO_SIM_TEST_SHARD").parse().unwrap();
    let threads = variable("PAO_SIM_TEST_THREADS").parse().unwrap();
    noop::run_share(STUDY, Path::new(&results), shard, threads, PAUSE).unwrap();
}

fn start(results: &Path, shard: &str, threads: usize, fail_point: Option<String>) -> Child {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command
        .args(["--exact", "process", "--ignored"])
        .env("PAO_SIM_TEST_RESULTS", results)
        .env("PAO_SIM_TEST_SHARD", shard)
        .env("PAO_SIM_TEST_THREADS", threads.to_string())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    if let Some(fail_point) = fail_point {
        command.env("PAO_SIM_FAIL_POINT", fail_point);
    }
    command.spawn().unwrap()
}

/// Finishes a study with so many shares.
fn finish(results: &Path, count: u32) {
    for index in 0..count {
        let shard = Shard::new(index, count).unwrap();
        noop::run_share(STUDY, results, shard, 2, Duration::ZERO).unwrap();
    }
}

fn kills(in_ci: usize) -> usize {
    let wanted = std::env::var("PAO_SIM_KILLS").ok();
    wanted.map_or(in_ci, |text| {
        text.parse().expect("PAO_SIM_KILLS is a number")
    })
}

#[test]
fn kills_at_random_moments_change_no_row() {
    let mut draw = ChaCha8Rng::seed_from_u64(1);
    let (wanted, mut killed, mut studies) = (kills(60), 0, 0);
    while killed < wanted {
        let results = tempfile::tempdir().unwrap();
        for _ in 0..draw.random_range(1..8) {
            let count = draw.random_range(1..5u32);
            let shard = format!("{}/{count}", draw.random_range(1..=count));
            let mut child = start(results.path(), &shard, draw.random_range(1..4), None);
            std::thread::sleep(Duration::from_millis(draw.random_range(0..250)));
            child.kill().unwrap();
            killed += usize::from(child.wait().unwrap().signal() == Some(9));
        }
        finish(results.path(), draw.random_range(1..5));
        assert!(
            promised(&table(results.path())) == *WHOLE,
            "after {killed} kills"
        );
        studies += 1;
    }
    println!("{killed} kills of {studies} studies of {ROWS} rows: no row differs");
}

#[test]
fn kills_at_every_named_place_change_no_row() {
    let mut reached = 0;
    for name in NAMES.iter().filter(|name| **name != "report.begun") {
        for time in [1, 2, 7, 40] {
            let results = tempfile::tempdir().unwrap();
            // Enough parts that they are merged: a place of its own.
            let before = if name.starts_with("merge") { 15 } else { 1 };
            for index in 0..before {
                let shard = Shard::new(index, 30).unwrap();
                noop::run_share(STUDY, results.path(), shard, 1, Duration::ZERO).unwrap();
            }
            let mut child = start(results.path(), "1/1", 2, Some(format!("{name}:{time}")));
            let signal = child.wait().unwrap().signal();
            // A place that is passed seldom is not reached for the later times.
            assert!(
                signal == Some(9) || time > 1,
                "{name}:{time} was not reached"
            );
            reached += usize::from(signal == Some(9));
            finish(results.path(), 3);
            assert!(
                promised(&table(results.path())) == *WHOLE,
                "after a kill at {name}:{time}"
            );
            assert!(no_litter(results.path()), "after a kill at {name}:{time}");
        }
    }
    println!(
        "{reached} kills at {} places: no row differs",
        NAMES.len() - 1
    );
}

/// No temporary file and no journal is left of dead processes.
fn no_litter(results: &Path) -> bool {
    let study = results.join("survival");
    let names = ["", "parts", "journal"].iter().flat_map(|folder| {
        let entries = std::fs::read_dir(study.join(folder)).unwrap();
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
    });
    let mut names = names.collect::<Vec<_>>().into_iter();
    !names.any(|name| name.starts_with('.') || name.ends_with(".journal"))
}

const SMOKE: &str = "configs/smoke.toml";

fn smoke(results: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin("pao-sim"));
    command
        .arg("--results")
        .arg(results)
        .args(["run", SMOKE])
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

static SMOKE_WHOLE: LazyLock<TempDir> = LazyLock::new(|| {
    let results = tempfile::tempdir().unwrap();
    assert!(smoke(results.path(), &[]).status().unwrap().success());
    results
});

fn smoke_rows(results: &Path) -> Vec<(String, Vec<String>)> {
    promised(&results.join("smoke/registrations.parquet"))
}

#[test]
fn kills_of_the_program_itself_change_no_row() {
    let whole = smoke_rows(SMOKE_WHOLE.path());
    let mut draw = ChaCha8Rng::seed_from_u64(2);
    let (wanted, mut killed, mut studies) = (kills(6), 0, 0);
    while killed < wanted {
        let results = tempfile::tempdir().unwrap();
        for _ in 0..draw.random_range(1..5) {
            let threads = draw.random_range(1..4).to_string();
            let mut child = smoke(results.path(), &["--threads", &threads])
                .spawn()
                .unwrap();
            std::thread::sleep(Duration::from_millis(draw.random_range(0..4000)));
            child.kill().unwrap();
            killed += usize::from(child.wait().unwrap().signal() == Some(9));
        }
        assert!(smoke(results.path(), &[]).status().unwrap().success());
        assert!(smoke_rows(results.path()) == whole, "after {killed} kills");
        studies += 1;
    }
    println!("{killed} kills of the program in {studies} studies of 8 rows: no row differs");
}

#[test]
fn a_kill_before_the_report_leaves_the_rows() {
    let results = tempfile::tempdir().unwrap();
    let killed = smoke(results.path(), &[])
        .env("PAO_SIM_FAIL_POINT", "report.begun")
        .status();
    assert_eq!(killed.unwrap().signal(), Some(9));
    assert!(smoke_rows(results.path()) == smoke_rows(SMOKE_WHOLE.path()));
    assert!(smoke(results.path(), &[]).status().unwrap().success());
    assert!(results.path().join("smoke/report/report.html").is_file());
}

/// The real culprit: the program dies, its next run tries the suspects apart and sets one aside.
#[test]
fn a_registration_that_ends_its_process_is_set_aside_as_crashed() {
    let key = "phantom-1/left/f00/m00/i1/no_cuts_known/paper";
    let results = tempfile::tempdir().unwrap();
    let run = || {
        smoke(results.path(), &["--threads", "2"])
            .env("PAO_SIM_ABORT_AT", key)
            .status()
    };
    assert_eq!(
        run().unwrap().signal(),
        Some(6),
        "the first time it takes the program along"
    );
    assert_eq!(
        run().unwrap().code(),
        Some(3),
        "the second time it is alone"
    );
    let rows = pao_sim::report::Rows::read(&results.path().join("smoke/registrations.parquet"));
    let rows = rows.unwrap();
    let crashed: Vec<usize> = (0..rows.len())
        .filter(|&i| rows.text("status")[i] == "crashed")
        .collect();
    assert_eq!(crashed.len(), 1);
    assert_eq!(rows.text("scenario")[crashed[0]], "no_cuts_known");
    assert!(rows.text("message")[crashed[0]].contains("killed by SIGABRT"));
    // Asked for again, and cured: the whole study.
    let retried = smoke(results.path(), &["--retry-failed"]).status().unwrap();
    assert_eq!(retried.code(), Some(0));
    assert!(smoke_rows(results.path()) == smoke_rows(SMOKE_WHOLE.path()));
}

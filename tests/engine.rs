//! The built binary on the reduced study: whole, stopped, killed and continued.

use assert_cmd::Command;
use pao_sim::report::Rows;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::LazyLock;
use tempfile::TempDir;

mod rows;
use rows::promised;

const SMOKE: &str = "configs/smoke.toml";

fn pao_sim(results: &Path) -> Command {
    let mut command = Command::cargo_bin("pao-sim").expect("cargo builds the binary for its tests");
    command.arg("--results").arg(results);
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The smoke study, run once for all tests that only look at it.
static WHOLE: LazyLock<TempDir> = LazyLock::new(|| {
    let results = tempfile::tempdir().unwrap();
    pao_sim(results.path())
        .args(["run", SMOKE, "--threads", "2"])
        .assert()
        .success();
    results
});

fn table(results: &Path) -> PathBuf {
    results.join("smoke/registrations.parquet")
}

#[test]
fn the_smoke_study_is_whole_and_says_that_it_is_reduced() {
    let results = WHOLE.path();
    let rows = Rows::read(&table(results)).unwrap();
    assert_eq!(rows.len(), 8);
    assert!(
        rows.text("status")
            .iter()
            .all(|status| status == "complete")
    );
    // All four scenarios of one case share its truth and its picks, and differ in their estimates.
    let distinct = |column: &str| {
        let mut bits: Vec<u64> = rows.numbers(column).iter().map(|v| v.to_bits()).collect();
        bits.sort();
        bits.dedup();
        bits.len()
    };
    assert_eq!(distinct("true_rotation_deg"), 1);
    assert_eq!(distinct("pick_point_offset_mm"), 2);
    assert_eq!(distinct("rotation_error_deg"), 8);

    let report = std::fs::read_to_string(results.join("smoke/report/report.md")).unwrap();
    assert!(report.contains("REDUCED STUDY: coarse phantom"), "{report}");
    assert!(
        report.contains("8 of 8 registrations are complete"),
        "{report}"
    );
    let list = std::fs::read_to_string(results.join("smoke/report/specimens.csv")).unwrap();
    assert!(list.contains("\nphantom-1,phantom,male,none,"), "{list}");
    assert!(report.contains("**Specimens**"), "{report}");
    let group = results.join("smoke/report/phantom-paper");
    for file in [
        "table1.csv",
        "table1.tex",
        "table2.md",
        "errors_joint.png",
        "lce_errors.svg",
    ] {
        assert!(group.join(file).is_file(), "{file}");
    }
    let status = pao_sim(results)
        .args(["--json", "status", SMOKE])
        .assert()
        .success();
    let status: serde_json::Value = serde_json::from_slice(&status.get_output().stdout).unwrap();
    assert_eq!(
        (status["done"].as_u64(), status["running"].as_bool()),
        (Some(8), Some(false))
    );
}

#[test]
fn a_registration_is_replayed_bit_by_bit() {
    let key = "phantom-1/left/f00/m00/i1/ilium_pubis_estimated/paper";
    let replay = pao_sim(WHOLE.path())
        .args(["--json", "replay", SMOKE, key])
        .assert()
        .success();
    let replay: serde_json::Value = serde_json::from_slice(&replay.get_output().stdout).unwrap();
    assert_eq!(replay["differences"], 0);
    assert_eq!(replay["row"]["scenario"], "ilium_pubis_estimated");
    let nobody = key.replace("m00", "m01");
    let refused = pao_sim(WHOLE.path())
        .args(["replay", SMOKE, &nobody])
        .assert()
        .code(2);
    assert!(text(&refused.get_output().stderr).contains("has no registration or case"));
}

/// Runs the study and gives the process once `rows` rows were committed. Nobody reads what it prints
/// from then on, which must not disturb it.
fn begun(results: &Path, rows: usize) -> Child {
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("pao-sim"))
        .arg("--results")
        .arg(results)
        .args(["--json", "run", SMOKE, "--threads", "1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert_eq!(lines.take(rows).filter(Result::is_ok).count(), rows);
    child
}

#[cfg(unix)]
#[test]
fn a_killed_run_continues_to_the_same_results() {
    let results = tempfile::tempdir().unwrap();
    let mut child = begun(results.path(), 3);
    child.kill().unwrap();
    child.wait().unwrap();
    let status = pao_sim(results.path())
        .args(["--json", "status", SMOKE])
        .assert()
        .success();
    let status: serde_json::Value = serde_json::from_slice(&status.get_output().stdout).unwrap();
    let done = status["done"].as_u64().unwrap();
    assert!((3..8).contains(&done), "{status}");
    let run = pao_sim(results.path())
        .args(["--json", "run", SMOKE, "--threads", "3"])
        .assert()
        .success();
    // One line a row, and one at the end.
    let lines = text(&run.get_output().stdout).lines().count();
    assert_eq!(lines as u64, 8 - done + 1);
    assert_eq!(
        promised(&table(results.path())),
        promised(&table(WHOLE.path()))
    );
}

#[cfg(unix)]
#[test]
fn a_stopped_run_ends_softly_and_continues() {
    let results = tempfile::tempdir().unwrap();
    let mut child = begun(results.path(), 1);
    let pid = child.id().to_string();
    std::process::Command::new("kill")
        .args(["-TERM", &pid])
        .status()
        .unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(75));
    let done = Rows::read(&table(results.path())).unwrap().len();
    assert!((1..8).contains(&done), "{done} rows");
    let report = results.path().join("smoke/report/report.md");
    let report = std::fs::read_to_string(report).unwrap();
    assert!(
        report.contains(&format!("{done} of 8 registrations")),
        "{report}"
    );
    pao_sim(results.path())
        .args(["run", SMOKE])
        .assert()
        .success();
    assert_eq!(
        promised(&table(results.path())),
        promised(&table(WHOLE.path()))
    );
}

#[test]
fn a_time_limit_that_is_over_begins_nothing() {
    let results = tempfile::tempdir().unwrap();
    pao_sim(results.path())
        .args(["run", SMOKE, "--time-limit", "0s"])
        .assert()
        .code(75);
    assert_eq!(Rows::read(&table(results.path())).unwrap().len(), 0);
}

#[test]
fn a_dry_run_tells_what_is_left_and_touches_nothing() {
    let left = |results: &Path| {
        let told = pao_sim(results)
            .args(["--json", "run", SMOKE, "--dry-run"])
            .assert()
            .success();
        let told: serde_json::Value = serde_json::from_slice(&told.get_output().stdout).unwrap();
        (
            told["left"].as_u64().unwrap(),
            told["planned"].as_u64().unwrap(),
        )
    };
    let nothing = tempfile::tempdir().unwrap();
    assert_eq!(left(nothing.path()), (8, 8));
    assert_eq!(std::fs::read_dir(nothing.path()).unwrap().count(), 0);
    assert_eq!(left(WHOLE.path()), (0, 8));
    // What a run refuses, a dry run refuses.
    let other = nothing.path().join("other.toml");
    let smoke = std::fs::read_to_string(SMOKE).unwrap();
    std::fs::write(&other, smoke.replace("step_mm = 3.0", "step_mm = 2.0")).unwrap();
    let refused = pao_sim(WHOLE.path())
        .arg("run")
        .arg(&other)
        .arg("--dry-run")
        .assert()
        .code(2);
    assert!(text(&refused.get_output().stderr).contains("step_mm"));
}

#[test]
fn a_plan_counts_the_papers_registrations() {
    let results = tempfile::tempdir().unwrap();
    let plan = pao_sim(results.path())
        .args(["--json", "plan", "configs/full.toml"])
        .assert()
        .success();
    let plan: serde_json::Value = serde_json::from_slice(&plan.get_output().stdout).unwrap();
    assert_eq!(plan["registrations"], 72_000);
    assert_eq!(plan["cells"].as_array().unwrap().len(), 4);
    assert_eq!(plan["cells"][3]["registrations"], 18_000);
    for (config, registrations) in [("quick", 8), ("smoke", 8)] {
        let file = format!("configs/{config}.toml");
        let plan = pao_sim(results.path())
            .args(["--json", "plan", &file])
            .assert()
            .success();
        let plan: serde_json::Value = serde_json::from_slice(&plan.get_output().stdout).unwrap();
        assert_eq!(plan["registrations"], registrations, "{config}");
    }
}

#[test]
fn three_mistakes_are_told_at_once_and_exit_with_2() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wrong.toml");
    let wrong = "[study]\nsed = 1\n\n[surgery]\nfragments = 0\n\n[population]\nspecimens = [\"${PAO_SIM_NOWHERE}/a\"]\n";
    std::fs::write(&file, wrong).unwrap();
    for command in ["run", "plan"] {
        let refused = pao_sim(folder.path())
            .arg(command)
            .arg(&file)
            .assert()
            .code(2);
        let message = text(&refused.get_output().stderr);
        for expected in [
            "3 mistakes",
            "wrong.toml:2: study.sed is no key of [study]; did you mean \"seed\"?",
            "wrong.toml:5: surgery.fragments is 0; expected 1 to 1000",
            "wrong.toml:8: \"${PAO_SIM_NOWHERE}/a\" needs the environment variable PAO_SIM_NOWHERE",
        ] {
            assert!(message.contains(expected), "{expected}\nnot in\n{message}");
        }
    }
    let nothing = pao_sim(folder.path())
        .args(["status", "nowhere"])
        .assert()
        .code(2);
    assert!(text(&nothing.get_output().stderr).contains("neither a study's folder"));
}

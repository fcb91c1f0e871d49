//! Full disks, folders that cannot be written, processes that come in each other's way.

#![cfg(unix)]

use assert_cmd::Command;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::Stdio;

mod noop;
mod rows;

use pao_sim::study::Shard;
use std::time::Duration;

const SMOKE: &str = "configs/smoke.toml";

fn pao_sim(results: &Path) -> Command {
    let mut command = Command::cargo_bin("pao-sim").expect("cargo builds the binary for its tests");
    command.arg("--results").arg(results);
    command
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A file system in memory. Only root may mount one.
struct Mounted(PathBuf);

impl Mounted {
    /// `None`, with a word, where this process may not mount; where `PAO_SIM_REQUIRE_ROOT` is set that is
    /// a failure.
    fn new(folder: &Path, options: &str) -> Option<Self> {
        let mount = std::process::Command::new("mount")
            .args(["-t", "tmpfs", "-o", options, "tmpfs"])
            .arg(folder)
            .output();
        if mount.is_ok_and(|output| output.status.success()) {
            return Some(Self(folder.to_owned()));
        }
        assert!(
            std::env::var_os("PAO_SIM_REQUIRE_ROOT").is_none(),
            "PAO_SIM_REQUIRE_ROOT is set and a tmpfs cannot be mounted at {}",
            folder.display()
        );
        println!("SKIPPED: a tmpfs cannot be mounted at {}", folder.display());
        None
    }

    fn remount(&self, options: &str) {
        let mount = std::process::Command::new("mount")
            .args(["-o", &format!("remount,{options}")])
            .arg(&self.0)
            .status();
        assert!(mount.unwrap().success(), "remount with {options}");
    }
}

impl Drop for Mounted {
    fn drop(&mut self) {
        let _ = std::process::Command::new("umount").arg(&self.0).status();
    }
}

/// 2 x 3 x 5 cases, 240 registrations: a quarter of a megabyte of journal.
const STUDY: &str = "
[study]
name = \"hostile\"
initializations = 2
[population]
phantoms = 1
[surgery]
fragments = 3
[movement]
movements = 5
";

#[test]
fn a_full_disk_loses_nothing_that_was_committed() {
    let folder = tempfile::tempdir().unwrap();
    let whole = tempfile::tempdir().unwrap();
    noop::run_share(STUDY, whole.path(), Shard::WHOLE, 1, Duration::ZERO).unwrap();
    let whole = rows::promised(&whole.path().join("hostile/registrations.parquet"));
    // From too small for anything to enough for all but the last file.
    let mut full = 0;
    for kilobytes in (1..).map(|n| 4 * n * n) {
        let Some(disk) = Mounted::new(folder.path(), &format!("size={kilobytes}k")) else {
            return;
        };
        let run = || noop::run_share(STUDY, folder.path(), Shard::WHOLE, 2, Duration::ZERO);
        let Err(error) = run() else {
            break;
        };
        full += 1;
        let error = error.to_string();
        assert!(error.contains("No space left"), "{kilobytes} KB: {error}");
        assert!(
            error.contains(folder.path().to_str().unwrap()),
            "{kilobytes} KB: {error}"
        );
        disk.remount("size=50m");
        run().unwrap();
        let table = folder.path().join("hostile/registrations.parquet");
        assert!(rows::promised(&table) == whole, "{kilobytes} KB");
    }
    assert!(full > 5, "the disk was full {full} times only");
}

#[test]
fn the_program_says_that_the_disk_is_full() {
    let folder = tempfile::tempdir().unwrap();
    let Some(disk) = Mounted::new(folder.path(), "size=12k") else {
        return;
    };
    let refused = pao_sim(folder.path()).args(["run", SMOKE]).assert().code(1);
    let message = text(&refused.get_output().stderr);
    assert!(message.contains("No space left"), "{message}");
    assert!(message.contains("free some space"), "{message}");
    disk.remount("size=50m");
    pao_sim(folder.path())
        .args(["run", SMOKE])
        .assert()
        .success();
}

#[test]
fn a_folder_that_cannot_be_written_is_told_and_can_still_be_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let Some(disk) = Mounted::new(folder.path(), "size=50m") else {
        return;
    };
    pao_sim(folder.path())
        .args(["run", SMOKE, "--time-limit", "0s"])
        .assert()
        .code(75);
    disk.remount("ro");
    for command in [&["run", SMOKE][..], &["report", SMOKE]] {
        let refused = pao_sim(folder.path()).args(command).assert().code(1);
        let message = text(&refused.get_output().stderr);
        assert!(message.contains("Read-only file system"), "{message}");
        assert!(
            message.contains(folder.path().to_str().unwrap()),
            "{message}"
        );
    }
    let key = "phantom-1/left/f00/m00/i0/no_cuts_known/paper";
    for command in [
        &["status", SMOKE][..],
        &["status", SMOKE, "--why", key],
        &["plan", SMOKE, "--remaining"],
        &["run", SMOKE, "--dry-run"],
    ] {
        pao_sim(folder.path()).args(command).assert().success();
    }
    disk.remount("rw");
}

#[test]
fn a_second_process_on_the_same_share_is_refused() {
    let results = tempfile::tempdir().unwrap();
    let mut first = std::process::Command::new(assert_cmd::cargo::cargo_bin("pao-sim"))
        .arg("--results")
        .arg(results.path())
        .args(["--json", "run", SMOKE, "--threads", "1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(first.stdout.take().unwrap()).lines();
    assert!(lines.next().is_some(), "the first row");
    let refused = pao_sim(results.path())
        .args(["run", SMOKE])
        .assert()
        .code(1);
    let message = text(&refused.get_output().stderr);
    assert!(
        message.contains("another process works on share 1/1"),
        "{message}"
    );
    assert!(
        message.contains(&format!("process {}", first.id())),
        "{message}"
    );
    let fresh = pao_sim(results.path())
        .args(["run", SMOKE, "--fresh=smoke"])
        .assert()
        .code(1);
    assert!(text(&fresh.get_output().stderr).contains("another process works"));
    let status = pao_sim(results.path())
        .args(["status", SMOKE])
        .assert()
        .success();
    let status = text(&status.get_output().stdout);
    assert!(status.contains("; running, 1 attempts"), "{status}");
    assert!(status.contains("attempt 1 (share 1/1)"), "{status}");
    // Reading on lets it print; it was not disturbed.
    assert_eq!(lines.count(), 8);
    assert_eq!(first.wait().unwrap().code(), Some(0));
}

/// Asked twice, the program leaves at once; nothing is suspected and nothing is lost.
#[test]
fn a_second_signal_leaves_at_once() {
    let results = tempfile::tempdir().unwrap();
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("pao-sim"))
        .arg("--results")
        .arg(results.path())
        .args(["--json", "run", SMOKE, "--threads", "1"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.next().is_some(), "the first row");
    let mut told = BufReader::new(child.stderr.take().unwrap()).lines();
    let signal = || {
        let pid = child.id().to_string();
        let sent = std::process::Command::new("kill")
            .args(["-INT", &pid])
            .status();
        assert!(sent.unwrap().success());
    };
    signal();
    let first = told.find(|line| line.as_ref().is_ok_and(|line| line.contains("SIGINT")));
    assert!(first.unwrap().unwrap().contains("once more leaves at once"));
    signal();
    assert_eq!(child.wait().unwrap().code(), Some(75));
    let status = pao_sim(results.path())
        .args(["--json", "status", SMOKE])
        .assert()
        .success();
    let status: serde_json::Value = serde_json::from_slice(&status.get_output().stdout).unwrap();
    assert_eq!(
        status["notable_attempts"].as_array().unwrap().len(),
        0,
        "{status}"
    );
    assert!(status["done"].as_u64().unwrap() >= 1);
}

#[test]
fn colours_and_bars_are_for_terminals_only() {
    let results = tempfile::tempdir().unwrap();
    for no_colour in [false, true] {
        let mut run = pao_sim(results.path());
        if no_colour {
            run.env("NO_COLOR", "1");
        }
        let run = run.args(["run", SMOKE]).assert().success();
        let output = run.get_output();
        let printed = text(&output.stdout) + &text(&output.stderr);
        assert!(
            !printed.contains('\u{1b}') && !printed.contains('\r'),
            "{printed}"
        );
        let last = text(&output.stderr).lines().last().unwrap().to_owned();
        assert!(
            last.starts_with("complete: 8 of 8 registrations; the report is"),
            "{last}"
        );
    }
}

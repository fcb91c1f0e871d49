//! What the program prints, word by word.

use assert_cmd::Command;
use std::path::Path;
use std::time::Duration;

mod noop;

use pao_sim::study::Shard;

fn printed(results: &Path, arguments: &[&str]) -> String {
    let mut command = Command::cargo_bin("pao-sim").expect("cargo builds the binary for its tests");
    let run = command
        .arg("--results")
        .arg(results)
        .args(arguments)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&run.stdout) + String::from_utf8_lossy(&run.stderr);
    text.replace(results.to_str().unwrap(), "RESULTS")
}

#[test]
fn help() {
    let nowhere = Path::new("/nonexistent");
    let mut text = String::new();
    for command in [
        &["--help"][..],
        &["run", "--help"],
        &["plan", "--help"],
        &["status", "--help"],
        &["report", "--help"],
        &["replay", "--help"],
        &["show", "--help"],
    ] {
        text += &format!(
            "$ pao-sim {}\n{}\n",
            command.join(" "),
            printed(nowhere, command)
        );
    }
    insta::assert_snapshot!(text);
}

const STUDY: &str = "
[study]
name = \"texts\"
initializations = 2
[population]
phantoms = 1
[surgery]
fragments = 1
[movement]
movements = 4
";

/// Times and places differ from machine to machine.
fn redacted(text: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    for line in text.lines() {
        let line = if line.contains(" of one thread") || line.contains(" cores: ") {
            line.split(':').next().unwrap().to_owned() + ": TIME"
        } else if line.contains("memory: a process") {
            "memory: MEASURED".into()
        } else if line.contains("an hour") {
            "RATE".into()
        } else {
            line.to_owned()
        };
        lines.push(line);
    }
    lines.join("\n")
}

#[test]
fn plan_and_status() {
    let results = tempfile::tempdir().unwrap();
    let file = results.path().join("texts.toml");
    std::fs::write(&file, STUDY).unwrap();
    let file = file.to_str().unwrap();
    let key = "phantom-1/left/f00/m01/i0/no_cuts_known/paper";
    let mut text = String::new();
    let mut tell = |arguments: &[&str]| {
        let told = redacted(&printed(results.path(), arguments));
        let command = arguments.join(" ").replace(file, "texts.toml");
        text += &format!("$ pao-sim {command}\n{told}\n\n");
    };
    tell(&["plan", file]);
    tell(&["status", file]);
    let share = |i| Shard::new(i, 4).unwrap();
    noop::run_share(STUDY, results.path(), share(0), 1, Duration::ZERO).unwrap();
    tell(&["status", file]);
    tell(&["status", file, "--why", key]);
    tell(&["plan", file, "--remaining"]);
    tell(&["run", file, "--dry-run", "--threads", "2"]);
    tell(&["run", file, "--fresh"]);
    tell(&["run", file, "--shard", "5/4"]);
    noop::run_share(STUDY, results.path(), Shard::WHOLE, 1, Duration::ZERO).unwrap();
    tell(&["status", file, "--why", key]);
    insta::assert_snapshot!(text);
}

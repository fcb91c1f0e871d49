//! `pao-sim slurm` of the built binary, with commands in Slurm's place that write down how they were called.
#![cfg(unix)]

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// The smoke study with two cases.
const TWO_CASES: &str = "[study]\nname = \"two\"\n[population]\nphantoms = 1\nsides = [\"left\"]\nphantom.voxel_mm = 3.0\n[surgery]\nfragments = 1\n[movement]\nmovements = 2\n";

/// An sbatch that numbers its jobs from 41 and writes down its arguments.
const SBATCH: &str = r#"echo "sbatch $*" >>"$CALLS"
n=$(grep -c ^sbatch "$CALLS")
echo "$((40 + n))${CLUSTER:-}""#;

/// A place to work: a configuration, results, and commands that stand before all others.
struct Place {
    folder: TempDir,
}

impl Place {
    fn new(commands: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let place = Self { folder };
        fs::create_dir(place.path("bin")).unwrap();
        fs::write(place.path("two.toml"), TWO_CASES).unwrap();
        for (name, text) in commands {
            place.command(name, text);
        }
        place
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, name: &str, text: &str) {
        let path = self.path("bin").join(name);
        fs::write(&path, format!("#!/bin/sh\n{text}\n")).unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    }

    /// `pao-sim slurm two.toml` in this place; no command of a real Slurm is found.
    fn slurm(&self) -> Command {
        let mut command = Command::cargo_bin("pao-sim").unwrap();
        let path = format!("{}:/usr/bin:/bin", self.path("bin").display());
        command.current_dir(self.folder.path()).env("PATH", path);
        command.env("CALLS", self.path("calls"));
        command.args(["slurm", "two.toml"]);
        for missing in ["sbatch", "scontrol", "squeue"] {
            if !self.path("bin").join(missing).exists() {
                self.command(missing, "exit 127");
            }
        }
        command
    }

    fn calls(&self) -> Vec<String> {
        let text = fs::read_to_string(self.path("calls")).unwrap_or_default();
        let own = self.folder.path().display().to_string();
        text.lines()
            .map(|line| line.replace(&own, "HERE"))
            .collect()
    }
}

fn stderr(assert: &assert_cmd::assert::Assert) -> String {
    String::from_utf8_lossy(&assert.get_output().stderr).into_owned()
}

fn json(assert: &assert_cmd::assert::Assert) -> Value {
    serde_json::from_slice(&assert.get_output().stdout).unwrap()
}

#[test]
fn help() {
    let help = Command::cargo_bin("pao-sim")
        .unwrap()
        .args(["slurm", "--help"])
        .assert()
        .success();
    insta::assert_snapshot!(String::from_utf8_lossy(&help.get_output().stdout));
}

#[test]
fn without_submit_nothing_of_slurm_is_needed() {
    let place = Place::new(&[]);
    let written = place.slurm().args(["--tasks", "2"]).assert().success();
    let printed = String::from_utf8_lossy(&written.get_output().stdout).into_owned();
    assert!(
        printed.contains("the same command with --submit submits them"),
        "{printed}"
    );
    assert_eq!(place.calls(), Vec::<String>::new());
    let folder = place.path("results/two/slurm");
    let script = fs::read_to_string(folder.join("array.sbatch")).unwrap();
    assert!(script.contains("#SBATCH --array=0-1\n"), "{script}");
    assert!(place.path("results/two/logs").is_dir());
}

#[test]
fn the_report_follows_all_arrays() {
    let place = Place::new(&[
        ("sbatch", SBATCH),
        ("scontrol", "echo 'MaxArraySize            = 1'"),
    ]);
    let submitted = place
        .slurm()
        .env("CLUSTER", ";alpha")
        .args(["--tasks", "2", "--submit", "--json"])
        .assert()
        .success();
    let told = json(&submitted);
    assert_eq!(told["arrays"][0]["job"], 41);
    assert_eq!(told["arrays"][1]["job"], 42);
    assert_eq!(told["arrays"][1]["first_share"], 2);
    assert_eq!(told["report"]["job"], 43);
    assert_eq!(told["left"], 40);
    assert_eq!(
        place.calls(),
        [
            "sbatch --parsable HERE/results/two/slurm/array-1.sbatch",
            "sbatch --parsable HERE/results/two/slurm/array-2.sbatch",
            "sbatch --parsable --dependency=afterany:41:42 HERE/results/two/slurm/report.sbatch",
        ]
    );
}

#[test]
fn a_limit_of_running_tasks_holds_over_several_arrays() {
    let place = Place::new(&[("sbatch", SBATCH)]);
    place
        .slurm()
        .args([
            "--tasks=2",
            "--max-array-size=1",
            "--max-running=1",
            "--submit",
        ])
        .assert()
        .success();
    assert_eq!(
        place.calls()[1],
        "sbatch --parsable --dependency=afterany:41 HERE/results/two/slurm/array-2.sbatch"
    );
}

#[test]
fn what_sbatch_refuses_is_an_error() {
    let place = Place::new(&[(
        "sbatch",
        "echo 'sbatch: error: invalid partition' >&2; exit 1",
    )]);
    let refused = place
        .slurm()
        .args(["--tasks", "2", "--submit"])
        .assert()
        .code(1);
    let message = stderr(&refused);
    assert!(message.contains("sbatch refused "), "{message}");
    assert!(message.contains("error: invalid partition"), "{message}");
}

#[test]
fn an_answer_without_a_number_is_an_error_and_names_what_was_submitted() {
    let place = Place::new(&[(
        "sbatch",
        &format!("case \"$*\" in *report*) exit 0;; esac\n{SBATCH}"),
    )]);
    let refused = place
        .slurm()
        .args(["--tasks", "2", "--submit"])
        .assert()
        .code(1);
    let message = stderr(&refused);
    assert!(message.contains(r#"printed """#), "{message}");
    assert!(message.contains("already submitted: 41; "), "{message}");
}

#[test]
fn without_sbatch_submission_fails_and_says_what_to_do() {
    let place = Place::new(&[]);
    let mut command = place.slurm();
    fs::remove_file(place.path("bin/sbatch")).unwrap();
    let only = place.path("bin");
    let refused = command
        .env("PATH", &only)
        .args(["--tasks", "2", "--submit"])
        .assert()
        .code(1);
    let message = stderr(&refused);
    assert!(message.contains("cannot start sbatch: "), "{message}");
    assert!(message.contains("on a login node"), "{message}");
    assert!(place.path("results/two/slurm/array.sbatch").is_file());
}

#[test]
fn jobs_that_are_in_the_queue_are_told() {
    let place = Place::new(&[("sbatch", SBATCH)]);
    let own = place.path("results/two/slurm/array.sbatch");
    let queue = format!(
        "echo '7 {0}'\necho '7 {0}'\necho '8 /other/array.sbatch'",
        own.display()
    );
    place.command("squeue", &queue);
    let submitted = place
        .slurm()
        .args(["--tasks", "2", "--submit"])
        .assert()
        .success();
    let message = stderr(&submitted);
    assert!(message.contains("in the queue already (7)"), "{message}");
}

#[test]
fn values_are_refused_with_2_before_anything_is_written() {
    let place = Place::new(&[]);
    for (arguments, expected) in [
        (vec!["--tasks=3"], "--tasks 3: expected 1 to 2"),
        (
            vec!["--tasks=2", "--time=60s"],
            "--margin 00:02:00: expected less than --time 00:01:00",
        ),
        (vec!["--tasks=2", "--time=soon"], "--time"),
        (
            vec!["--tasks=2", "--sbatch", "--array=1-9"],
            "--sbatch \"--array=1-9\": --array is set",
        ),
        (vec!["--tasks=2", "--mem=lots"], "--mem lots: expected"),
    ] {
        let refused = place.slurm().args(&arguments).assert().code(2);
        let message = stderr(&refused);
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
    assert!(!place.path("results").exists());
}

/// The script as bash runs it, with the program's copy replaced by one that writes down its arguments.
#[test]
fn a_script_gives_its_task_the_share_and_the_threads() {
    let place = Place::new(&[]);
    let results = place.path("it's 100% \"new\"");
    let written = place
        .slurm()
        .args(["--tasks=2", "--max-array-size=1", "--cpus=3", "--json"])
        .arg("--results")
        .arg(&results)
        .assert()
        .success();
    let told = json(&written);
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    let program = text(&told["program"]);
    fs::remove_file(&program).unwrap();
    fs::write(&program, "#!/bin/sh\nprintf '%s\\n' \"$@\"\n").unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let script = text(&told["arrays"][1]["script"]);
    let ran = std::process::Command::new("/bin/bash")
        .arg(&script)
        .env("SLURM_ARRAY_TASK_ID", "0")
        .env("SLURM_CPUS_PER_TASK", "3")
        .output()
        .unwrap();
    let config = text(&told["config"]);
    assert_eq!(
        String::from_utf8(ran.stdout)
            .unwrap()
            .lines()
            .collect::<Vec<_>>(),
        [
            "--results",
            results.to_str().unwrap(),
            "run",
            &config,
            "--shard",
            "2/2",
            "--threads",
            "3"
        ]
    );
    assert!(Path::new(&config).is_file());
    let outside = std::process::Command::new("/bin/bash")
        .arg(&script)
        .env_remove("SLURM_ARRAY_TASK_ID")
        .output()
        .unwrap();
    assert!(!outside.status.success());
    let message = String::from_utf8_lossy(&outside.stderr).into_owned();
    assert!(
        message.contains("submit this script with sbatch"),
        "{message}"
    );
}

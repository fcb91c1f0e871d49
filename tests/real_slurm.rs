//! A study on a real Slurm: stopped at a time limit, requeued, cancelled, continued with another number of tasks,
//! and equal to one that a single process made.
#![cfg(target_os = "linux")]

use pao_sim::report::Rows;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

mod cluster;
mod rows;
use cluster::{Cluster, listening, output};
use rows::promised;

/// Movements of the study: enough work that every task is in the middle of it when it is disturbed.
const MOVEMENTS: usize = 9;

/// Registrations of a case of the smoke study.
const PER_CASE: usize = 8;

const PLANNED: u64 = (MOVEMENTS * PER_CASE) as u64;

struct Study {
    config: PathBuf,
    results: PathBuf,
}

impl Study {
    /// The smoke study with more movements, with results in a folder whose name asks for care.
    fn new(folder: &Path) -> Self {
        let smoke = std::fs::read_to_string("configs/smoke.toml").unwrap();
        let more = smoke.replace("movements = 1", &format!("movements = {MOVEMENTS}"));
        assert_ne!(more, smoke, "the smoke study has one movement");
        let config = folder.join("smoke.toml");
        std::fs::write(&config, more).unwrap();
        Self {
            config,
            results: folder.join("Ada's 100% \"new\" results"),
        }
    }

    fn folder(&self) -> PathBuf {
        self.results.join("smoke")
    }

    fn table(&self) -> PathBuf {
        self.folder().join("registrations.parquet")
    }

    /// `pao-sim --json COMMAND CONFIG ...`: its last line.
    fn pao_sim(&self, mut command: Command, name: &str, arguments: &[&str]) -> Value {
        command.arg("--json").arg("--results").arg(&self.results);
        command.arg(name).arg(&self.config).args(arguments);
        let printed = output(&mut command);
        serde_json::from_str(printed.lines().last().unwrap()).unwrap()
    }

    /// Submits the study and gives what was told of its jobs.
    fn submit(&self, cluster: &Cluster, tasks: u32) -> Value {
        // A signal may come a minute before its time: with this margin soon after a limit of one minute is set.
        let tasks = format!("--tasks={tasks}");
        let arguments = [&tasks, "--cpus=1", "--time=10", "--margin=55s", "--submit"];
        self.pao_sim(cluster.command(binary()), "slurm", &arguments)
    }

    fn status(&self) -> Value {
        self.pao_sim(Command::new(binary()), "status", &[])
    }

    /// What a job wrote to its log.
    fn log(&self, job: &str) -> String {
        let path = self.folder().join(format!("logs/slurm-{job}.log"));
        std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }
}

fn binary() -> PathBuf {
    assert_cmd::cargo::cargo_bin("pao-sim")
}

#[test]
fn a_study_on_a_cluster_is_the_one_of_a_single_process() {
    if !cluster::available() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let alone = Study {
        results: folder.path().join("alone"),
        ..Study::new(folder.path())
    };
    let told = alone.pao_sim(Command::new(binary()), "run", &["--threads=2"]);
    assert_eq!(told["done"], PLANNED);

    let study = Study::new(folder.path());
    // Three tasks make two arrays.
    let cluster = Cluster::start(2);
    for port in cluster.ports() {
        assert_eq!(listening(port), ["0100007F"], "port {port}");
    }
    disturbed(&study, &cluster);
    continued(&study, &cluster);
    assert_eq!(promised(&study.table()), promised(&alone.table()));

    let config = cluster.config.clone();
    drop(cluster);
    assert_eq!(Cluster::processes(&config), Vec::<String>::new());
    assert!(!config.exists(), "{} is left", config.display());
}

/// One task runs into its time limit, one is requeued, one is cancelled; the report follows.
fn disturbed(study: &Study, cluster: &Cluster) {
    let told = study.submit(cluster, 3);
    let job = |array: usize| told["arrays"][array]["job"].as_u64().unwrap();
    let limited = format!("{}_0", job(0));
    let requeued = format!("{}_1", job(0));
    let cancelled = format!("{}_0", job(1));
    let report = told["report"]["job"].to_string();
    for task in [&limited, &requeued, &cancelled] {
        cluster.wait_for(task, "RUNNING", 60);
    }
    wait_for_rows(study, 3);

    // The program asked for the end of its job when it started, so that only a signal tells it of a new one.
    // slurmctld looks every 30 seconds whom to signal. Until then the task is held, however fast it is; Slurm lets
    // a job go on that it signals.
    let program = cluster.process_with("1/3");
    output(Command::new("kill").args(["-STOP", &program]));
    cluster.scontrol(&["update", &format!("JobId={limited}"), "TimeLimit=1"]);
    cluster.scontrol(&["requeue", &requeued]);
    output(cluster.command("scancel").arg(&cancelled));

    cluster.wait_for(&cancelled, "CANCELLED", 60);
    let told = cluster.wait_for(&limited, "FAILED", 90);
    assert_eq!(told["ExitCode"], "75:0", "{}", study.log(&limited));
    let told = cluster.wait_for(&requeued, "COMPLETED", 180);
    assert_eq!(told["Restarts"], "1");
    let log = study.log(&requeued);
    assert_eq!(log.matches("study smoke: share 2/3").count(), 2, "{log}");
    // Every task knows when it ends: also the one whose number is the array's.
    for task in [&limited, &requeued, &cancelled] {
        let log = study.log(task);
        assert!(!log.contains("is not known"), "{log}");
    }

    cluster.wait_for(&report, "COMPLETED", 60);
    let done = Rows::read(&study.table()).unwrap().len() as u64;
    assert!((3..PLANNED).contains(&done), "{done} rows");
    let log = study.log(&format!("{report}-report"));
    assert!(log.contains(&format!("{done} of {PLANNED}")), "{log}");
    assert!(log.contains("what is left, this continues: "), "{log}");
}

/// The same command with another number of tasks does what is left, and nothing twice.
fn continued(study: &Study, cluster: &Cluster) {
    let before = study.status();
    let told = study.submit(cluster, 2);
    assert_eq!(
        told["left"].as_u64().unwrap(),
        PLANNED - before["done"].as_u64().unwrap()
    );
    let array = &told["arrays"][0]["job"];
    for task in 0..2 {
        cluster.wait_for(&format!("{array}_{task}"), "COMPLETED", 180);
    }
    let report = told["report"]["job"].to_string();
    cluster.wait_for(&report, "COMPLETED", 60);
    let status = study.status();
    assert_eq!(status["done"], PLANNED, "{status}");
    assert_eq!(status["failed"], 0, "{status}");
    assert_eq!(status["repeated"], 0, "{status}");
    assert_eq!(status["running"], false, "{status}");

    let told = study.submit(cluster, 5);
    assert_eq!(told["left"], 0);
    assert_eq!(told["report"]["job"], Value::Null);
}

fn wait_for_rows(study: &Study, rows: u64) {
    let begin = Instant::now();
    // The first task to start writes the study's configuration; before, there is nothing to tell of.
    let begun = || study.folder().join("study.toml").is_file();
    while !begun() || study.status()["done"].as_u64().unwrap() < rows {
        assert!(
            begin.elapsed() < Duration::from_secs(60),
            "no {rows} rows after a minute"
        );
        std::thread::sleep(Duration::from_millis(200));
    }
}

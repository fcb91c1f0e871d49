//! A real Slurm cluster on this machine, for as long as a test needs it (`scripts/real_slurm.sh`).

use std::collections::HashMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// True when a cluster can be started here. Says why not, and fails when `PAO_SIM_REQUIRE_SLURM` is set.
///
/// Packages that are missing are installed only when it is set: an ordinary test changes no system.
pub fn available() -> bool {
    let required = std::env::var_os("PAO_SIM_REQUIRE_SLURM").is_some();
    let missing: Vec<&str> = ["munged", "slurmctld", "slurmd", "sbatch"]
        .into_iter()
        .filter(|program| !on_path(program))
        .collect();
    let is_root = output(Command::new("id").arg("-u")).trim() == "0";
    let lacks = match (is_root, missing.as_slice()) {
        (true, []) => return true,
        (true, _) if required => return true,
        (true, missing) => format!(
            "{} (scripts/real_slurm.sh installs them)",
            missing.join(", ")
        ),
        (false, _) => "root".to_owned(),
    };
    assert!(
        !required,
        "PAO_SIM_REQUIRE_SLURM is set, but a cluster needs {lacks}"
    );
    println!("SKIPPED: a Slurm cluster needs {lacks}");
    false
}

/// The path with the folders of daemons.
fn path() -> String {
    let path = std::env::var("PATH").unwrap_or_default();
    format!("{path}:/usr/sbin:/sbin")
}

fn on_path(program: &str) -> bool {
    path()
        .split(':')
        .any(|folder| Path::new(folder).join(program).is_file())
}

/// What a command prints; it must succeed.
pub fn output(command: &mut Command) -> String {
    let output = command
        .output()
        .unwrap_or_else(|e| panic!("{command:?}: {e}"));
    let (out, err) = (output.stdout, output.stderr);
    assert!(
        output.status.success(),
        "{command:?}: {}\n{}",
        output.status,
        String::from_utf8_lossy(&err)
    );
    String::from_utf8_lossy(&out).into_owned()
}

/// A cluster of two nodes; stopped when it is dropped, also by a panic.
pub struct Cluster {
    /// The script, which waits for the end of its input.
    script: Child,
    /// The cluster's configuration.
    pub config: PathBuf,
}

impl Cluster {
    /// Starts a cluster with a `MaxArraySize`.
    pub fn start(max_array_size: u32) -> Self {
        let mut script = Command::new("scripts/real_slurm.sh")
            .args(["sh", "-c", r#"echo "$SLURM_CONF"; exec cat"#])
            .env("PATH", path())
            .env("PAO_SIM_MAX_ARRAY_SIZE", max_array_size.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        let mut printed = BufReader::new(script.stdout.take().unwrap());
        printed.read_line(&mut line).unwrap();
        let config = PathBuf::from(line.trim());
        let cluster = Self { script, config };
        assert!(
            cluster.config.is_file(),
            "the cluster did not start; the script says why"
        );
        cluster
    }

    /// A command of Slurm, or one that calls such commands.
    pub fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", &self.config);
        command
    }

    /// What `scontrol` tells of a job or a task (`12_0`), by its names.
    pub fn job(&self, job: &str) -> HashMap<String, String> {
        let text = output(
            self.command("scontrol")
                .args(["show", "job", "--oneliner", job]),
        );
        text.split_whitespace()
            .filter_map(|word| word.split_once('='))
            .map(|(name, value)| (name.to_owned(), value.to_owned()))
            .collect()
    }

    pub fn scontrol(&self, arguments: &[&str]) {
        output(self.command("scontrol").args(arguments));
    }

    /// Waits until a job is in a state, and gives what is told of it then.
    pub fn wait_for(&self, job: &str, state: &str, seconds: u64) -> HashMap<String, String> {
        let begin = Instant::now();
        loop {
            let told = self.job(job);
            if told["JobState"] == state {
                return told;
            }
            let over = begin.elapsed() > Duration::from_secs(seconds);
            let ended = ["COMPLETED", "FAILED", "CANCELLED", "TIMEOUT", "NODE_FAIL"];
            assert!(
                !over && !ended.contains(&told["JobState"].as_str()),
                "job {job} is {} and not {state} after {:.0?}: {told:?}",
                told["JobState"],
                begin.elapsed()
            );
            std::thread::sleep(Duration::from_millis(300));
        }
    }

    /// The processes that live with this cluster's configuration in their environment: job steps, jobs, and what
    /// this script runs.
    pub fn processes(config: &Path) -> Vec<String> {
        let entry = format!("SLURM_CONF={}", config.display());
        let processes = std::fs::read_dir("/proc").unwrap().flatten();
        processes
            .filter(|process| {
                let environment = std::fs::read(process.path().join("environ"));
                environment.is_ok_and(|bytes| {
                    bytes
                        .split(|byte| *byte == 0)
                        .any(|v| v == entry.as_bytes())
                })
            })
            .map(|process| process.file_name().to_string_lossy().into_owned())
            .collect()
    }

    /// The process of this cluster's jobs that has a word as its argument.
    pub fn process_with(&self, argument: &str) -> String {
        let has = |process: &String| {
            let words = std::fs::read(format!("/proc/{process}/cmdline")).unwrap_or_default();
            words
                .split(|byte| *byte == 0)
                .any(|word| word == argument.as_bytes())
        };
        let found: Vec<String> = Self::processes(&self.config)
            .into_iter()
            .filter(has)
            .collect();
        let [process] = found.as_slice() else {
            panic!("{} processes have the argument {argument}", found.len())
        };
        process.clone()
    }

    /// The ports of the cluster's daemons.
    pub fn ports(&self) -> Vec<u16> {
        let text = std::fs::read_to_string(&self.config).unwrap();
        text.split_whitespace()
            .filter_map(|word| {
                let (name, port) = word.split_once('=')?;
                ["Port", "SlurmctldPort"]
                    .contains(&name)
                    .then(|| port.parse().unwrap())
            })
            .collect()
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        // The end of its input ends `cat`, and the script stops what it started.
        drop(self.script.stdin.take());
        let status = self.script.wait();
        if !std::thread::panicking() {
            assert!(
                status.unwrap().success(),
                "the cluster did not stop in order"
            );
        }
    }
}

/// The addresses that listen on a port, as the kernel writes them: `0100007F` is 127.0.0.1.
pub fn listening(port: u16) -> Vec<String> {
    let mut addresses = Vec::new();
    for table in ["/proc/net/tcp", "/proc/net/tcp6"] {
        let text = std::fs::read_to_string(table).unwrap_or_default();
        for line in text.lines().skip(1) {
            let fields: Vec<&str> = line.split_whitespace().collect();
            let (address, local) = fields[1].split_once(':').unwrap();
            // 0A is the state of a listening socket.
            if fields[3] == "0A" && u16::from_str_radix(local, 16) == Ok(port) {
                addresses.push(address.to_owned());
            }
        }
    }
    addresses
}

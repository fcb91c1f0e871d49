//! With what and where an attempt runs.

use super::Config;
use super::specimen_list::specimen_list;
use crate::anatomy::Source;
use crate::simd::SimdLevel;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::{SystemTime, UNIX_EPOCH};

/// One attempt's circumstances. Rows of attempts that differ in `config` or `code` are not mixed
/// unless somebody says so.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Hash of the program's sources and lock file.
    pub code: String,
    /// Commit of the sources, `-dirty` appended when they differ from it; `unknown` outside git.
    pub commit: String,
    /// BLAKE3 of the configuration's keys that results depend on.
    pub config: String,
    /// Fingerprint of the files of each specimen that has some, by its name.
    #[serde(default)]
    pub specimens: BTreeMap<String, String>,
    /// Where each specimen comes from, by its name.
    #[serde(default)]
    pub sources: BTreeMap<String, Source>,
    /// What differed from the attempts before and was accepted by name.
    #[serde(default)]
    pub accepted: Vec<String>,
    /// Level of vector instructions.
    pub simd: SimdLevel,
    pub host: String,
    /// Operating system and architecture.
    pub platform: String,
    /// Model of the processor, where the system tells it.
    pub cpu: String,
    /// Vector instructions of the processor that the program looks for.
    #[serde(default)]
    pub cpu_flags: Vec<String>,
    /// What scored the candidates: `cpu`.
    #[serde(default)]
    pub backend: String,
    /// GPU and driver, where one scored the candidates.
    #[serde(default)]
    pub gpu: Option<String>,
    pub threads: usize,
    /// Number of the process on its host.
    #[serde(default)]
    pub process: u32,
    /// Slurm's job and array task, or empty.
    #[serde(default)]
    pub slurm_job: String,
    /// Seconds since 1970 (UTC).
    pub started_unix: u64,
}

/// Version of the layout of a study's folder.
pub const FORMAT: u64 = 2;

impl Provenance {
    /// Hash of this program's sources and lock file.
    pub fn code_now() -> &'static str {
        env!("PAO_SIM_CODE_HASH")
    }

    /// The circumstances of a run that begins now, on specimens of these
    /// [`fingerprints`](super::fingerprint::fingerprints).
    pub fn now(config: &Config, specimens: BTreeMap<String, String>, threads: usize) -> Self {
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH);
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            code: Self::code_now().into(),
            commit: env!("PAO_SIM_COMMIT").into(),
            config: config.hash(),
            specimens,
            sources: specimen_list(&config.population),
            accepted: Vec::new(),
            simd: SimdLevel::current(),
            host: first_line("/proc/sys/kernel/hostname").unwrap_or_else(|| "unknown".into()),
            platform: format!("{}-{}", std::env::consts::OS, std::env::consts::ARCH),
            cpu_flags: crate::simd::flags(),
            backend: "cpu".into(),
            gpu: None,
            cpu: cpu_model().unwrap_or_else(|| "unknown".into()),
            threads,
            process: std::process::id(),
            slurm_job: slurm_job(&|name| std::env::var(name).ok()),
            started_unix: since_1970.map_or(0, |elapsed| elapsed.as_secs()),
        }
    }
}

fn slurm_job(variable: &dyn Fn(&str) -> Option<String>) -> String {
    match (
        variable("SLURM_ARRAY_JOB_ID"),
        variable("SLURM_ARRAY_TASK_ID"),
    ) {
        (Some(job), Some(task)) => format!("{job}_{task}"),
        _ => variable("SLURM_JOB_ID").unwrap_or_default(),
    }
}

fn first_line(path: &str) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    Some(text.lines().next()?.trim().to_owned())
}

fn cpu_model() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

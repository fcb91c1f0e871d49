//! What can go wrong on the way to a job.

use super::JobId;
use std::path::PathBuf;

/// A study whose jobs could not be written or submitted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SlurmError {
    #[error("{flag} {value}: {expected}")]
    Value {
        flag: &'static str,
        value: String,
        /// What was expected, and why.
        expected: String,
    },
    #[error(
        "{path:?} cannot stand in a job script; give a --results folder whose path is text without control characters"
    )]
    Path { path: PathBuf },
    #[error(
        "{} is not what its name says: its content was changed; remove it and give the command again",
        path.display()
    )]
    Changed { path: PathBuf },
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        action: &'static str,
        path: PathBuf,
        #[source]
        cause: std::io::Error,
    },
    #[error(
        "cannot start {program}: {cause}; give the command where Slurm's commands are, on a login node, or leave --submit out and submit the scripts there{}",
        already(submitted)
    )]
    NoProgram {
        program: &'static str,
        #[source]
        cause: std::io::Error,
        submitted: Vec<JobId>,
    },
    #[error(
        "sbatch refused {} ({status}): {message}{}", script.display(), already(submitted)
    )]
    Refused {
        script: PathBuf,
        status: std::process::ExitStatus,
        /// What sbatch said.
        message: String,
        submitted: Vec<JobId>,
    },
    #[error(
        "sbatch took {} but printed {printed:?} where a job's number was expected; look with `squeue --me` whether it is in the queue{}",
        script.display(), already(submitted)
    )]
    NoId {
        script: PathBuf,
        printed: String,
        submitted: Vec<JobId>,
    },
}

/// What is to know of the jobs that were submitted before the one that failed.
fn already(submitted: &[JobId]) -> String {
    if submitted.is_empty() {
        return String::new();
    }
    let ids: Vec<String> = submitted.iter().map(JobId::to_string).collect();
    let ids = ids.join(" ");
    format!("\nalready submitted: {ids}; they stay in the queue (`scancel {ids}` takes them out)")
}

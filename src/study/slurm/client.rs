//! Slurm's own commands: asking for the cluster's limits and the queue, and submitting.

use super::{Installed, Request, SlurmError};
use std::fmt;
use std::io;
use std::path::Path;
use std::process::{Command, Output};

/// The number of a job; that of an array stands for all its tasks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct JobId(pub u64);

impl fmt::Display for JobId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// The jobs of a submission.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Submitted {
    /// In the order of the scripts.
    pub arrays: Vec<JobId>,
    pub report: JobId,
}

/// The cluster's `MaxArraySize`, where `scontrol` tells it.
pub fn max_array_size() -> Option<u32> {
    let output = output(Command::new("scontrol").args(["show", "config"])).ok()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    text.lines().find_map(|line| {
        let (name, value) = line.split_once('=')?;
        (name.trim() == "MaxArraySize").then(|| value.trim().parse().ok())?
    })
}

/// This user's jobs in the queue whose script lies in `scripts`, without repetition; none where
/// `squeue` tells nothing.
pub fn queued(scripts: &Path) -> Vec<JobId> {
    let mut squeue = Command::new("squeue");
    // The number of the array, and the script.
    squeue.args(["--me", "--noheader", "--format=%F %o"]);
    let Ok(output) = output(&mut squeue) else {
        return Vec::new();
    };
    let text = String::from_utf8_lossy(&output.stdout);
    let mut jobs: Vec<JobId> = text
        .lines()
        .filter_map(|line| {
            let (id, script) = line.trim().split_once(' ')?;
            let of_study = Path::new(script.trim()).starts_with(scripts);
            of_study.then(|| id.parse().ok().map(JobId))?
        })
        .collect();
    jobs.sort();
    jobs.dedup();
    jobs
}

/// Submits the arrays, and the report to follow when all of them have ended, however they end.
///
/// With a limit of tasks at the same time each array waits for the one before, since Slurm knows such a
/// limit for one array only.
///
/// # Errors
/// When sbatch cannot be started, refuses a script, or prints no number. What was submitted before
/// stays submitted, and the error names it.
pub fn submit(installed: &Installed, request: &Request) -> Result<Submitted, SlurmError> {
    let mut arrays = Vec::new();
    for (script, _) in &installed.arrays {
        let before = arrays.last().filter(|_| request.max_running.is_some());
        let after: Vec<JobId> = before.copied().into_iter().collect();
        arrays.push(sbatch(script, &after, &arrays)?);
    }
    let report = sbatch(&installed.report, &arrays, &arrays)?;
    Ok(Submitted { arrays, report })
}

/// Submits one script, to start when all jobs of `after` have ended.
fn sbatch(script: &Path, after: &[JobId], submitted: &[JobId]) -> Result<JobId, SlurmError> {
    let mut command = Command::new("sbatch");
    command.arg("--parsable");
    if !after.is_empty() {
        let ids: Vec<String> = after.iter().map(JobId::to_string).collect();
        command.arg(format!("--dependency=afterany:{}", ids.join(":")));
    }
    let submitted = submitted.to_vec();
    let output = match command.arg(script).output() {
        Ok(output) => output,
        Err(cause) => {
            return Err(SlurmError::NoProgram {
                program: "sbatch",
                cause,
                submitted,
            });
        }
    };
    let printed = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        return Err(SlurmError::Refused {
            script: script.to_owned(),
            status: output.status,
            message: if message.is_empty() { printed } else { message },
            submitted,
        });
    }
    job_id(&printed).ok_or_else(|| SlurmError::NoId {
        script: script.to_owned(),
        printed,
        submitted,
    })
}

/// Reads what `sbatch --parsable` prints: `12`, or `12;cluster`.
fn job_id(printed: &str) -> Option<JobId> {
    let number = printed.split(';').next()?;
    let digits = number.bytes().all(|byte| byte.is_ascii_digit());
    digits.then(|| number.parse().ok().map(JobId))?
}

/// What a command printed, if it succeeded.
fn output(command: &mut Command) -> io::Result<Output> {
    let output = command.output()?;
    if output.status.success() {
        Ok(output)
    } else {
        Err(io::Error::other(output.status.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_numbers_are_job_numbers() {
        assert_eq!(job_id("12"), Some(JobId(12)));
        assert_eq!(job_id("12;alpha"), Some(JobId(12)));
        for printed in ["", ";alpha", "Submitted batch job 12", "-3", "12 13"] {
            assert_eq!(job_id(printed), None, "{printed:?}");
        }
    }
}

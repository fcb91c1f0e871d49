//! When a Slurm job ends.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// How long `squeue` may take to answer.
const PATIENCE: Duration = Duration::from_secs(15);

/// Time until the Slurm job that this process belongs to ends: from its environment, or asked once from
/// `squeue`. `None` outside of a job, or when nobody knows.
pub fn time_left() -> Option<Duration> {
    let variable = |name: &str| std::env::var(name).ok();
    let job = job(&variable)?;
    if let Some(end) = variable("SLURM_JOB_END_TIME")
        && let Ok(end) = end.parse::<u64>()
    {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).ok()?;
        return Some(Duration::from_secs(end).saturating_sub(now));
    }
    let answer = ask(&job);
    if answer.is_none() {
        eprintln!(
            "when Slurm job {job} ends is not known (squeue does not tell): only a signal or --time-limit stops this run in time"
        );
    }
    answer
}

/// The job as squeue knows exactly one: a task of an array by the array and its index. One of the tasks has the
/// array's own number, by which squeue tells of all of them.
fn job(variable: &dyn Fn(&str) -> Option<String>) -> Option<String> {
    let job = variable("SLURM_JOB_ID")?;
    let array = variable("SLURM_ARRAY_JOB_ID").zip(variable("SLURM_ARRAY_TASK_ID"));
    Some(array.map_or(job, |(array, task)| format!("{array}_{task}")))
}

fn ask(job: &str) -> Option<Duration> {
    let mut child = Command::new("squeue")
        .args(["-h", "-j", job, "-o", "%L"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    let begin = Instant::now();
    while child.try_wait().ok()?.is_none() {
        if begin.elapsed() > PATIENCE {
            let _ = child.kill();
            let _ = child.wait();
            return None;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().ok()?;
    parse(String::from_utf8_lossy(&output.stdout).trim())
}

/// Reads squeue's `[days-][[hours:]minutes:]seconds`.
fn parse(text: &str) -> Option<Duration> {
    let (days, clock) = text.split_once('-').unwrap_or(("0", text));
    let days: u64 = days.parse().ok()?;
    let mut seconds = 0;
    for part in clock.split(':') {
        seconds = 60 * seconds + part.parse::<u64>().ok()?;
    }
    Some(Duration::from_secs(86_400 * days + seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_task_of_an_array_is_told_from_the_array() {
        let job_of = |variables: &[(&str, &str)]| {
            job(&|name| {
                let found = variables.iter().find(|(known, _)| *known == name);
                found.map(|(_, value)| (*value).to_owned())
            })
        };
        assert_eq!(job_of(&[]), None);
        assert_eq!(job_of(&[("SLURM_JOB_ID", "7")]).as_deref(), Some("7"));
        let task = [
            ("SLURM_JOB_ID", "9"),
            ("SLURM_ARRAY_JOB_ID", "7"),
            ("SLURM_ARRAY_TASK_ID", "1"),
        ];
        assert_eq!(job_of(&task).as_deref(), Some("7_1"));
    }

    #[test]
    fn squeues_times_are_read() {
        let seconds = |text| parse(text).map(|time| time.as_secs());
        assert_eq!(seconds("1-02:03:04"), Some(93_784));
        assert_eq!(seconds("02:03:04"), Some(7384));
        assert_eq!(seconds("0:55"), Some(55));
        for unknown in ["UNLIMITED", "NOT_SET", "INVALID", ""] {
            assert_eq!(seconds(unknown), None);
        }
    }
}

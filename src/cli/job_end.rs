//! When a Slurm job ends.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// How long `squeue` may take to answer.
const PATIENCE: Duration = Duration::from_secs(15);

/// Time until the Slurm job that this process belongs to ends: from its environment, or asked once from
/// `squeue`. `None` outside of a job, or when nobody knows.
pub fn time_left() -> Option<Duration> {
    let job = std::env::var("SLURM_JOB_ID").ok()?;
    if let Some(end) = std::env::var("SLURM_JOB_END_TIME").ok()
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

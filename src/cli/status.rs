//! `pao-sim status`: progress, rate, time to go, attempts and failures.

use super::args::Common;
use super::error::{Exit, Failure};
use super::output::say;
use super::progress::duration;
use pao_sim::study::status::{AttemptStatus, Condition};
use pao_sim::study::{RegistrationKey, Snapshot, Status, StudyFolder, why};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Tell how far a study is.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The study's folder or its configuration file.
    study: PathBuf,
    /// List every failed registration with the command that repeats it.
    #[arg(long)]
    failures: bool,
    /// Tell again every so many seconds (10 by default) until the study is done or Ctrl-C.
    #[arg(long, value_name = "SECONDS", num_args = 0..=1, require_equals = true, default_missing_value = "10", value_parser = clap::value_parser!(u64).range(1..=86_400), conflicts_with = "why")]
    watch: Option<u64>,
    /// Tell what is known of one registration: phantom-1/left/f03/m07/i2/no_cuts_known/paper
    #[arg(long, value_name = "KEY")]
    why: Option<RegistrationKey>,
}

/// Attempts that are listed at most.
const LISTED: usize = 20;

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let folder = StudyFolder::find(&arguments.study, &common.results)?;
    if let Some(key) = &arguments.why {
        return tell_why(Snapshot::read(folder)?, key, common);
    }
    loop {
        let status = Status::of(&Snapshot::read(folder.clone())?);
        if common.json {
            let text = serde_json::to_string(&status);
            say!("{}", text.expect("a status is plain data"));
        } else {
            print(&status, arguments, folder.path());
        }
        match arguments.watch {
            Some(seconds) if status.done < status.planned => {
                std::thread::sleep(Duration::from_secs(seconds));
                if !common.json {
                    say!("");
                }
            }
            _ => return Ok(Exit::Complete),
        }
    }
}

fn tell_why(study: Snapshot, key: &RegistrationKey, common: &Common) -> Result<Exit, Failure> {
    if !study.plan.contains(key) {
        return Err(Failure::NotPlanned(key.to_string()));
    }
    let lines = why(&study, key);
    if common.json {
        say!(
            "{}",
            serde_json::json!({ "key": key.to_string(), "why": lines })
        );
    } else {
        say!("{key}");
        for line in lines {
            say!("  {line}");
        }
    }
    Ok(Exit::Complete)
}

fn print(status: &Status, arguments: &Arguments, folder: &Path) {
    let doing = if status.running {
        "running"
    } else {
        "not running"
    };
    say!(
        "study {}: {} of {} registrations, {} failed; {doing}, {} attempts",
        status.study,
        status.done,
        status.planned,
        status.failed,
        status.attempts
    );
    for cell in &status.cells {
        say!(
            "  {:<24}{:<16}{:>8} of {:<8}{:>6} failed",
            cell.scenario,
            cell.strategy,
            cell.done,
            cell.planned,
            cell.failed
        );
    }
    if status.repeated > 0 {
        say!(
            "{} rows were made twice, with equal results",
            status.repeated
        );
    }
    if let (Some(rate), Some(left)) = (status.rate_per_hour, status.remaining_seconds)
        && status.done < status.planned
    {
        say!(
            "{rate:.0} registrations an hour, {} to go at this rate",
            duration(left)
        );
    }
    for attempt in status.notable_attempts.iter().take(LISTED) {
        say!("  {}", described(attempt));
    }
    let more = status.notable_attempts.len().saturating_sub(LISTED);
    if more > 0 {
        say!("  and {more} more attempts that run or died (--json lists all)");
    }
    print_failures(status, arguments, folder);
}

fn described(attempt: &AttemptStatus) -> String {
    let silence = duration(attempt.silent_seconds as f64);
    let condition = match attempt.condition {
        Condition::Running => format!("running, wrote {silence} ago"),
        Condition::Stale => {
            format!("STALE: its process is there but has been silent for {silence}")
        }
        Condition::Ended => "ended".into(),
        Condition::Died => format!("died {silence} ago"),
    };
    let job = match attempt.slurm_job.as_str() {
        "" => String::new(),
        job => format!(", Slurm job {job}"),
    };
    format!(
        "attempt {} (share {}) on {}{job}: {condition}, {} rows",
        attempt.attempt, attempt.shard, attempt.host, attempt.rows
    )
}

fn print_failures(status: &Status, arguments: &Arguments, folder: &Path) {
    if arguments.failures {
        for failure in &status.failures {
            say!(
                "{}: {} in {}: {}",
                failure.key,
                failure.status,
                failure.phase,
                failure.message
            );
            say!("  pao-sim replay {} {}", folder.display(), failure.key);
        }
    } else if status.failed > 0 {
        let mut reasons: BTreeMap<(&str, &str, &str), usize> = BTreeMap::new();
        for failure in &status.failures {
            // A crash's message names its key; how it died is what counts.
            let message = failure.message.split("; to see why").next().unwrap_or("");
            *reasons
                .entry((&failure.status, &failure.phase, message))
                .or_default() += 1;
        }
        for ((status, phase, message), count) in reasons {
            say!("  {count} {status} in {phase}: {message}");
        }
        say!("--failures lists each with the command that repeats it");
    }
}

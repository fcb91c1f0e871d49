//! `pao-sim status`: progress, rate, time to go and failures.

use super::args::Common;
use super::error::{Exit, Failure};
use super::output::say;
use super::progress::duration;
use pao_sim::study::{Snapshot, Status, StudyFolder};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Tell how far a study is.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The study's folder or its configuration file.
    study: PathBuf,
    /// List every failed registration with the command that repeats it.
    #[arg(long)]
    failures: bool,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let folder = StudyFolder::find(&arguments.study, &common.results)?;
    let status = Status::of(&Snapshot::read(folder)?);
    if common.json {
        let text = serde_json::to_string(&status);
        say!("{}", text.expect("a status is plain data"));
        return Ok(Exit::Complete);
    }
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
    if let (Some(rate), Some(left)) = (status.rate_per_hour, status.remaining_seconds)
        && status.done < status.planned
    {
        say!(
            "{rate:.0} registrations an hour, {} to go at this rate",
            duration(left)
        );
    }
    if arguments.failures {
        for failure in &status.failures {
            let study = arguments.study.display();
            say!(
                "{}: {} in {}: {}",
                failure.key,
                failure.status,
                failure.phase,
                failure.message
            );
            say!("  pao-sim replay {study} {}", failure.key);
        }
    } else if status.failed > 0 {
        let mut reasons: BTreeMap<(&str, &str), usize> = BTreeMap::new();
        for failure in &status.failures {
            *reasons
                .entry((&failure.phase, &failure.message))
                .or_default() += 1;
        }
        for ((phase, message), count) in reasons {
            say!("  {count} failed in {phase}: {message}");
        }
        say!("--failures lists each with the command that repeats it");
    }
    Ok(Exit::Complete)
}

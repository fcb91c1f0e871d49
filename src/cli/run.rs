//! `pao-sim run`: runs a study, or continues it.

use super::args::Common;
use super::error::{Exit, Failure};
use super::output::say;
use super::progress::Progress;
use super::{logging, report, stop};
use pao_sim::study::{
    CaseWorker, Config, Ending, OpenOptions, Outcome, Redo, RunOptions, Snapshot, Study,
    StudyFolder,
};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Run a study, or continue it.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Configuration file.
    config: PathBuf,
    /// Threads; one a core by default, and before what the configuration says.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Stop in time to end within this: `90s`, `45m`, `11.5h` or plain seconds.
    #[arg(long, value_name = "TIME", value_parser = time)]
    time_limit: Option<Duration>,
    /// Do failed registrations again.
    #[arg(long)]
    retry_failed: bool,
    /// Accept that this configuration key, or `code`, differs from what the study was begun with.
    #[arg(long, value_name = "KEY")]
    accept: Vec<String>,
    /// Say what is left to do, and do nothing: no file is made or changed.
    #[arg(long)]
    dry_run: bool,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let begin = Instant::now();
    let config = Config::read(&arguments.config)?;
    let threads = match arguments.threads.unwrap_or(config.run.threads) {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    let open = OpenOptions {
        accept: arguments.accept.clone(),
    };
    let redo = if arguments.retry_failed {
        Redo::Failed
    } else {
        Redo::Nothing
    };
    if arguments.dry_run {
        let (planned, done) = Study::preview(&config, &common.results, &open, redo)?;
        tell_left(&config, planned, done, threads, common);
        return Ok(Exit::Complete);
    }
    let mut study = Study::open(config, &common.results, &open)?;
    logging::start(&study.folder.logs())?;
    let flag = stop::flag()?;
    let options = RunOptions {
        threads,
        cases_in_flight: study.config.run.cases_in_flight,
        stop: &flag,
        deadline: arguments.time_limit.map(|limit| begin + limit),
    };
    let worker = CaseWorker::new(&study.config);
    let (done, failed) = study.counted(redo);
    if !common.json {
        let (name, planned) = (&study.config.study.name, study.plan.len());
        eprintln!("study {name}: {done} of {planned} registrations are there; {threads} threads");
    }
    let progress = Progress::new(study.plan.len(), done, failed, common.json);
    let outcome = study.run(&worker, redo, &options, &|event| progress.on(event));
    progress.finish();
    let outcome = outcome?;
    let folder = study.folder.clone();
    // The report reads the journals as anybody else does.
    drop(study);
    let snapshot = Snapshot::read(folder)?;
    let groups = report::make(&snapshot)?;
    if !common.json {
        report::print(&groups);
    }
    tell(&snapshot, &outcome, common);
    Ok(match (outcome.ending, outcome.failed) {
        (Ending::Stopped, _) => Exit::Stopped,
        (Ending::Done, 0) => Exit::Complete,
        (Ending::Done, _) => Exit::FailedRows,
    })
}

/// What a run would do.
fn tell_left(config: &Config, planned: usize, done: usize, threads: usize, common: &Common) {
    let left = planned - done;
    if common.json {
        let line = serde_json::json!({ "planned": planned, "done": done, "left": left });
        say!("{line}");
    } else {
        let folder = StudyFolder::of(&common.results, &config.study.name);
        say!(
            "study {}: {left} of {planned} registrations are left; a run would do them with {threads} threads in {}",
            config.study.name,
            folder.path().display()
        );
    }
}

fn tell(study: &Snapshot, outcome: &Outcome, common: &Common) {
    if common.json {
        let Outcome {
            planned,
            done,
            failed,
            ..
        } = outcome;
        let stopped = outcome.ending == Ending::Stopped;
        let line = serde_json::json!({
            "planned": planned, "done": done, "failed": failed, "stopped": stopped,
        });
        say!("{line}");
        return;
    }
    eprintln!(
        "{} of {} registrations, {} failed: {}",
        outcome.done,
        outcome.planned,
        outcome.failed,
        study.folder.path().display()
    );
    if outcome.ending == Ending::Stopped {
        eprintln!("stopped before the end; the same command continues");
    }
}

/// Reads `90s`, `45m`, `11.5h` or plain seconds.
fn time(text: &str) -> Result<Duration, String> {
    let (number, unit) = match text.strip_suffix(['s', 'm', 'h']) {
        Some(number) => (number, &text[number.len()..]),
        None => (text, "s"),
    };
    let seconds = match unit {
        "h" => 3600.0,
        "m" => 60.0,
        _ => 1.0,
    };
    number
        .parse::<f64>()
        .ok()
        .and_then(|number| Duration::try_from_secs_f64(number * seconds).ok())
        .ok_or_else(|| "expected a time like 90s, 45m or 11.5h".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        let seconds = |text| time(text).map(|t| t.as_secs());
        assert_eq!(seconds("90s"), Ok(90));
        assert_eq!(seconds("45m"), Ok(2700));
        assert_eq!(seconds("1.5h"), Ok(5400));
        assert_eq!(seconds("30"), Ok(30));
        assert!(seconds("soon").is_err() && seconds("-3s").is_err());
    }
}

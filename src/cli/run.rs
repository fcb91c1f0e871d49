//! `pao-sim run`: runs a study, or continues it.

use super::args::Common;
use super::error::{Exit, Failure};
use super::isolated::OwnProcess;
use super::output::say;
use super::progress::Progress;
use super::{job_end, logging, report, stop};
use pao_sim::study::slurm::shell_words;
use pao_sim::study::{
    CaseWorker, Config, Counts, Ending, OpenOptions, Outcome, Redo, RunOptions, Shard, Snapshot,
    Stop, Study, StudyFolder, preview, throw_away,
};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Run a study, or continue it.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Configuration file.
    config: PathBuf,
    /// Do only the I-th of N equal shares (1/4 to 4/4); several processes may work on different shares
    /// at once, and N may be another one next time. A task of a Slurm array 0-(n-1) takes its own.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Threads; one a core by default, and before what the configuration says.
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Stop in time to end within this: `90s`, `45m`, `11.5h` or plain seconds. In a Slurm job its end is
    /// known without.
    #[arg(long, value_name = "TIME", value_parser = time)]
    time_limit: Option<Duration>,
    /// Do failed and crashed registrations again.
    #[arg(long)]
    retry_failed: bool,
    /// Accept that this configuration key, `specimen.NAME` or `code` differs from what the study was begun
    /// with.
    #[arg(long, value_name = "KEY")]
    accept: Vec<String>,
    /// Throw away what there is of the study and begin anew; where rows would be lost, with its name.
    #[arg(long, value_name = "NAME", num_args = 0..=1, require_equals = true, default_missing_value = "", conflicts_with_all = ["shard", "accept", "retry_failed"])]
    fresh: Option<String>,
    /// Say what is left to do, and do nothing: no file is made or changed.
    #[arg(long, conflicts_with = "fresh")]
    dry_run: bool,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let begin = Instant::now();
    let config = Config::read(&arguments.config)?;
    let threads = match arguments.threads.unwrap_or(config.run.threads) {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    };
    let variable = |name: &str| std::env::var(name).ok();
    let shard = match arguments.shard {
        Some(shard) => shard,
        None => Shard::of_slurm(&variable)
            .map_err(Failure::Usage)?
            .unwrap_or(Shard::WHOLE),
    };
    let open = OpenOptions {
        accept: arguments.accept.clone(),
        shard,
    };
    let redo = if arguments.retry_failed {
        Redo::Failed
    } else {
        Redo::Nothing
    };
    if arguments.dry_run {
        let counts = preview(&config, &common.results, &open, redo)?;
        tell_left(&config, shard, &counts, threads, common);
        return Ok(Exit::Complete);
    }
    let left = arguments.time_limit.into_iter().chain(job_end::time_left());
    let deadline = left.min().map(|left| begin + left);
    let stop = Arc::new(Stop::new(deadline));
    stop::on_signals(&stop)?;
    if let Some(name) = &arguments.fresh {
        throw_away(&config, &common.results, name)?;
    }
    let study = Study::open(config, &common.results, &open, threads)?;
    logging::start(&study.folder.logs(), study.attempt())?;
    let counts = study.counts(redo);
    let share = match shard.is_whole() {
        true => String::new(),
        false => format!("share {shard}, "),
    };
    if !common.json {
        let name = &study.config.study.name;
        let Counts { planned, done, .. } = counts;
        eprintln!(
            "study {name}: {share}{done} of {planned} registrations are there; attempt {}, {threads} threads",
            study.attempt()
        );
    }
    let progress = Progress::new(counts.planned, counts.done, counts.failed, common.json);
    let leave = |rows: usize| {
        progress.finish();
        tell_stopped(counts.done + rows, counts.planned, None, common);
        std::process::exit(Exit::Stopped as i32);
    };
    let options = RunOptions {
        threads,
        cases_in_flight: study.config.run.cases_in_flight,
        stop: &stop,
        leave: &leave,
    };
    let folder = study.folder.clone();
    let worker = CaseWorker::new(&study.config);
    let isolation = OwnProcess {
        study: folder.path().to_owned(),
    };
    let outcome = study.run(&worker, redo, &options, &isolation, &|event| {
        progress.on(event)
    });
    progress.finish();
    let outcome = outcome?;
    let whole = outcome
        .study
        .is_some_and(|study| study.done == study.planned);
    if shard.is_whole() || whole {
        // The report reads the records as anybody else does.
        pao_sim::fail_point!("report.begun");
        let groups = report::make(&Snapshot::read(folder.clone())?)?;
        if !common.json {
            report::print(&groups);
        }
    }
    tell(folder.path(), shard, &outcome, common);
    Ok(match (outcome.ending, outcome.share.failed) {
        (Ending::Stopped | Ending::Left, _) => Exit::Stopped,
        (Ending::Done, 0) => Exit::Complete,
        (Ending::Done, _) => Exit::FailedRows,
    })
}

/// What a run would do.
fn tell_left(config: &Config, shard: Shard, counts: &Counts, threads: usize, common: &Common) {
    let Counts { planned, done, .. } = *counts;
    let left = planned - done;
    if common.json {
        let line = serde_json::json!({ "planned": planned, "done": done, "left": left });
        say!("{line}");
    } else {
        let folder = StudyFolder::of(&common.results, &config.study.name);
        say!(
            "study {}, share {shard}: {left} of {planned} registrations are left; a run would do them with {threads} threads in {}",
            config.study.name,
            folder.path().display()
        );
    }
}

/// The last line of a run: how to see the results, or how to continue.
fn tell(folder: &Path, shard: Shard, outcome: &Outcome, common: &Common) {
    let Counts {
        planned,
        done,
        failed,
    } = outcome.share;
    if outcome.ending != Ending::Done {
        return tell_stopped(done, planned, Some(failed), common);
    }
    if common.json {
        return say!("{}", counts_line(done, planned, Some(failed), false));
    }
    let folder_name = folder.display();
    let failures = match failed {
        0 => String::new(),
        _ => format!(", {failed} failed (pao-sim status {folder_name} --failures)"),
    };
    match outcome.study {
        Some(study) if study.done == study.planned => {
            let report = folder.join("report/report.html");
            eprintln!(
                "complete: {} of {} registrations{failures}; the report is {}",
                study.done,
                study.planned,
                report.display()
            );
        }
        _ => {
            let (recorded, all) = outcome.recorded;
            eprintln!(
                "share {shard} is done: {done} of {planned} registrations{failures}; the whole study has {recorded} of {all}: pao-sim status {folder_name}"
            );
        }
    }
}

fn tell_stopped(done: usize, planned: usize, failed: Option<usize>, common: &Common) {
    if common.json {
        return say!("{}", counts_line(done, planned, failed, true));
    }
    let command = shell_words(std::env::args_os().map(|word| word.to_string_lossy().into_owned()));
    eprintln!("stopped: {done} of {planned} registrations are there; to continue: {command}");
}

fn counts_line(
    done: usize,
    planned: usize,
    failed: Option<usize>,
    stopped: bool,
) -> serde_json::Value {
    serde_json::json!({ "planned": planned, "done": done, "failed": failed, "stopped": stopped })
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

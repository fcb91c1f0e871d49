//! `pao-sim slurm`: a study's job scripts for Slurm, and their submission.

use super::args::Common;
use super::error::{Exit, Failure};
use super::output::say;
use pao_sim::study::slurm::{
    Installed, JobId, MAX_ARRAY_SIZE, Request, Submitted, WallTime, install, max_array_size,
    queued, shell_words, submit,
};
use pao_sim::study::{
    Config, OpenOptions, Plan, Redo, Shard, Snapshot, Status, StudyError, StudyFolder, preview,
};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Write the job scripts of a study for Slurm, and submit them.
///
/// A job array runs the study's shares, one a task, and a report job follows. The jobs run copies of
/// this program and of the configuration, kept in the study's folder. The same command with any number
/// of tasks continues what is left.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Configuration file.
    config: PathBuf,
    /// Tasks of the job array, each a share of the study's cases.
    #[arg(long, value_name = "N")]
    tasks: u32,
    /// Processors of a task.
    #[arg(long, value_name = "C", default_value_t = 1)]
    cpus: u32,
    /// Wall time of a task, as Slurm writes it or as 90s, 45m, 11.5h; the partition's default if not given.
    #[arg(long, value_name = "T")]
    time: Option<WallTime>,
    /// How long before its end a task is told to stop; written as --time.
    #[arg(long, value_name = "M", default_value = "120s")]
    margin: WallTime,
    /// Memory of a task, as 4G.
    #[arg(long, value_name = "M")]
    mem: Option<String>,
    /// Partition, as sbatch takes it.
    #[arg(long, value_name = "P")]
    partition: Option<String>,
    /// Account, as sbatch takes it.
    #[arg(long, value_name = "A")]
    account: Option<String>,
    /// Quality of service, as sbatch takes it.
    #[arg(long, value_name = "Q")]
    qos: Option<String>,
    /// Features of the nodes, as sbatch takes them.
    #[arg(long, value_name = "X")]
    constraint: Option<String>,
    /// Tasks that may run at the same time.
    #[arg(long, value_name = "K")]
    max_running: Option<u32>,
    /// Further options of sbatch, one line each time: --sbatch "--mail-type=END".
    #[arg(long, value_name = "LINE", allow_hyphen_values = true)]
    sbatch: Vec<String>,
    /// The cluster's MaxArraySize, where scontrol does not tell it; 1001 if neither does.
    #[arg(long, value_name = "S")]
    max_array_size: Option<u32>,
    /// Do failed registrations again.
    #[arg(long)]
    retry_failed: bool,
    /// Accept that this configuration key, or `code`, differs from what the study was begun with.
    #[arg(long, value_name = "KEY")]
    accept: Vec<String>,
    /// Submit the scripts.
    #[arg(long)]
    submit: bool,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let config = Config::read(&arguments.config)?;
    let request = arguments.request();
    request.check(Plan::of(&config).cases.len())?;
    let left = left(&config, arguments, common)?;
    let command = shell_words(std::env::args_os().map(|word| word.to_string_lossy().into_owned()));
    let installed = install(&config, &common.results, &request, &command)?;
    let submitted = if arguments.submit && left > 0 {
        warn_of(&waiting(&installed));
        Some(submit(&installed, &request)?)
    } else {
        None
    };
    if common.json {
        let (name, submitted) = (&config.study.name, submitted.as_ref());
        say!("{}", json(name, left, &installed, submitted));
    } else {
        tell(
            left,
            &request,
            &installed,
            submitted.as_ref(),
            arguments,
            common,
        );
    }
    Ok(Exit::Complete)
}

/// How many registrations are left. What every task would refuse is refused here.
fn left(config: &Config, arguments: &Arguments, common: &Common) -> Result<usize, Failure> {
    let open = OpenOptions {
        accept: arguments.accept.clone(),
        shard: Shard::WHOLE,
    };
    let redo = if arguments.retry_failed {
        Redo::Failed
    } else {
        Redo::Nothing
    };
    match preview(config, &common.results, &open, redo) {
        Ok(counts) => Ok(counts.planned - counts.done),
        // Tasks may be at work now and done when those of this submission start; and this machine need not
        // compute what they do.
        Err(StudyError::Busy { .. } | StudyError::Simd(_)) => {
            let folder = StudyFolder::of(&common.results, &config.study.name);
            let status = Status::of(&Snapshot::read(folder)?);
            let again = match redo {
                Redo::Failed => status.failed,
                Redo::Nothing => 0,
            };
            Ok(status.planned - status.done + again)
        }
        Err(error) => Err(error.into()),
    }
}

impl Arguments {
    fn request(&self) -> Request {
        let mut run = Vec::new();
        if self.retry_failed {
            run.push("--retry-failed".to_owned());
        }
        for key in &self.accept {
            run.extend(["--accept".to_owned(), key.clone()]);
        }
        Request {
            tasks: self.tasks,
            cpus: self.cpus,
            time: self.time,
            margin: self.margin,
            memory: self.mem.clone(),
            partition: self.partition.clone(),
            account: self.account.clone(),
            qos: self.qos.clone(),
            constraint: self.constraint.clone(),
            max_running: self.max_running,
            lines: self.sbatch.clone(),
            max_array_size: self
                .max_array_size
                .or_else(max_array_size)
                .unwrap_or(MAX_ARRAY_SIZE),
            run,
        }
    }
}

/// Jobs of an earlier submission of this study that are still in the queue.
fn waiting(installed: &Installed) -> Vec<JobId> {
    installed.report.parent().map(queued).unwrap_or_default()
}

fn warn_of(jobs: &[JobId]) {
    if !jobs.is_empty() {
        let ids: Vec<String> = jobs.iter().map(JobId::to_string).collect();
        let ids = ids.join(" ");
        eprintln!(
            "warning: jobs of this study are in the queue already ({ids}); a task that meets a share in work ends with an error and loses nothing (`scancel {ids}` takes the earlier ones out)"
        );
    }
}

fn json(
    study: &str,
    left: usize,
    installed: &Installed,
    submitted: Option<&Submitted>,
) -> serde_json::Value {
    let arrays = installed.arrays.iter().enumerate();
    let arrays: Vec<_> = arrays
        .map(|(number, (script, array))| {
            json!({
                "script": script,
                "first_share": array.first,
                "tasks": array.tasks,
                "job": submitted.map(|jobs| jobs.arrays[number].0),
            })
        })
        .collect();
    json!({
        "study": study,
        "left": left,
        "program": installed.program,
        "config": installed.config,
        "arrays": arrays,
        "report": {
            "script": installed.report,
            "job": submitted.map(|jobs| jobs.report.0),
        },
    })
}

fn tell(
    left: usize,
    request: &Request,
    installed: &Installed,
    submitted: Option<&Submitted>,
    arguments: &Arguments,
    common: &Common,
) {
    let folder = installed.report.parent().unwrap_or(&installed.report);
    let arrays = installed.arrays.len();
    say!(
        "{left} registrations are left for {} tasks in {arrays} job array{}; scripts in {}",
        request.tasks,
        if arrays == 1 { "" } else { "s" },
        folder.display()
    );
    match submitted {
        Some(jobs) => {
            let ids: Vec<String> = jobs.arrays.iter().map(JobId::to_string).collect();
            say!(
                "submitted {}, the report job {} follows; `{}` tells how far the study is, and this same command continues it",
                ids.join(", "),
                jobs.report,
                follow(&arguments.config, common)
            );
        }
        None if left == 0 => say!("nothing is left to do"),
        None => say!("the same command with --submit submits them"),
    }
}

/// The command that tells how far the study is.
fn follow(config: &Path, common: &Common) -> String {
    let mut words = vec!["pao-sim".to_owned()];
    if common.results != Path::new("results") {
        words.extend(["--results".to_owned(), common.results.display().to_string()]);
    }
    words.extend(["status".to_owned(), config.display().to_string()]);
    shell_words(words)
}

//! Registrations in a process of their own: both ends of it (`study::isolation` says why).

use super::args::Common;
use super::error::{Exit, Failure};
use pao_sim::store::journal::{StreamWriter, read_stream};
use pao_sim::store::{Record, StoreError};
use pao_sim::study::isolation::{Fate, Isolation};
use pao_sim::study::runner::run;
use pao_sim::study::{
    CaseWorker, Config, RegistrationKey, RunOptions, Stop, StudyError, StudyFolder, queue::CaseWork,
};
use std::io::{BufRead, Read, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Makes the registrations whose keys come on standard input, one a line and an empty one at the end, and
/// writes their records to standard output. Ends when standard input does, so that it never outlives
/// the run that began it.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The study's folder.
    study: PathBuf,
    #[arg(long)]
    threads: usize,
}

/// The inner process.
pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    // Ctrl-C reaches every process of a terminal; the outer one decides what it means.
    let ignored = Arc::new(AtomicBool::new(false));
    signal_hook::flag::register(signal_hook::consts::SIGINT, ignored).map_err(|cause| {
        Failure::Io {
            action: "catch SIGINT".into(),
            cause,
        }
    })?;
    let mut input = std::io::stdin().lock();
    let mut work: Vec<CaseWork> = Vec::new();
    for line in input.by_ref().lines() {
        let line = line.map_err(|cause| Failure::Io {
            action: "read the keys".into(),
            cause,
        })?;
        if line.is_empty() {
            break;
        }
        let key: RegistrationKey = line.parse()?;
        match work.last_mut() {
            Some(last) if last.case == key.case => last.registrations.push(key),
            _ => work.push(CaseWork {
                case: key.case.clone(),
                registrations: vec![key],
            }),
        }
    }
    drop(input);
    std::thread::spawn(|| {
        // Nothing more comes: this waits for the end.
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        std::process::exit(Exit::Stopped as i32);
    });
    let folder = StudyFolder::find(&arguments.study, &common.results)?;
    let attempts = folder.store().attempts().map_err(StudyError::Store)?;
    pao_sim::study::snapshot::select_simd(&attempts)?;
    let config = Config::read_as_named(&folder.config_file())?;
    let stop = Stop::new(None);
    let options = RunOptions {
        threads: arguments.threads.max(1),
        cases_in_flight: config.run.cases_in_flight,
        stop: &stop,
        leave: &|_| {},
    };
    let mut records = StreamWriter(std::io::stdout());
    let worker = CaseWorker::new(&config);
    run(&worker, work, 0, &mut records, &options, &|_| {})
        .map_err(|error| StudyError::Store(StoreError::Journal(error)))?;
    Ok(Exit::Complete)
}

/// Starts this program again for suspects.
#[derive(Debug)]
pub struct OwnProcess {
    pub study: PathBuf,
}

impl Isolation for OwnProcess {
    fn run(
        &self,
        keys: &[RegistrationKey],
        threads: usize,
        stop: &Stop,
        record: &mut dyn FnMut(Record),
    ) -> Result<Fate, String> {
        let mut child = self
            .start(keys, threads)
            .map_err(|error| error.to_string())?;
        let (input, output) = (child.stdin.take(), child.stdout.take());
        let over = AtomicBool::new(false);
        let read = std::thread::scope(|scope| {
            let over = &over;
            scope.spawn(move || {
                while !over.load(Ordering::Acquire) && !stop.forbids(Duration::ZERO) {
                    std::thread::sleep(Duration::from_millis(50));
                }
                // The process takes the end of its input as the word to leave.
                drop(input);
            });
            let read = output.map_or(Ok(()), |output| read_stream(output, record));
            over.store(true, Ordering::Release);
            read
        });
        let status = child.wait().map_err(|error| error.to_string())?;
        read.map_err(|error| format!("its records cannot be read: {error}"))?;
        match (status.code(), status.signal()) {
            (Some(0), _) => Ok(Fate::Ended),
            (Some(code), _) if code == Exit::Stopped as i32 => Ok(Fate::Dropped),
            (_, Some(signal)) => {
                let name = signal_hook::low_level::signal_name(signal);
                let name = name.map_or_else(|| format!("signal {signal}"), str::to_owned);
                Ok(Fate::Died(format!("killed by {name}")))
            }
            (code, _) => Err(format!("the process ended with code {code:?}")),
        }
    }
}

impl OwnProcess {
    fn start(&self, keys: &[RegistrationKey], threads: usize) -> std::io::Result<Child> {
        let mut child = Command::new(std::env::current_exe()?)
            .arg("isolated")
            .arg(&self.study)
            .args(["--threads", &threads.to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        if let Some(input) = child.stdin.as_mut() {
            let mut text: String = keys.iter().map(|key| format!("{key}\n")).collect();
            text.push('\n');
            // A process that died before it read them tells so by its end.
            let _ = input.write_all(text.as_bytes());
        }
        Ok(child)
    }
}

//! A study with its folder: opening, running, resuming.

use super::fingerprint::fingerprints;
use super::folder::{StudyError, StudyFolder, io};
use super::isolation::{Broken, Isolation, try_suspects};
use super::opening::{OpenOptions, check_free, examine};
use super::provenance::FORMAT;
use super::runner::{Ending, Event, RunOptions, peak_memory_bytes, run};
use super::snapshot::write_table;
use super::state::{Left, crashed_row};
use super::{Config, Plan, Provenance, Shard, State, Worker};
use crate::store::journal::Writer;
use crate::store::{Attempt, COMPLETE, End, Record, Row, durable};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A study of which this process has a share.
#[derive(Debug)]
pub struct Study {
    pub folder: StudyFolder,
    pub config: Config,
    pub plan: Plan,
    pub shard: Shard,
    /// What was done before this process.
    pub state: State,
    /// The journal of this attempt, which tells others that it lives.
    journal: Writer,
}

/// Which rows are made again although they are there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Redo {
    Nothing,
    /// Those that failed or crashed.
    Failed,
}

impl Redo {
    /// True when a row does not count as done.
    pub fn wants(self, row: &Row) -> bool {
        self == Self::Failed && row.text("status") != COMPLETE
    }
}

/// Numbers of registrations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    pub planned: usize,
    /// Of them, with a row.
    pub done: usize,
    /// Of those, failed or crashed.
    pub failed: usize,
}

/// What came of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outcome {
    pub ending: Ending,
    /// Of this process' share.
    pub share: Counts,
    /// Of the whole study; `None` for a share while rows of other shares are missing.
    pub study: Option<Counts>,
    /// Rows of all attempts that are over, and registrations of the whole study.
    pub recorded: (usize, usize),
}

/// How long a share that somebody has is waited for: a process that was killed a moment ago may not be
/// gone yet.
const GOING: Duration = Duration::from_millis(if cfg!(test) { 100 } else { 2000 });

/// Journals of dead attempts that one process seals while others wait for the lock.
const SEALED_AT_ONCE: usize = 64;

impl Study {
    /// Begins an attempt at the study of a configuration under `results`; the study is begun with it when
    /// it is not there. Fixes the process' level of vector instructions to that of the study.
    ///
    /// # Errors
    /// When the folder cannot be used, a living process has a part of the share, a specimen's file cannot
    /// be read, or the study was begun with another configuration, other data or another program and
    /// that was not accepted.
    pub fn open(
        config: Config,
        results: &Path,
        options: &OpenOptions,
        threads: usize,
    ) -> Result<Self, StudyError> {
        let folder = StudyFolder::of(results, &config.study.name);
        for path in [folder.path().to_owned(), folder.logs()] {
            std::fs::create_dir_all(&path).map_err(io("create", &path))?;
        }
        // Before others have to wait: the files of specimens are large.
        let specimens = fingerprints(&config.population)?;
        let plan = Plan::of(&config);
        let begin = Instant::now();
        let (lock, attempts, accepted) = loop {
            let lock = folder.lock()?;
            crate::fail_point!("open.locked");
            let (attempts, accepted) = examine(&folder, &config, &specimens, options)?;
            match check_free(&folder, &config, &plan, options.shard, &attempts) {
                Ok(()) => break (lock, attempts, accepted),
                Err(StudyError::Busy { .. }) if begin.elapsed() < GOING => drop(lock),
                Err(error) => return Err(error),
            }
            std::thread::sleep(Duration::from_millis(50));
        };
        let store = folder.store();
        store.seal_dead(SEALED_AT_ONCE)?;
        store.merge()?;
        durable::remove_temporary_files(folder.path()).map_err(io("clean", folder.path()))?;
        let text = config.to_toml();
        let file = folder.config_file();
        if std::fs::read_to_string(&file).ok().as_ref() != Some(&text) {
            folder.write(&file, &text)?;
        }
        let next = attempts.last().map_or(1, |last| last.attempt + 1);
        let provenance = Provenance {
            accepted,
            ..Provenance::now(&config, specimens, threads)
        };
        let provenance = serde_json::to_value(provenance).expect("provenance is plain data");
        let journal = Writer::create(&folder.journals(), next, options.shard.parts(), provenance)?;
        crate::fail_point!("open.journal_made");
        write_manifest(&folder, &config, &store.attempts()?)?;
        // From here on the journal keeps others off the share, and whoever had it before is over.
        drop(lock);
        let mut state = State::of(store.read()?)?;
        state.keep_only(&plan, options.shard);
        for (path, bytes) in &state.torn {
            tracing::warn!(
                "{}: {bytes} bytes at its end could not be read; what they held is done again",
                path.display()
            );
        }
        Ok(Self {
            folder,
            config,
            plan,
            shard: options.shard,
            state,
            journal,
        })
    }

    /// The number of this attempt, from 1.
    pub fn attempt(&self) -> u32 {
        self.journal.attempt()
    }

    /// Does what is left of the share, seals the attempt, and writes the table when the whole study is
    /// this process' or complete. Running again continues.
    ///
    /// # Errors
    /// When the journal or the table cannot be written; committed rows stay.
    pub fn run<W: Worker>(
        mut self,
        worker: &W,
        redo: Redo,
        options: &RunOptions,
        isolation: &dyn Isolation,
        events: &(dyn Fn(Event) + Sync),
    ) -> Result<Outcome, StudyError> {
        let left = self
            .state
            .left(&self.plan, self.shard, |row| redo.wants(row));
        let shard = self.shard;
        let committed = Mutex::new(Vec::new());
        let keep = |event: Event| {
            // The rows of a whole study are read back at the end anyway.
            if let Event::Row(row) = event
                && !shard.is_whole()
            {
                let mut rows = committed.lock().unwrap_or_else(PoisonError::into_inner);
                rows.push(row.clone());
            }
            events(event);
        };
        let ending = self.work(worker, left, options, isolation, &keep)?;
        if ending != Ending::Left {
            self.journal.append(&Record::Ended(End {
                left: false,
                peak_memory_bytes: peak_memory_bytes(),
            }))?;
        }
        self.journal.sync()?;
        crate::fail_point!("run.ended");
        let Self {
            folder,
            config,
            plan,
            mut state,
            journal,
            ..
        } = self;
        let lock = folder.lock()?;
        let (path, store) = (journal.path().to_owned(), folder.store());
        drop(journal);
        store.seal(&path)?;
        store.merge()?;
        let attempts = store.attempts()?;
        write_manifest(&folder, &config, &attempts)?;
        let recorded: usize = attempts.iter().map(|a| a.rows).sum();
        // Reading every row is worth it only when the study may be complete.
        let study = if shard.is_whole() || recorded >= plan.len() {
            state = State::of(store.read()?)?;
            let study = counts(&plan, &state, Shard::WHOLE);
            if shard.is_whole() || study.done == study.planned {
                write_table(&folder, &plan, &state)?;
            }
            Some(study)
        } else {
            for row in committed
                .into_inner()
                .unwrap_or_else(PoisonError::into_inner)
            {
                state.insert(row);
            }
            None
        };
        drop(lock);
        Ok(Outcome {
            ending,
            share: counts(&plan, &state, shard),
            study,
            recorded: (recorded, plan.len()),
        })
    }

    fn work<W: Worker>(
        &mut self,
        worker: &W,
        left: Left,
        options: &RunOptions,
        isolation: &dyn Isolation,
        events: &(dyn Fn(Event) + Sync),
    ) -> Result<Ending, StudyError> {
        let attempt = self.journal.attempt();
        let journal = &mut self.journal;
        let mut commit = |record: Record| {
            let record = match record {
                Record::Row(mut row) => {
                    row.set("attempt", attempt);
                    Record::Row(row)
                }
                other => other,
            };
            journal.append(&record)?;
            if let Record::Row(row) = &record {
                events(Event::Row(row));
            }
            Ok(())
        };
        for row in left.crashed {
            commit(Record::Row(Box::new(row)))?;
        }
        let mut others = left.others;
        if !left.suspects.is_empty() {
            let verdict = try_suspects(
                isolation,
                left.suspects,
                options.threads,
                options.stop,
                &mut commit,
            )
            .map_err(|broken| match broken {
                Broken::Journal(error) => StudyError::Journal(error),
                Broken::Process(problem) => StudyError::Isolation(problem),
            })?;
            for (case, how) in &verdict.crashed_cases {
                for work in others.iter().filter(|work| work.case == *case) {
                    for key in &work.registrations {
                        commit(Record::Row(Box::new(crashed_row(key, true, how))))?;
                    }
                }
                others.retain(|work| work.case != *case);
            }
            if verdict.stopped {
                return Ok(Ending::Stopped);
            }
        }
        if options.stop.forbids(Duration::ZERO) && !others.is_empty() {
            return Ok(Ending::Stopped);
        }
        Ok(run(
            worker,
            others,
            attempt,
            &mut self.journal,
            options,
            events,
        )?)
    }

    /// The registrations of this process' share, and how many of them count as done.
    pub fn counts(&self, redo: Redo) -> Counts {
        counts_with(&self.plan, &self.state, self.shard, redo)
    }
}

/// How many registrations a share has, and how many of them would count as done if the study were opened
/// now. Makes, changes and claims nothing.
///
/// # Errors
/// As [`Study::open`].
pub fn preview(
    config: &Config,
    results: &Path,
    options: &OpenOptions,
    redo: Redo,
) -> Result<Counts, StudyError> {
    let folder = StudyFolder::of(results, &config.study.name);
    let specimens = fingerprints(&config.population)?;
    let (attempts, _) = examine(&folder, config, &specimens, options)?;
    let plan = Plan::of(config);
    check_free(&folder, config, &plan, options.shard, &attempts)?;
    let state = State::of(folder.store().read()?)?;
    Ok(counts_with(&plan, &state, options.shard, redo))
}

/// Throws a study away: all that is in its folder. `name` must be the study's name when rows would be
/// lost, so that nobody does it by a slip.
///
/// # Errors
/// When rows would be lost and the name is not given, when a process works on the study, or the
/// folder cannot be removed.
pub fn throw_away(config: &Config, results: &Path, name: &str) -> Result<(), StudyError> {
    let folder = StudyFolder::of(results, &config.study.name);
    if !folder.path().is_dir() {
        return Ok(());
    }
    let lock = folder.lock()?;
    let attempts = folder.store().attempts()?;
    check_free(&folder, config, &Plan::of(config), Shard::WHOLE, &attempts)?;
    // What is damaged, in conflict or foreign may be thrown away too.
    let rows = folder.store().read().map_or(0, |ledger| ledger.rows.len());
    if rows > 0 && name != config.study.name {
        return Err(StudyError::Guarded {
            path: folder.path().to_owned(),
            name: config.study.name.clone(),
            rows,
            attempts: attempts.len(),
        });
    }
    // In one step, so that a half removed study is never taken for a whole one.
    let gone = results.join(format!(
        ".thrown-away-{}-{}",
        config.study.name,
        std::process::id()
    ));
    std::fs::rename(folder.path(), &gone).map_err(io("move away", folder.path()))?;
    drop(lock);
    std::fs::remove_dir_all(&gone).map_err(io("remove", &gone))
}

fn counts(plan: &Plan, state: &State, shard: Shard) -> Counts {
    counts_with(plan, state, shard, Redo::Nothing)
}

fn counts_with(plan: &Plan, state: &State, shard: Shard, redo: Redo) -> Counts {
    let rows = || state.rows_of(plan, shard).filter(|row| !redo.wants(row));
    Counts {
        planned: shard.cases(plan).count() * plan.registrations_per_case(),
        done: rows().count(),
        failed: rows().filter(|row| row.text("status") != COMPLETE).count(),
    }
}

/// `manifest.json`: the provenance of every attempt, from their records.
fn write_manifest(
    folder: &StudyFolder,
    config: &Config,
    attempts: &[Attempt],
) -> Result<(), StudyError> {
    let attempts: Vec<Value> = attempts
        .iter()
        .map(|attempt| {
            let shard = Shard::new(attempt.share.0, attempt.share.1);
            json!({
                "attempt": attempt.attempt,
                "shard": shard.map(|shard| shard.to_string()),
                "provenance": attempt.provenance,
                "running": attempt.alive,
                "rows": (!attempt.alive).then_some(attempt.rows),
                "ended_in_order": attempt.end.is_some(),
                "peak_memory_bytes": attempt.end.as_ref().and_then(|end| end.peak_memory_bytes),
                "unreadable_bytes": attempt.unreadable_bytes,
            })
        })
        .collect();
    let manifest = json!({
        "format": FORMAT,
        "study": config.study.name,
        "attempts": attempts,
    });
    let text = serde_json::to_string_pretty(&manifest).expect("JSON is text") + "\n";
    folder.write(&folder.manifest(), &text)
}

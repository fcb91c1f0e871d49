//! Runs what is left of a study.

use super::queue::{CaseWork, Queue, Task};
use super::worker::{Failure, Worker};
use super::{CaseKey, RegistrationKey};
use crate::store::journal::Writer;
use crate::store::{COMPLETE, FAILED, JournalError, Record, Row};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How a run is done. Nothing here changes a result.
#[derive(Clone, Copy, Debug)]
pub struct RunOptions<'a> {
    /// Threads, at least 1.
    pub threads: usize,
    /// Cases that may be held at once; 0 takes as many as keep the threads busy.
    pub cases_in_flight: usize,
    /// Set from outside to end the run softly: what runs is finished, nothing new is begun.
    pub stop: &'a AtomicBool,
    /// Ends the run softly in time: nothing is begun that would not be done by then, going by the
    /// longest so far.
    pub deadline: Option<Instant>,
}

/// What a run tells while it goes on.
#[derive(Clone, Copy, Debug)]
pub enum Event<'a> {
    /// A row was committed.
    Row(&'a Row),
    /// A case was simulated, in these seconds.
    Simulated(&'a CaseKey, f64),
    /// A while has passed.
    Tick,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// All that was given was done.
    Done,
    /// It was stopped before.
    Stopped,
}

/// Does the work and commits each row to the journal as it finishes.
///
/// # Errors
/// When the journal cannot be written; what was committed before stays.
pub fn run<W: Worker>(
    worker: &W,
    work: Vec<CaseWork>,
    journal: &mut Writer,
    options: &RunOptions,
    events: &(dyn Fn(Event) + Sync),
) -> Result<Ending, JournalError> {
    let registrations: usize = work.iter().map(|case| case.registrations.len()).sum();
    let largest = work.iter().map(|case| case.registrations.len()).max();
    let workers = options.threads.min(registrations).max(1);
    let limit = match options.cases_in_flight {
        0 => workers.div_ceil(largest.unwrap_or(1).max(1)) + 1,
        limit => limit,
    };
    let run = Run {
        worker,
        queue: Queue::new(work, limit),
        attempt: journal.attempt(),
        journal: Mutex::new(journal),
        broken: Mutex::new(None),
        longest: Mutex::new(Duration::ZERO),
        options,
        events,
    };
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers)
            .map(|index| {
                let run = &run;
                // A task's own parallel loops use what the other tasks leave.
                let share =
                    options.threads / workers + usize::from(index < options.threads % workers);
                scope.spawn(move || run.work(share.max(1)))
            })
            .collect();
        let ticker = scope.spawn(|| {
            while !done.load(Ordering::Acquire) {
                std::thread::park_timeout(Duration::from_millis(500));
                run.tick();
            }
        });
        for thread in threads {
            if let Err(panic) = thread.join() {
                run.queue.close();
                std::panic::resume_unwind(panic);
            }
        }
        done.store(true, Ordering::Release);
        ticker.thread().unpark();
    });
    let done = run.queue.is_done();
    let Run {
        journal, broken, ..
    } = run;
    if let Some(error) = broken.into_inner().unwrap_or_else(PoisonError::into_inner) {
        return Err(error);
    }
    let journal = journal.into_inner().unwrap_or_else(PoisonError::into_inner);
    journal.sync()?;
    Ok(if done { Ending::Done } else { Ending::Stopped })
}

struct Run<'a, W: Worker> {
    worker: &'a W,
    /// Cases with the seconds that their simulation took.
    queue: Queue<(W::Case, f64)>,
    attempt: u32,
    journal: Mutex<&'a mut Writer>,
    /// The journal's first error.
    broken: Mutex<Option<JournalError>>,
    /// The longest task so far.
    longest: Mutex<Duration>,
    options: &'a RunOptions<'a>,
    events: &'a (dyn Fn(Event) + Sync),
}

impl<W: Worker> Run<'_, W> {
    /// One thread's work until there is no more.
    fn work(&self, threads: usize) {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("the system gives a thread");
        while !self.must_stop()
            && let Some(task) = self.queue.next()
        {
            let begin = Instant::now();
            pool.install(|| self.execute(task));
            let mut longest = self.longest.lock().unwrap_or_else(PoisonError::into_inner);
            *longest = (*longest).max(begin.elapsed());
        }
    }

    fn execute(&self, task: Task<(W::Case, f64)>) {
        match task {
            Task::Simulate(work) => self.simulate(work),
            Task::Register(case, key) => {
                self.register(&case, &key);
                drop(case);
                self.queue.registered(&key);
            }
        }
    }

    fn simulate(&self, work: CaseWork) {
        let begin = Instant::now();
        let name = work.case.to_string();
        self.append(&Record::Started(name.clone()));
        let case = guarded(|| self.worker.simulate(&work.case));
        self.append(&Record::Finished(name));
        let seconds = begin.elapsed().as_secs_f64();
        match case {
            Ok(case) => {
                (self.events)(Event::Simulated(&work.case, seconds));
                self.queue.simulated(work, Some((case, seconds)));
            }
            Err(failure) => {
                for key in &work.registrations {
                    self.commit(key.row(), Err(failure.clone()), 0.0, seconds);
                }
                self.queue.simulated(work, None);
            }
        }
    }

    fn register(&self, (case, simulation_seconds): &(W::Case, f64), key: &RegistrationKey) {
        let begin = Instant::now();
        self.append(&Record::Started(key.to_string()));
        let mut row = key.row();
        let result = guarded(|| self.worker.register(case, key, &mut row));
        let seconds = begin.elapsed().as_secs_f64();
        self.commit(row, result, seconds, *simulation_seconds);
    }

    fn commit(
        &self,
        mut row: Row,
        result: Result<(), Failure>,
        seconds: f64,
        simulation_seconds: f64,
    ) {
        match result {
            Ok(()) => row.set("status", COMPLETE),
            Err(failure) => {
                row.set("status", FAILED);
                row.set("phase", failure.phase);
                row.set("message", failure.message);
            }
        }
        row.set("registration_seconds", seconds);
        row.set("simulation_seconds", simulation_seconds);
        row.set("attempt", self.attempt);
        let record = Record::Row(Box::new(row));
        self.append(&record);
        if let Record::Row(row) = &record {
            (self.events)(Event::Row(row));
        }
    }

    fn append(&self, record: &Record) {
        let mut journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        let result = journal.append(record);
        self.note(result);
    }

    fn tick(&self) {
        let mut journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        let result = journal.sync_if_due();
        drop(journal);
        self.note(result);
        if self.must_stop() {
            self.queue.close();
        }
        (self.events)(Event::Tick);
    }

    /// Without a journal there is no use in going on.
    fn note(&self, result: Result<(), JournalError>) {
        if let Err(error) = result {
            let mut broken = self.broken.lock().unwrap_or_else(PoisonError::into_inner);
            broken.get_or_insert(error);
            self.queue.close();
        }
    }

    fn must_stop(&self) -> bool {
        let longest = *self.longest.lock().unwrap_or_else(PoisonError::into_inner);
        let too_late = |deadline: Instant| Instant::now() + longest > deadline;
        self.options.stop.load(Ordering::Relaxed) || self.options.deadline.is_some_and(too_late)
    }
}

/// A panic of the work is a failure of that one row.
fn guarded<T>(work: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let text = panic
            .downcast_ref::<String>()
            .map(String::as_str)
            .or_else(|| panic.downcast_ref::<&str>().copied())
            .unwrap_or("without a message");
        let message = format!("the program met a case that it does not know: {text}");
        Err(Failure::new("panic", message))
    })
}

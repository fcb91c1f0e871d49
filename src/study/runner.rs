//! Runs what is left of a study.

use super::queue::{CaseWork, Queue, Task};
use super::worker::{Failure, Worker};
use super::{CaseKey, RegistrationKey, Stop};
use crate::store::journal::Sink;
use crate::store::{COMPLETE, End, FAILED, JournalError, Record, Row};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How a run is done. Nothing here changes a result.
#[derive(Clone, Copy)]
pub struct RunOptions<'a> {
    /// Threads, at least 1.
    pub threads: usize,
    /// Cases that may be held at once; 0 takes as many as keep the threads busy.
    pub cases_in_flight: usize,
    /// Ends the run softly: what runs is finished, or dropped when time is up; nothing is begun that
    /// would not be done in time, going by the longest so far.
    pub stop: &'a Stop,
    /// Called once, with the number of committed rows so far, after the journal was told that
    /// work is dropped. It should end the process: threads that compute cannot be interrupted.
    pub leave: &'a (dyn Fn(usize) + Sync),
}

impl std::fmt::Debug for RunOptions<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RunOptions")
            .field("threads", &self.threads)
            .field("cases_in_flight", &self.cases_in_flight)
            .finish_non_exhaustive()
    }
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
    /// It was stopped before; whatever had begun was finished.
    Stopped,
    /// Time was up: work that had begun was dropped.
    Left,
}

/// Does the work and commits each row to the journal as it finishes. Rows get the number `attempt`.
///
/// # Errors
/// When the journal cannot be written; what was committed before stays.
pub fn run<W: Worker>(
    worker: &W,
    work: Vec<CaseWork>,
    attempt: u32,
    journal: &mut dyn Sink,
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
        attempt,
        journal: Mutex::new(Some(journal)),
        rows: AtomicUsize::new(0),
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
                std::thread::park_timeout(Duration::from_millis(100));
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
    let left = journal
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner)
        .is_none();
    Ok(match (left, done) {
        (true, _) => Ending::Left,
        (false, true) => Ending::Done,
        (false, false) => Ending::Stopped,
    })
}

struct Run<'a, W: Worker> {
    worker: &'a W,
    /// Cases with the seconds that their simulation took.
    queue: Queue<(W::Case, f64)>,
    attempt: u32,
    /// None once the run was left: what ends after that is dropped.
    journal: Mutex<Option<&'a mut dyn Sink>>,
    /// Rows that were committed.
    rows: AtomicUsize,
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
        crate::fail_point!("run.row_made");
        let record = Record::Row(Box::new(row));
        if self.append(&record)
            && let Record::Row(row) = &record
        {
            crate::fail_point!("run.row_written");
            self.rows.fetch_add(1, Ordering::SeqCst);
            (self.events)(Event::Row(row));
        }
    }

    /// True when the record was taken.
    fn append(&self, record: &Record) -> bool {
        let mut journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(journal) = journal.as_mut() else {
            return false;
        };
        let result = journal.append(record);
        let taken = result.is_ok();
        self.note(result);
        taken
    }

    fn tick(&self) {
        let mut journal = self.journal.lock().unwrap_or_else(PoisonError::into_inner);
        let over = self.options.stop.is_over();
        let result = match journal.as_mut() {
            Some(journal) if over => journal.append(&Record::Ended(End {
                left: true,
                peak_memory_bytes: peak_memory_bytes(),
            })),
            Some(journal) => journal.sync_if_due(),
            None => Ok(()),
        };
        let leaving = over && journal.take().is_some();
        drop(journal);
        self.note(result);
        if self.must_stop() {
            self.queue.close();
        }
        if leaving {
            (self.options.leave)(self.rows.load(Ordering::SeqCst));
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
        self.options.stop.forbids(longest)
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

/// The most memory that this process held at once, where the system tells.
pub fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kibibytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024 * kibibytes)
}

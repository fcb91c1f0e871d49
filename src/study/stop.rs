//! The wish to stop, and the time there is for it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long before the deadline work that still runs is dropped: enough to tell the journal.
pub const LEAVING: Duration = Duration::from_secs(4);

/// Asked from outside while a run goes on: by signals, by a deadline.
#[derive(Debug, Default)]
pub struct Stop {
    softly: AtomicBool,
    at_once: AtomicBool,
    deadline: Mutex<Option<Instant>>,
}

impl Stop {
    /// Nobody has asked.
    pub fn new(deadline: Option<Instant>) -> Self {
        Self {
            deadline: Mutex::new(deadline),
            ..Self::default()
        }
    }

    /// Nothing new is to be begun; what runs may end.
    pub fn ask(&self) {
        self.softly.store(true, Ordering::SeqCst);
    }

    /// As [`Self::ask`], and what runs after that time is dropped.
    pub fn ask_within(&self, time: Duration) {
        self.ask();
        let by = Instant::now() + time;
        let mut deadline = self.lock();
        *deadline = Some(deadline.map_or(by, |before| before.min(by)));
    }

    /// What runs is dropped now.
    pub fn leave(&self) {
        self.ask();
        self.at_once.store(true, Ordering::SeqCst);
    }

    /// True when nothing that takes `time` is to be begun any more.
    pub fn forbids(&self, time: Duration) -> bool {
        let late = |deadline: Instant| Instant::now() + time + LEAVING > deadline;
        self.softly.load(Ordering::SeqCst) || self.lock().is_some_and(late)
    }

    /// True when what runs is to be dropped.
    pub fn is_over(&self) -> bool {
        let over = |deadline: Instant| Instant::now() + LEAVING >= deadline;
        self.at_once.load(Ordering::SeqCst) || self.lock().is_some_and(over)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Instant>> {
        self.deadline.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deadline_forbids_what_would_not_end_before_it() {
        let minute = Duration::from_secs(60);
        let stop = Stop::new(Some(Instant::now() + minute));
        assert!(!stop.forbids(minute / 2) && !stop.is_over());
        assert!(stop.forbids(minute));
        stop.ask_within(LEAVING);
        assert!(stop.forbids(Duration::ZERO) && stop.is_over());
        // An earlier deadline is not moved back.
        stop.ask_within(minute);
        assert!(stop.is_over());
    }

    #[test]
    fn asking_drops_nothing_and_leaving_does() {
        let stop = Stop::new(None);
        assert!(!stop.forbids(Duration::from_secs(1 << 20)));
        stop.ask();
        assert!(stop.forbids(Duration::ZERO) && !stop.is_over());
        stop.leave();
        assert!(stop.is_over());
    }
}

//! Hands out the work of a study so that threads stay busy and few cases are held at once.

use super::{CaseKey, RegistrationKey};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// A case and those of its registrations that are still to be made.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseWork {
    pub case: CaseKey,
    pub registrations: Vec<RegistrationKey>,
}

/// What a thread is to do next.
#[derive(Debug)]
pub enum Task<C> {
    /// Simulate a case; then call [`Queue::simulated`].
    Simulate(CaseWork),
    /// Make one registration of a simulated case; then call [`Queue::registered`].
    Register(Arc<C>, RegistrationKey),
}

/// The work that is left. Registrations of cases that are already simulated come first, oldest case
/// first, so that a case is dropped as early as possible.
#[derive(Debug)]
pub struct Queue<C> {
    state: Mutex<State<C>>,
    changed: Condvar,
    limit: usize,
}

#[derive(Debug)]
struct State<C> {
    waiting: VecDeque<CaseWork>,
    live: VecDeque<Live<C>>,
    /// Cases that are being simulated.
    simulating: usize,
    /// Nothing new is handed out any more.
    closed: bool,
}

impl<C> State<C> {
    fn is_done(&self) -> bool {
        self.waiting.is_empty() && self.simulating == 0 && self.live.is_empty()
    }
}

#[derive(Debug)]
struct Live<C> {
    case: Arc<C>,
    key: CaseKey,
    left: VecDeque<RegistrationKey>,
    running: usize,
}

impl<C> Queue<C> {
    /// A queue of cases in their order, of which at most `limit` are held at once.
    ///
    /// # Panics
    /// When `limit` is 0.
    pub fn new(work: impl IntoIterator<Item = CaseWork>, limit: usize) -> Self {
        assert!(limit > 0, "at least one case must fit");
        Self {
            state: Mutex::new(State {
                waiting: work.into_iter().collect(),
                live: VecDeque::new(),
                simulating: 0,
                closed: false,
            }),
            changed: Condvar::new(),
            limit,
        }
    }

    /// The next task, waiting for one if others may still bring some; `None` when there is no more.
    pub fn next(&self) -> Option<Task<C>> {
        let mut state = self.lock();
        loop {
            if state.closed {
                return None;
            }
            if let Some(live) = state.live.iter_mut().find(|live| !live.left.is_empty())
                && let Some(key) = live.left.pop_front()
            {
                live.running += 1;
                return Some(Task::Register(live.case.clone(), key));
            }
            if state.simulating + state.live.len() < self.limit
                && let Some(work) = state.waiting.pop_front()
            {
                state.simulating += 1;
                return Some(Task::Simulate(work));
            }
            if state.is_done() {
                return None;
            }
            state = self
                .changed
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// A case was simulated, or could not be (`None`): its registrations are then not handed out.
    pub fn simulated(&self, work: CaseWork, case: Option<C>) {
        let mut state = self.lock();
        state.simulating -= 1;
        if let Some(case) = case
            && !work.registrations.is_empty()
        {
            state.live.push_back(Live {
                case: Arc::new(case),
                key: work.case,
                left: work.registrations.into(),
                running: 0,
            });
        }
        self.changed.notify_all();
    }

    /// A registration was made. The case is dropped with its last one.
    pub fn registered(&self, key: &RegistrationKey) {
        let mut state = self.lock();
        if let Some(place) = state.live.iter().position(|live| live.key == key.case) {
            state.live[place].running -= 1;
            if state.live[place].running == 0 && state.live[place].left.is_empty() {
                state.live.remove(place);
            }
        }
        self.changed.notify_all();
    }

    /// True when everything that was given has been done.
    pub fn is_done(&self) -> bool {
        self.lock().is_done()
    }

    /// Hands out nothing more.
    pub fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// The state. A thread that panicked while it held the lock has changed one field at most, and
    /// the run ends with that panic anyway.
    fn lock(&self) -> MutexGuard<'_, State<C>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn work(movement: u32, registrations: u32) -> CaseWork {
        let case: CaseKey = format!("phantom-1/left/f00/m{movement:02}")
            .parse()
            .unwrap();
        let key = |i| format!("{case}/i{i}/no_cuts_known/paper").parse().unwrap();
        CaseWork {
            registrations: (0..registrations).map(key).collect(),
            case,
        }
    }

    fn simulate(queue: &Queue<u32>) -> CaseWork {
        match queue.next() {
            Some(Task::Simulate(work)) => work,
            other => panic!("expected a simulation, not {other:?}"),
        }
    }

    fn register(queue: &Queue<u32>) -> RegistrationKey {
        match queue.next() {
            Some(Task::Register(_, key)) => key,
            other => panic!("expected a registration, not {other:?}"),
        }
    }

    #[test]
    fn simulated_cases_are_registered_before_others_are_simulated() {
        let queue = Queue::new([work(0, 2), work(1, 1)], 2);
        let first = simulate(&queue);
        queue.simulated(first, Some(0));
        let (a, b) = (register(&queue), register(&queue));
        assert_eq!((a.initialization, b.initialization), (0, 1));
        let second = simulate(&queue);
        assert_eq!(second.case.movement, 1);
        queue.simulated(second, Some(1));
        let c = register(&queue);
        for key in [a, b, c] {
            queue.registered(&key);
        }
        assert!(queue.next().is_none());
        assert!(queue.is_done());
    }

    #[test]
    fn no_more_cases_than_the_limit_are_held() {
        let queue = Queue::new([work(0, 1), work(1, 1)], 1);
        let first = simulate(&queue);
        queue.simulated(first, Some(0));
        let key = register(&queue);
        std::thread::scope(|scope| {
            let waiter = scope.spawn(|| simulate(&queue));
            // The second case may only begin once the first one's registration is done.
            std::thread::yield_now();
            assert!(!waiter.is_finished());
            queue.registered(&key);
            assert_eq!(waiter.join().unwrap().case.movement, 1);
        });
    }

    #[test]
    fn a_case_that_failed_or_a_closed_queue_gives_nothing() {
        let queue = Queue::new([work(0, 3), work(1, 1)], 1);
        let first = simulate(&queue);
        queue.simulated(first, None);
        assert_eq!(simulate(&queue).case.movement, 1);
        queue.close();
        assert!(queue.next().is_none());
        assert!(!queue.is_done(), "the second case was never registered");
    }
}

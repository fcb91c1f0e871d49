//! Values that many tasks need and that are made once.

use super::Failure;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// The most recently used values by key. Each is made by the first task that asks for it, while the
/// others wait; a value that was pushed out lives on as long as somebody uses it.
#[derive(Debug)]
pub struct Shared<K, V> {
    /// Oldest use first.
    cells: Mutex<Vec<(K, Cell<V>)>>,
    capacity: usize,
}

type Cell<V> = Arc<OnceLock<Result<Arc<V>, Failure>>>;

impl<K: PartialEq + Clone, V> Shared<K, V> {
    /// Keeps at most `capacity` values.
    pub fn new(capacity: usize) -> Self {
        Self {
            cells: Mutex::new(Vec::new()),
            capacity,
        }
    }

    /// The value of a key, made by `make` when it is not kept.
    ///
    /// # Errors
    /// The failure of `make`, for everyone who asks for this key.
    pub fn get(
        &self,
        key: &K,
        make: impl FnOnce() -> Result<V, Failure>,
    ) -> Result<Arc<V>, Failure> {
        // Made outside of the lock, so that different keys are made at the same time.
        self.cell(key).get_or_init(|| make().map(Arc::new)).clone()
    }

    fn cell(&self, key: &K) -> Cell<V> {
        // Every step below leaves the list whole, so a panic elsewhere does not matter.
        let mut cells = self.cells.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = match cells.iter().position(|(kept, _)| kept == key) {
            Some(place) => cells.remove(place),
            None => (key.clone(), Cell::default()),
        };
        let cell = entry.1.clone();
        cells.push(entry);
        if cells.len() > self.capacity {
            cells.remove(0);
        }
        cell
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell as Count;

    #[test]
    fn a_value_is_made_once_while_it_is_kept() {
        let shared = Shared::new(2);
        let made = Count::new(0);
        let get = |key: u32| {
            let make = || {
                made.set(made.get() + 1);
                Ok(10 * key)
            };
            *shared.get(&key, make).unwrap()
        };
        assert_eq!((get(1), get(2), get(1), made.get()), (10, 20, 10, 2));
        // 2 was used longest ago, so 3 pushes it out.
        assert_eq!((get(3), get(1), made.get()), (30, 10, 3));
        assert_eq!((get(2), made.get()), (20, 4));
    }

    #[test]
    fn a_failure_is_everyones() {
        let shared: Shared<u32, u32> = Shared::new(2);
        let failure = Failure::new("phantom", "no bone");
        assert_eq!(
            shared.get(&1, || Err(failure.clone())),
            Err(failure.clone())
        );
        assert_eq!(shared.get(&1, || Ok(3)), Err(failure));
    }
}

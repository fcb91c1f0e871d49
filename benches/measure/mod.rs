//! Time on a shared machine, which only ever makes things slower: processor time, and minima.

/// Processor time of this thread, which other processes on a shared machine add little to.
pub fn thread_seconds() -> f64 {
    let mut time = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: the call writes to the structure that it is given.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    assert_eq!(
        status, 0,
        "the system has no clock of a thread's processor time"
    );
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// A number from the environment, or the default.
pub fn setting(name: &str, default: usize) -> usize {
    let value = std::env::var(name).ok();
    value.and_then(|v| v.parse().ok()).unwrap_or(default)
}

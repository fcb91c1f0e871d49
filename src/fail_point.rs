//! Named places at which tests end the process, as a kill or a lost machine would.
//!
//! `PAO_SIM_FAIL_POINT=seal.before_removal:2` kills the process when it passes that place for the second
//! time. Only in builds with the feature `fail-points`, which is never a default; elsewhere the
//! places are nothing.

/// A named place.
#[macro_export]
#[doc(hidden)]
macro_rules! fail_point {
    ($name:literal) => {
        #[cfg(feature = "fail-points")]
        $crate::fail_point::pass($name);
    };
}

/// Every place that has a name.
#[cfg(feature = "fail-points")]
pub const NAMES: [&str; 12] = [
    "open.locked",
    "open.journal_made",
    "run.row_made",
    "run.row_written",
    "journal.half_written",
    "run.ended",
    "seal.before_removal",
    "merge.before_removal",
    "write.begun",
    "write.before_rename",
    "write.after_rename",
    "report.begun",
];

/// Ends the process at once when this is the place and the time that the environment names.
#[cfg(feature = "fail-points")]
#[doc(hidden)]
pub fn pass(name: &str) {
    use std::sync::atomic::{AtomicU32, Ordering};
    static LEFT: AtomicU32 = AtomicU32::new(u32::MAX);
    debug_assert!(NAMES.contains(&name), "{name} is not listed");
    let Ok(wanted) = std::env::var("PAO_SIM_FAIL_POINT") else {
        return;
    };
    let (place, time) = wanted.split_once(':').unwrap_or((&wanted, "1"));
    if place != name {
        return;
    }
    let time: u32 = time.parse().expect("PAO_SIM_FAIL_POINT is PLACE:TIME");
    let _ = LEFT.compare_exchange(u32::MAX, time, Ordering::SeqCst, Ordering::SeqCst);
    if LEFT.fetch_sub(1, Ordering::SeqCst) == 1 {
        kill();
    }
}

/// Ends the process in the way of a crash when the environment names this registration
/// (`PAO_SIM_ABORT_AT`).
#[cfg(feature = "fail-points")]
pub(crate) fn abort_at(key: &str) {
    if std::env::var("PAO_SIM_ABORT_AT").is_ok_and(|wanted| wanted == key) {
        std::process::abort();
    }
}

/// As `kill -9` does: nothing is flushed, dropped or told.
#[cfg(feature = "fail-points")]
fn kill() -> ! {
    let own = std::process::id().to_string();
    let _ = std::process::Command::new("kill")
        .args(["-9", &own])
        .status();
    std::process::abort()
}

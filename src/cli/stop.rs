//! Soft stop by signal.

use super::error::{Exit, Failure};
use pao_sim::study::Stop;
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1};
use signal_hook::iterator::Signals;
use std::sync::Arc;
use std::time::Duration;

/// How long after SIGTERM work may go on: Slurm kills 30 s after it.
const AFTER_TERM: Duration = Duration::from_secs(25);
/// How long a run has to tell its journal that it leaves, before the process ends anyway.
const AT_ONCE: Duration = Duration::from_secs(1);

/// Lets signals stop the run. The first Ctrl-C or SIGUSR1: what runs is finished, if the deadline allows.
/// SIGTERM: what is not finished in 25 s is dropped. The second of any of them: the process
/// leaves at once. Committed rows survive all of this.
///
/// # Errors
/// When the system refuses a handler.
pub fn on_signals(stop: &Arc<Stop>) -> Result<(), Failure> {
    let mut signals = Signals::new([SIGINT, SIGTERM, SIGUSR1]).map_err(|cause| Failure::Io {
        action: "catch signals".into(),
        cause,
    })?;
    let stop = stop.clone();
    std::thread::spawn(move || {
        let mut signals = signals.forever();
        match signals.next() {
            Some(SIGTERM) => {
                eprintln!(
                    "SIGTERM: what is not finished in {} s is dropped",
                    AFTER_TERM.as_secs()
                );
                stop.ask_within(AFTER_TERM + pao_sim::study::stop::LEAVING);
            }
            Some(signal) => {
                let name = signal_hook::low_level::signal_name(signal).unwrap_or("signal");
                eprintln!("{name}: finishing what runs; once more leaves at once");
                stop.ask();
            }
            None => return,
        }
        if signals.next().is_some() {
            stop.leave();
            std::thread::sleep(AT_ONCE);
            std::process::exit(Exit::Stopped as i32);
        }
    });
    Ok(())
}

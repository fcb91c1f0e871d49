//! Soft stop by signal.

use super::error::Failure;
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A flag that Ctrl-C, SIGTERM and SIGUSR1 set. A second signal ends the process at once; committed
/// rows survive that too.
///
/// # Errors
/// When the system refuses a handler.
pub fn flag() -> Result<Arc<AtomicBool>, Failure> {
    let flag = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGUSR1] {
        // In this order: the second signal finds the flag set by the first.
        let exit = super::error::Exit::Stopped as i32;
        let ending = signal_hook::flag::register_conditional_shutdown(signal, exit, flag.clone());
        let setting = ending.and_then(|_| signal_hook::flag::register(signal, flag.clone()));
        setting.map_err(|cause| Failure::Io {
            action: format!("catch signal {signal}"),
            cause,
        })?;
    }
    Ok(flag)
}

//! Printing to whoever may have stopped reading.

use std::io::Write;

/// Prints a line to standard output. That nobody reads any more (`pao-sim ... | head`) is no reason to
/// stop: a run goes on, and `println!` would panic.
macro_rules! say {
    ($($text:tt)*) => {
        $crate::cli::output::line(format_args!($($text)*))
    };
}
pub(super) use say;

/// Prints a line to standard output, if somebody reads it.
pub fn line(text: std::fmt::Arguments) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

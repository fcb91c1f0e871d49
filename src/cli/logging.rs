//! Logs: everything to a file of the study, warnings to standard error too.

use super::error::Failure;
use std::fs::OpenOptions;
use std::path::Path;
use std::sync::Mutex;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::prelude::*;

/// Opens the log file of an attempt in `folder` (`0007.log`), and sends warnings to standard error.
/// Panics are logged too, with the place where they happened: the row that failed by one holds its
/// message only.
///
/// # Errors
/// When the file cannot be made.
pub fn start(folder: &Path, attempt: u32) -> Result<(), Failure> {
    let path = folder.join(format!("{attempt:04}.log"));
    let file = OpenOptions::new().create(true).append(true).open(&path);
    let file = file.map_err(|cause| Failure::Io {
        action: format!("write the log {}", path.display()),
        cause,
    })?;
    let to_file = tracing_subscriber::fmt::layer()
        .with_writer(Mutex::new(file))
        .with_ansi(false)
        .with_filter(LevelFilter::INFO);
    let to_terminal = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(colours())
        .with_target(false)
        .without_time()
        .with_filter(LevelFilter::WARN);
    // A second call in one process would keep the first one's file.
    let _ = tracing_subscriber::registry()
        .with(to_file)
        .with(to_terminal)
        .try_init();
    std::panic::set_hook(Box::new(|panic| {
        let trace = std::backtrace::Backtrace::force_capture();
        tracing::error!("{panic}");
        tracing::info!("{trace}");
    }));
    Ok(())
}

/// Colours are for terminals whose user has not asked for none (no-color.org).
fn colours() -> bool {
    use std::io::IsTerminal;
    let unwanted = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    !unwanted && std::io::stderr().is_terminal()
}

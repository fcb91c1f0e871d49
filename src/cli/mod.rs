//! The command line: one file a subcommand. Each parses, calls the library and prints.

mod args;
mod error;
mod isolated;
mod job_end;
mod logging;
mod output;
mod plan;
mod progress;
mod replay;
mod report;
mod run;
mod show;
mod slurm;
mod specimen;
mod status;
mod stop;

pub use args::main;

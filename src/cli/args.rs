//! The arguments, and which subcommand they go to.

use super::error::{Exit, Failure};
use super::{isolated, plan, replay, report, run, show, slurm, specimen, status};
use clap::{Parser, Subcommand};
use std::path::PathBuf;
use std::process::ExitCode;

/// Simulation studies of X-ray navigation for periacetabular osteotomy.
#[derive(Debug, Parser)]
#[command(name = "pao-sim", version, after_help = EXIT_CODES)]
struct Arguments {
    #[command(flatten)]
    common: Common,
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "\
Exit codes: 0 complete, 1 error, 2 usage or configuration, 3 complete with failed rows, 75 stopped early and
resumable (the same command continues). NO_COLOR switches colours off.";

/// What every subcommand knows.
#[derive(Debug, clap::Args)]
pub struct Common {
    /// Folder of all studies' results.
    #[arg(long, global = true, value_name = "DIR", default_value = "results")]
    pub results: PathBuf,
    /// Print for machines: JSON, one object a line.
    #[arg(long, global = true)]
    pub json: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a study, or continue it.
    Run(run::Arguments),
    /// Count what a study consists of, before anything runs.
    Plan(plan::Arguments),
    /// Write the job scripts of a study for Slurm, and submit them.
    Slurm(slurm::Arguments),
    /// Tell how far a study is.
    Status(status::Arguments),
    /// Write the tables and figures of whatever is there.
    Report(report::Arguments),
    /// Make one registration again and compare it with its row.
    Replay(replay::Arguments),
    /// Draw a case, or what a registration made of it.
    Show(show::Arguments),
    /// Make, show and check specimens.
    Specimen(specimen::Arguments),
    #[command(hide = true)]
    Isolated(isolated::Arguments),
}

/// Parses the command line and does what it says.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let common = &arguments.common;
    let result = match &arguments.command {
        Command::Run(own) => run::main(own, common),
        Command::Plan(own) => plan::main(own, common),
        Command::Slurm(own) => slurm::main(own, common),
        Command::Status(own) => status::main(own, common),
        Command::Report(own) => report::main(own, common),
        Command::Replay(own) => replay::main(own, common),
        Command::Show(own) => show::main(own, common),
        Command::Specimen(own) => specimen::main(own, common),
        Command::Isolated(own) => isolated::main(own, common),
    };
    match result {
        Ok(exit) => exit.into(),
        Err(failure) => failure.report(common.json).into(),
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

impl Failure {
    /// Prints the failure to standard error and gives its exit code.
    fn report(&self, json: bool) -> Exit {
        if json {
            eprintln!("{}", serde_json::json!({ "error": self.to_string() }));
        } else {
            eprintln!("error: {self}");
            if self.is_full_disk() {
                eprintln!(
                    "free some space and run the same command again: what was committed is safe"
                );
            }
        }
        self.exit()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }
}

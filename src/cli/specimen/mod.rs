//! `pao-sim specimen`: making, showing and checking specimens.

mod import;
mod source;

use super::args::Common;
use super::error::{Exit, Failure};
use clap::Subcommand;

/// Make, show and check specimens.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make a specimen's folder from other data.
    #[command(subcommand)]
    Import(import::From),
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    match &arguments.command {
        Command::Import(from) => import::main(from, common),
    }
}

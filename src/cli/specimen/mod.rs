//! `pao-sim specimen`: making, showing and checking specimens.

mod check;
mod import;
mod landmarks;
mod show;
mod source;

use super::args::Common;
use super::error::{Exit, Failure};
use clap::Subcommand;
use std::path::Path;

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
    /// Draw a specimen: radiograph, landmarks, rims, planned cuts and fragments.
    Show(show::Arguments),
    /// Write a specimen's landmarks and rims for 3D Slicer, to be corrected there.
    Landmarks(landmarks::Arguments),
    /// Prove on a specimen's own data that its sides, frames and units are right.
    Check(check::Arguments),
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    match &arguments.command {
        Command::Import(from) => import::main(from, common),
        Command::Show(own) => show::main(own, common),
        Command::Landmarks(own) => landmarks::main(own, common),
        Command::Check(own) => check::main(own, common),
    }
}

/// Refuses a file that is named otherwise than what is written to it: programs tell by its name what a file is.
fn check_ending(flag: &str, path: &Path, ending: &str) -> Result<(), Failure> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    match name.strip_suffix(ending) {
        Some(stem) if !stem.is_empty() => Ok(()),
        _ => Err(Failure::Usage(format!(
            "{flag} is {}; expected a name that ends with {ending}",
            path.display()
        ))),
    }
}

//! `pao-sim specimen landmarks`: a specimen's landmarks for 3D Slicer.

use super::check_ending;
use super::source::Source;
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::output::say;
use pao_sim::anatomy::Side;
use pao_sim::anatomy::landmark_files::write_markups;
use serde_json::json;
use std::path::PathBuf;

/// Write a specimen's landmarks and rims as a file that 3D Slicer opens, to be corrected there by hand.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    source: Source,
    /// The file, named .mrk.json; it must not be there yet
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let out = &arguments.out;
    check_ending("--out", out, ".mrk.json")?;
    let specimen = arguments.source.specimen()?;
    write_markups(
        &specimen.landmarks,
        Side::BOTH.map(|side| specimen.rim(side)),
        out,
    )?;
    let landmarks = specimen.landmarks.iter().count();
    if common.json {
        say!(
            "{}",
            json!({"specimen": specimen.name, "file": out, "landmarks": landmarks})
        );
    } else {
        say!("{}: {landmarks} landmarks and both rims", out.display());
    }
    Ok(Exit::Complete)
}

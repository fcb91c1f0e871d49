//! From the DeepFluoro data set.

use super::common::{Known, Read, Target};
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use pao_sim::anatomy::import::deepfluoro::{DEEPFLUORO_LICENCE, read_deepfluoro};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// ipcai_2020_full_res_data.h5, or a file of its layout
    file: PathBuf,
    /// The specimen, 17-1882 for instance; without it the file's only one
    #[arg(long, value_name = "ID")]
    specimen: Option<String>,
    #[command(flatten)]
    target: Target,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    arguments.target.check()?;
    let found = read_deepfluoro(&arguments.file, arguments.specimen.as_deref())?;
    let known = Known {
        kind: "deepfluoro",
        sex: "unknown".into(),
        licence: DEEPFLUORO_LICENCE.into(),
        from: format!(
            "specimen {} of the DeepFluoro data set (Grupp et al. 2020, doi 10.7281/T1/IFSXNV)",
            found.id
        ),
    };
    let read = Read {
        ct: found.ct,
        structures: found.structures,
        landmarks: found.landmarks,
        notes: found.notes,
    };
    arguments.target.finish(read, known, common)
}

//! From a CT and TotalSegmentator's masks.

use super::common::{Ct, Known, Read, Target};
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use pao_sim::anatomy::Landmarks;
use pao_sim::anatomy::import::totalseg::{TotalsegVersion, read_totalseg};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    ct: Ct,
    /// Folder of masks (hip_left.nii.gz and so on), or the file of all structures
    segmentation: PathBuf,
    /// Class map of a file that does not name its values: that of version 1 or 2 (and later)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=2))]
    version: Option<u8>,
    #[command(flatten)]
    target: Target,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    arguments.target.check()?;
    let version = arguments.version.and_then(|number| {
        let mut all = TotalsegVersion::ALL.into_iter();
        all.find(|version| version.number() == number)
    });
    let (structures, notes) = read_totalseg(&arguments.segmentation, version)?;
    let read = Read {
        ct: arguments.ct.read()?,
        structures,
        landmarks: Landmarks::default(),
        notes,
    };
    let known = Known {
        kind: "totalseg",
        sex: "unknown".into(),
        licence: "not stated".into(),
        from: format!("{}, segmented by TotalSegmentator", arguments.ct.name()),
    };
    arguments.target.finish(read, known, common)
}

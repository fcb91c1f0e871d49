//! From a subject of the VSD collection.

use super::common::{Known, Read, Target, folder_name};
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use pao_sim::anatomy::Landmarks;
use pao_sim::anatomy::import::vsd::{VSD_LICENCE, VsdFiles, find_vsd, read_vsd};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The subject's folder
    #[arg(required_unless_present_all = ["ct", "segmentation"])]
    dir: Option<PathBuf>,
    /// The CT, where it is not to be sought in the folder
    #[arg(long, value_name = "FILE", requires = "segmentation")]
    ct: Option<PathBuf>,
    /// Its segmentation by 3D Slicer (.seg.nrrd)
    #[arg(long, value_name = "FILE", requires = "ct")]
    segmentation: Option<PathBuf>,
    #[command(flatten)]
    target: Target,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    arguments.target.check()?;
    let (files, subject) = match (&arguments.ct, &arguments.segmentation, &arguments.dir) {
        (Some(ct), Some(segmentation), _) => {
            let files = VsdFiles {
                ct: ct.clone(),
                segmentation: segmentation.clone(),
                sex: "unknown".into(),
            };
            (files, folder_name(ct))
        }
        (_, _, Some(dir)) => (find_vsd(dir)?, folder_name(dir)),
        _ => return Err(Failure::Usage("name a subject's folder".into())),
    };
    let found = read_vsd(&files)?;
    let known = Known {
        kind: "vsd",
        sex: files.sex,
        licence: VSD_LICENCE.into(),
        from: format!(
            "{subject} of VSDFullBodyBoneReconstruction (Fischer 2023, doi 10.5281/zenodo.8302448)"
        ),
    };
    let read = Read {
        ct: found.ct,
        structures: found.structures,
        landmarks: Landmarks::default(),
        notes: found.notes,
    };
    arguments.target.finish(read, known, common)
}

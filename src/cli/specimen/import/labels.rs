//! From a CT, a label map and its table or the names of its segments.

use super::common::{Ct, Known, Read, Target, folder_name};
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use pao_sim::anatomy::Landmarks;
use pao_sim::anatomy::import::labels::{
    label_table_of_segments, read_label_table, structures_of_labels,
};
use pao_sim::volume::read_volume;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    ct: Ct,
    /// The label map (NIfTI, NRRD, MetaImage), on the CT's grid or another one of the same world
    labels: PathBuf,
    /// Which value is which bone: CSV with the columns value,structure, where structures are sacrum,
    /// hip_left, hip_right, femur_left, femur_right, or hips, pelvis and femora for several at once;
    /// or a colour table of 3D Slicer, or a label description of ITK-SNAP. Without it the map must be a
    /// segmentation by 3D Slicer (.seg.nrrd), whose segments are named like Hip_L or left femur
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    #[command(flatten)]
    target: Target,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    arguments.target.check()?;
    let table = match &arguments.table {
        Some(table) => read_label_table(table)?,
        None => label_table_of_segments(&arguments.labels)?,
    };
    let (structures, notes) = structures_of_labels(&read_volume(&arguments.labels)?, &table)?;
    let read = Read {
        ct: arguments.ct.read()?,
        structures,
        landmarks: Landmarks::default(),
        notes,
    };
    let known = Known {
        kind: "labels",
        sex: "unknown".into(),
        licence: "not stated".into(),
        from: format!(
            "{} and {}",
            arguments.ct.name(),
            folder_name(&arguments.labels)
        ),
    };
    arguments.target.finish(read, known, common)
}

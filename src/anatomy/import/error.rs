//! Why a CT and its segmentation could not be made a specimen.

use crate::anatomy::Structure;
use crate::anatomy::detect::Unfound;
use crate::volume::VolumeFileError;
use std::path::PathBuf;

/// Why a CT and its segmentation could not be made a specimen.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CtImportError {
    #[error(transparent)]
    Volume(#[from] VolumeFileError),
    #[error("cannot read {path}: {source}")]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{path}: {reason}")]
    File { path: PathBuf, reason: String },
    #[error("voxel_mm is {0}; expected 0.4 to 3")]
    VoxelSize(f64),
    #[error("the segmentation has no voxel of the {}", list(.0))]
    Absent(Vec<Structure>),
    #[error(
        "only {percent:.0} % of the {structure} lie in the CT; CT ({ct}) and segmentation ({labels}) do not belong together, or one of them lost its place"
    )]
    Apart {
        structure: Structure,
        percent: f64,
        ct: String,
        labels: String,
    },
    #[error(
        "the left {what} lies {apart_mm:.0} mm to the right of the right one (along LPS x): left and right of the segmentation are swapped, or the header's orientation is wrong"
    )]
    SidesSwapped { what: &'static str, apart_mm: f64 },
    #[error(
        "cannot find the landmarks on the segmentation. Neither found nor given are:\n{0}\nLook at the segmentation there; or place these in 3D Slicer, in the file of all others that --draft-landmarks FILE.mrk.json writes, and give them by --landmarks FILE (docs/formats.md, Points)"
    )]
    Landmarks(#[from] Box<Unfound>),
    #[error("{0}")]
    Labels(String),
}

fn list(structures: &[Structure]) -> String {
    let names: Vec<String> = structures.iter().map(ToString::to_string).collect();
    names.join(", ")
}

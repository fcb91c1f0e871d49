//! What an import met and a user should know.

use crate::anatomy::Structure;

/// Something that was done or found and that a user should know; nothing is wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Note {
    #[error(
        "the CT's voxels of {from} were resampled to {voxel_mm} mm along the world's axes{}",
        if *.thick { "; so thick ones lose thin bone and close the joint space, which no resampling brings back" } else { "" }
    )]
    Resampled {
        /// Size of the CT's voxels.
        from: String,
        voxel_mm: f64,
        /// Thicker than a study should be made of.
        thick: bool,
    },
    #[error("the segmentation lies on another grid than the CT and was resampled to it")]
    LabelsResampled,
    #[error("{percent:.1} % of the {structure} lie outside the CT and are lost")]
    Outside { structure: Structure, percent: f64 },
    #[error(
        "{voxels} voxels of the {structure} in {pieces} pieces beside the largest were dropped"
    )]
    Dropped {
        structure: Structure,
        voxels: usize,
        pieces: usize,
    },
    #[error("{voxels} voxels enclosed by the {structure} were added to it")]
    Filled { structure: Structure, voxels: usize },
    #[error("{voxels} voxels belong to both {first} and {second}; the {first} has them")]
    Overlap {
        first: Structure,
        second: Structure,
        voxels: usize,
    },
    #[error(
        "the {structure} ends {found_mm:.0} mm below its head; a study wants 150 mm, and its shaft will be missing in images that show more"
    )]
    ShortFemur { structure: Structure, found_mm: f64 },
    #[error("not found by rule: {names} ({reason}); what was given is taken")]
    NotDetected { names: String, reason: String },
    #[error("taken from the landmark file: {0}")]
    Overridden(String),
    #[error("{0}")]
    Reader(String),
}

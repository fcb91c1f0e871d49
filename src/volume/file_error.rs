//! What can be wrong with a file that holds a volume.

use super::dicom::DicomProblem;
use super::voxel::VoxelProblem;
use std::path::PathBuf;

/// Why a volume could not be read from a file or written to one. Every message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeFileError {
    #[error("cannot {doing} {path}: {source}")]
    Io {
        doing: &'static str,
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{path} is not a {format}: {reason}")]
    Format {
        path: PathBuf,
        /// What it was read as, `NIfTI-1 file (.nii or .nii.gz)` for instance.
        format: &'static str,
        reason: String,
    },
    #[error(
        "{path} has the dimensions {dims:?}; expected three of more than one voxel each (and only 1 in any further one)"
    )]
    Dimensions { path: PathBuf, dims: Vec<i64> },
    #[error("{path} says that it has {dims:?} voxels, more than any file holds")]
    TooLarge { path: PathBuf, dims: [usize; 3] },
    #[error("{path} holds values of {found}; expected integers or floats of 8 to 64 bits")]
    DataType {
        path: PathBuf,
        /// The type as its format names it, `NIfTI datatype 128` for instance.
        found: String,
    },
    #[error("{path} does not say where its voxels lie: {reason}")]
    Place { path: PathBuf, reason: String },
    #[error("{path} states its lengths in {found}; expected millimetres")]
    Unit { path: PathBuf, found: String },
    #[error(
        "{path} ends too early: {found} bytes of voxel values, {expected} expected; copy it again"
    )]
    Truncated {
        path: PathBuf,
        found: u64,
        expected: u64,
    },
    #[error("voxel {voxel:?} of {path} is {value}; {problem}")]
    Value {
        path: PathBuf,
        voxel: [usize; 3],
        value: f64,
        problem: VoxelProblem,
    },
    #[error("{path} {problem}")]
    Dicom {
        /// The file, or the folder of the series.
        path: PathBuf,
        problem: Box<DicomProblem>,
    },
    #[error("cannot write {path}: {reason}")]
    Unwritable { path: PathBuf, reason: String },
}

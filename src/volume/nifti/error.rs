//! What can be wrong with a NIfTI file.

use super::voxel::VoxelProblem;
use std::path::PathBuf;

/// Why a NIfTI file could not be read or written. Every message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NiftiFileError {
    #[error("cannot {doing} {path}: {source}")]
    Io {
        doing: &'static str,
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{path} is not a NIfTI-1 file (.nii or .nii.gz): {reason}")]
    NotNifti { path: PathBuf, reason: String },
    #[error(
        "{path} has the dimensions {dims:?}; expected three of more than one voxel each (and only 1 in any further one)"
    )]
    Dimensions { path: PathBuf, dims: Vec<i16> },
    #[error(
        "{path} holds values of NIfTI datatype {code}; expected integers or floats of 8 to 64 bits"
    )]
    DataType { path: PathBuf, code: i16 },
    #[error(
        "{path} does not say where its voxels lie: {reason}; set a valid sform or qform in RAS mm"
    )]
    Affine { path: PathBuf, reason: String },
    #[error("{path} states its lengths in NIfTI unit code {code}; expected millimetres (2)")]
    Unit { path: PathBuf, code: u8 },
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
    #[error("cannot write {path}: {reason}")]
    Unwritable { path: PathBuf, reason: String },
}

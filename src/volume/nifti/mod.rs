//! Volumes as NIfTI-1 files (`.nii`, `.nii.gz`).
//!
//! A NIfTI world is RAS, ours is LPS: x and y change their sign here, in both directions, and
//! nowhere else.

mod affine;
mod extensions;
mod read;
mod voxel;
mod write;

pub use extensions::{NiftiExtension, read_nifti_extensions};
pub(super) use read::is_nifti;
pub use read::read_nifti;
pub use voxel::NiftiVoxel;
pub use write::write_nifti;

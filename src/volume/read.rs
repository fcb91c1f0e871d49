//! Reading a volume in whatever format it has.

use super::{Volume, VolumeFileError, Voxel, read_nifti};
use std::path::Path;

/// Reads a volume. Stand-in until the other formats are joined.
///
/// # Errors
/// As [`read_nifti`].
pub fn read_volume<T: Voxel>(path: &Path) -> Result<Volume<T>, VolumeFileError> {
    read_nifti(path)
}

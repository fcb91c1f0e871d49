//! TotalSegmentator's segmentations: a folder with one mask a structure, or one file of all.

mod class_map;
mod label_names;
mod masks;
mod multi_label;
#[cfg(test)]
mod tests;

pub use class_map::TotalsegVersion;

use super::error::CtImportError;
use super::note::Note;
use crate::anatomy::StructureLabels;
use std::path::Path;

/// Reads the bones of a segmentation: a folder of masks (`hip_left.nii.gz` and so on) or a
/// multi-label file. `version` is that of the class map, for a file that does not hold its classes'
/// names and whose values do not tell.
///
/// # Errors
/// When files are missing or unreadable, or values and version contradict each other.
pub fn read_totalseg(
    path: &Path,
    version: Option<TotalsegVersion>,
) -> Result<(StructureLabels, Vec<Note>), CtImportError> {
    match path.is_dir() {
        true => masks::read(path),
        false => multi_label::read(path, version),
    }
}

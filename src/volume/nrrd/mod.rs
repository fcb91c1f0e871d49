//! Volumes as NRRD files (`.nrrd`, and `.nhdr` with its data file), Slicer's segmentations
//! (`.seg.nrrd`) included.
//!
//! The header names its world: LPS is ours, of RAS x and y change their sign, of LAS y, here and
//! nowhere else. A header that names no such world is refused, since sides are never guessed.

mod axes;
mod header;
mod read;
mod segmentation;
mod segments;

pub use read::read_nrrd;
pub(crate) use segmentation::Segmentation;
pub use segmentation::nrrd_segment_names;

/// What a file is read as, for messages.
const FORMAT: &str = "NRRD file (.nrrd or .nhdr)";

/// What every file starts with; a digit follows.
pub(super) const START: &[u8] = b"NRRD000";

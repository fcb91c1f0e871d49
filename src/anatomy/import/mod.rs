//! Specimens from a CT and a segmentation of it.
//!
//! Each kind of data is read by a file of its own to a CT and [`StructureLabels`](super::StructureLabels);
//! [`specimen_from_ct`] makes a specimen of them, the same way for all.

mod bone_surfaces;
mod clean;
pub mod deepfluoro;
mod error;
mod grid;
pub mod labels;
mod masks;
mod names;
mod note;
mod origin;
mod parameters;
mod specimen;
#[cfg(test)]
mod tests;
pub mod totalseg;
pub mod vsd;

pub use error::CtImportError;
pub use names::LabelMeaning;
pub use note::Note;
pub use origin::CtOrigin;
pub use parameters::CtImportParameters;
pub(in crate::anatomy) use specimen::told;
pub use specimen::{CtImport, Imported, specimen_from_ct};

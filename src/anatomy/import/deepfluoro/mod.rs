//! The DeepFluoro data set (Grupp et al. 2020, doi 10.7281/T1/IFSXNV): CT, segmentation and landmarks
//! of six cadavers in one HDF5 file of full resolution.
//!
//! ```text
//! proj-params                of the fluoroscopies; not read
//! 17-1882                    a specimen
//!   vol                      the CT: an image
//!   vol-seg/image            the segmentation: an image
//!   vol-seg/labels-def/N     the name of label N
//!   vol-landmarks/FH-l       a point, LPS mm
//!   projections              fluoroscopies; not read
//! ```
//!
//! An image is a group of `pixels` (slices x rows x columns, row-major), `spacing` and `origin` (columns,
//! rows, slices; LPS mm; column vectors) and `dir-mat`, whose columns are the directions of the index
//! axes in LPS, as ITK's. The origin is the CENTRE of the first voxel, as ours. The poses of the data
//! set's fluoroscopies are half a voxel off in each axis of the volume (xReg corrects them when it
//! reads them); volumes and landmarks agree with each other and need no correction.

mod contents;
mod image;
mod landmarks;
mod structures;
#[cfg(test)]
mod tests;

pub use contents::{DeepFluoro, read_deepfluoro};

/// The licence of the data set.
pub const DEEPFLUORO_LICENCE: &str = "CC BY-NC 4.0";

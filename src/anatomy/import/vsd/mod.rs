//! Subjects of VSDFullBodyBoneReconstruction (Fischer 2023, doi 10.5281/zenodo.8302448): CT and
//! segmentation of cadavers' legs and pelvis.
//!
//! ```text
//! z001                                            a subject
//!   SMIR.Body.076Y.M.CT.57697                     a scan; the name's SMIR part is any
//!     ....Pelvis-Thighs.nrrd                      the CT (NRRD or NIfTI)
//!     ....Pelvis-Thighs_Reconstruction.seg.nrrd   Slicer's segmentation of it
//!     ....Shanks-Feet...                          the same of the lower legs; not read
//!     SMIR.Body.076Y.M.CT.57697.json              age, sex, ...
//!     Transform-Upside-Down.h5                    where the subject lies upside down
//! ```
//!
//! Segments are named `Sacrum`, `Hip_L`, `Hip_R`, `Femur_L`, `Femur_R` and so on. They may overlap and
//! then lie in several layers.

mod folder;
mod read;
#[cfg(test)]
mod tests;

pub use folder::{VsdFiles, find_vsd};
pub use read::{Vsd, read_segmentation, read_vsd};

/// The licence of the data set.
pub const VSD_LICENCE: &str = "CC BY-NC-SA 4.0";

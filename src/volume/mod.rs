//! Regular 3D grids: voxels with a place in the world, sampling, morphology and file formats.

pub mod components;
pub mod cubic;
pub mod dicom;
pub mod distance;
mod file_error;
#[cfg(test)]
mod format_tests;
pub mod grid;
mod header_fields;
pub mod metaimage;
pub mod morphology;
pub mod nifti;
pub mod nrrd;
mod overlap;
mod place;
mod read;
pub mod resample;
mod samples;
mod source;
pub mod surface;
#[cfg(test)]
pub(crate) mod surface_block;
mod surface_field;
mod surface_nets;
pub mod surface_query;
mod voxel;

pub use self::dicom::{read_dicom_series, read_dicom_series_of};
pub use self::metaimage::read_metaimage;
pub use self::nifti::{read_nifti, write_nifti};
pub use self::nrrd::{nrrd_segment_names, read_nrrd};
pub use file_error::VolumeFileError;
pub use grid::{Grid, Volume};
pub use overlap::dice;
pub(crate) use place::grid_from_affine;
pub use read::read_volume;
pub use surface::{Surface, SurfaceParameters};
pub use surface_query::Hit;
pub use voxel::{Voxel, VoxelProblem};

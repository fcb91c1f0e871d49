//! Regular 3D grids: voxels with a place in the world, sampling, morphology and file formats.

pub mod components;
pub mod distance;
pub mod grid;
pub mod morphology;

pub use grid::{Grid, Volume};

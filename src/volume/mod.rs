//! Regular 3D grids: voxels with a place in the world, sampling, morphology and file formats.

pub mod grid;

pub use grid::{Grid, Volume};

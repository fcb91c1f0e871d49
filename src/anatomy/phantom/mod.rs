//! Built-in phantom bodies: parametric shapes, drawn at random, voxelized to specimens.

mod acetabulum;
mod bone_density;
mod build;
mod distance;
mod femur;
mod hip_bone;
mod noise;
mod parameters;
mod sacrum;
mod skeleton;
mod soft_tissue;
mod source;
#[cfg(test)]
mod tests;
mod voxelize;
mod wing;

pub use parameters::PhantomParameters;
pub use source::phantom_source;
pub use voxelize::{phantom, phantom_structures};

//! Specimens from closed bone surfaces.
//!
//! Surfaces carry no density, so Hounsfield values are assigned by rule and the specimen says so.

mod body;
mod bone_density;
mod bone_files;
mod error;
mod import;
mod mesh_file;
mod near_surface;
mod noise;
mod origin;
mod parameters;
mod soft_tissue;
mod voxelize;

pub use bone_files::{BONES, bone_files, read_bone_surfaces};
pub use error::ImportError;
pub use import::{
    specimen_from_surfaces, specimen_from_surfaces_with, structures_from_surfaces, surfaces_source,
};
pub use mesh_file::{MeshFormat, read_closed_surface};
pub use origin::{ORIGIN_FILE, SurfacesOrigin};
pub use parameters::SurfacesParameters;

//! Specimens from closed bone surfaces.
//!
//! Surfaces carry no density, so Hounsfield values are assigned by rule and the specimen says so.

mod body;
mod bone_density;
mod bone_files;
mod error;
mod import;
mod near_surface;
mod noise;
mod origin;
mod parameters;
mod ply;
mod soft_tissue;
mod voxelize;

pub use bone_files::{BONE_FILES, read_bone_surfaces};
pub use error::ImportError;
pub use import::{specimen_from_surfaces, structures_from_surfaces};
pub use origin::{ORIGIN_FILE, SurfacesOrigin};
pub use parameters::SurfacesParameters;

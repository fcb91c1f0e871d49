//! Specimens from closed bone surfaces.
//!
//! Surfaces carry no density, so Hounsfield values are assigned by rule and the specimen says so.

mod bone_files;
mod error;
mod ply;

pub use bone_files::{BONE_FILES, read_bone_surfaces};
pub use error::ImportError;

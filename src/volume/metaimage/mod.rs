//! Volumes as MetaImage files (`.mha`, and `.mhd` with its data file), as ITK writes them.
//!
//! A MetaImage world is LPS, as ours is. `TransformMatrix` has the direction of axis i in its i-th three
//! numbers. `AnatomicalOrientation` only describes: its letters name where each axis comes FROM, so `RAI` is
//! LPS. Programs disagree on it, so a contradiction is logged and the matrix followed.

mod header;
mod place;
mod read;

pub(super) use read::is_metaimage;
pub use read::read_metaimage;

/// What a file is read as, for messages.
const FORMAT: &str = "MetaImage file (.mha or .mhd)";

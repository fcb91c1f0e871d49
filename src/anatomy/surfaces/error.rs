//! Why bone surfaces could not be made a specimen.

use crate::anatomy::detect::DetectError;
use std::path::PathBuf;

/// Why bone surfaces could not be made a specimen.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    #[error("{dir} lacks {}; expected a closed surface for each bone", .missing.join(", "))]
    MissingFiles { dir: PathBuf, missing: Vec<String> },
    #[error("cannot read {path}: {source}")]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{path} is not a readable PLY surface: {reason}")]
    Ply { path: PathBuf, reason: String },
    #[error(
        "{path} is not closed: {open_edges} edges have a triangle on one side only or are run through twice the same way; close the surface's holes"
    )]
    NotClosed { path: PathBuf, open_edges: usize },
    #[error("cannot find the landmarks: {0}")]
    Detect(#[from] DetectError),
}

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
    #[error(
        "{path} is {extent_mm:.3} mm long; expected {low} to {high} mm: are its lengths in another unit than mm?"
    )]
    Size {
        path: PathBuf,
        extent_mm: f64,
        low: f64,
        high: f64,
    },
    #[error(
        "{path} does not say where the surfaces come from: {reason}; expected the keys sex, licence and from, each a text"
    )]
    Origin { path: PathBuf, reason: String },
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<ImportError>),
    #[error("cannot find the landmarks: {0}")]
    Detect(#[from] DetectError),
}

//! Why bone surfaces could not be made a specimen.

use crate::anatomy::detect::{DetectError, Unfound};
use std::path::PathBuf;

/// Why bone surfaces could not be made a specimen.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    #[error(
        "{dir} lacks {}; expected a closed surface for each bone, as .ply, .stl, .vtk or .obj{}",
        .missing.join(", "), also(.unread)
    )]
    MissingFiles {
        dir: PathBuf,
        /// Names without an ending.
        missing: Vec<String>,
        /// Files of these names in formats that are not read.
        unread: Vec<String>,
    },
    #[error("{dir} holds {}: which one is the bone? Keep one of them", .files.join(" and "))]
    Ambiguous { dir: PathBuf, files: Vec<String> },
    #[error("cannot read {path}: {source}")]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{path} is not a readable {format} surface: {reason}")]
    Format {
        path: PathBuf,
        /// What it was read as, `PLY` for instance.
        format: &'static str,
        reason: String,
    },
    #[error(
        "{0} is of no format that is read; expected .ply, .stl, .vtk (legacy polydata) or .obj: save it as one of them"
    )]
    UnknownFormat(PathBuf),
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
        "{path} does not say where the surfaces come from: {reason}; expected the keys sex, licence and from, each a text, and frame, RAS or LPS"
    )]
    Origin { path: PathBuf, reason: String },
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Several(Vec<ImportError>),
    #[error("cannot find the landmarks: {0}")]
    Detect(#[from] DetectError),
    #[error(
        "cannot find the landmarks. Neither found nor given are:\n{0}\nLook at the surfaces there, or give these by --landmarks FILE (docs/formats.md, Points)"
    )]
    Landmarks(#[from] Box<Unfound>),
    #[error("body and density are made around femoral heads, and no head's size is known: {0}")]
    Heads(String),
}

fn also(unread: &[String]) -> String {
    match unread {
        [] => String::new(),
        files => format!(
            " ({} is not read: save it as one of them)",
            files.join(", ")
        ),
    }
}

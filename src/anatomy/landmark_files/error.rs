//! Why a file of points could not be read or written.

use crate::anatomy::Side;
use std::path::PathBuf;

/// Why a file of points could not be read or written. Every message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PointsFileError {
    #[error("cannot {doing} {path}: {source}")]
    Io {
        doing: &'static str,
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(
        "{0} is of no format for points that is read; expected .fcsv, .mrk.json or .csv: save it as one of them"
    )]
    UnknownFormat(PathBuf),
    #[error("{path} is not a readable {format} file of points: {reason}")]
    Format {
        path: PathBuf,
        /// What it was read as, `.fcsv` for instance.
        format: &'static str,
        reason: String,
    },
    #[error("{path} does not say in which frame its points are: {reason}")]
    Frame { path: PathBuf, reason: String },
    #[error("{path} states its lengths in {found}; expected mm")]
    Unit { path: PathBuf, found: String },
    #[error("{path} has two points named '{name}'; which one is it? Rename or remove one of them")]
    Duplicate { path: PathBuf, name: String },
    #[error(
        "{path}: '{first}' and '{second}' both mean {meaning}; which one is it? Rename or remove one of them"
    )]
    SameMeaning {
        path: PathBuf,
        first: String,
        second: String,
        meaning: String,
    },
    #[error(
        "the {side} rim in {path} {reason}; expected an ordered closed line: resample the curve in Slicer (Markups, Resample), or place more points"
    )]
    Rim {
        path: PathBuf,
        side: Side,
        reason: String,
    },
    #[error(
        "{path} holds no landmark and no rim; expected names as ASIS_l or left ASIS, and a closed curve or points named as rim_l{}",
        .ignored.iter().map(|line| format!("\n  - {line}")).collect::<String>()
    )]
    Nothing {
        path: PathBuf,
        /// A line for each point that was passed over.
        ignored: Vec<String>,
    },
    #[error("{0} exists already; remove it or choose another file")]
    Exists(PathBuf),
}

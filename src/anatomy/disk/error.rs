//! Why a specimen's folder could not be read or written.

use crate::anatomy::SpecimenProblem;
use crate::volume::VolumeFileError;
use std::path::PathBuf;

/// Why a specimen's folder could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SpecimenError {
    #[error("cannot {doing} {path}: {source}")]
    Io {
        doing: &'static str,
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{0} exists already; remove it or choose another folder")]
    Exists(PathBuf),
    #[error("{place} is not a valid specimen:{}", list(.problems))]
    Invalid {
        /// The folder, or the specimen's name where there is none yet.
        place: String,
        problems: Vec<SpecimenProblem>,
    },
    #[error(transparent)]
    Volume(#[from] VolumeFileError),
}

/// One line a problem, so that all of them can be mended in one go.
fn list(problems: &[SpecimenProblem]) -> String {
    problems.iter().map(|p| format!("\n  - {p}")).collect()
}

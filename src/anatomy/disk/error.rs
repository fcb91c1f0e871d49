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

/// More problems than this are counted only: points of a file in another frame are all outside.
const TOLD: usize = 40;

/// One line a problem, so that all of them can be mended in one go.
fn list(problems: &[SpecimenProblem]) -> String {
    let told = problems.iter().take(TOLD);
    let told: String = told.map(|p| format!("\n  - {p}")).collect();
    match problems.len().saturating_sub(TOLD) {
        0 => told,
        more => format!("{told}\n  - and {more} more of this kind or others"),
    }
}

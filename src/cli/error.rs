//! Failures of commands, and the exit codes.

use pao_sim::study::slurm::SlurmError;
use pao_sim::study::{KeyError, StudyError};

/// The documented exit codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// All was done.
    Complete = 0,
    /// Something went wrong.
    Error = 1,
    /// The command line or the configuration is wrong.
    Usage = 2,
    /// All was done, and some rows say why they failed.
    FailedRows = 3,
    /// Stopped early; the same command continues.
    Stopped = 75,
}

/// A command that could not do its work.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    #[error(transparent)]
    Study(#[from] StudyError),
    #[error(transparent)]
    Key(#[from] KeyError),
    #[error(transparent)]
    Rows(#[from] pao_sim::report::RowsError),
    #[error(transparent)]
    Report(#[from] pao_sim::report::ReportError),
    #[error(transparent)]
    Picture(#[from] pao_sim::report::PictureError),
    #[error(transparent)]
    Specimen(#[from] pao_sim::anatomy::SpecimenError),
    #[error(transparent)]
    Import(#[from] pao_sim::anatomy::surfaces::ImportError),
    #[error(transparent)]
    Points(#[from] pao_sim::anatomy::landmark_files::PointsFileError),
    #[error(transparent)]
    CtImport(#[from] pao_sim::anatomy::import::CtImportError),
    #[error(transparent)]
    Volume(#[from] pao_sim::volume::VolumeFileError),
    #[error(transparent)]
    Slurm(#[from] SlurmError),
    #[error("{phase}: {message}", phase = .0.phase, message = .0.message)]
    Work(pao_sim::study::Failure),
    #[error("{0}")]
    Usage(String),
    #[error("the study has no registration or case {0}; `pao-sim plan` tells what it consists of")]
    NotPlanned(String),
    #[error("cannot {action}: {cause}")]
    Io {
        action: String,
        #[source]
        cause: std::io::Error,
    },
}

impl Failure {
    /// The exit code that it ends the program with.
    pub fn exit(&self) -> Exit {
        match self {
            Self::Study(
                StudyError::Config(_)
                | StudyError::NoStudy { .. }
                | StudyError::NotBegun { .. }
                | StudyError::Mixed { .. }
                | StudyError::Diverging { .. }
                | StudyError::Newer { .. }
                | StudyError::Guarded { .. },
            )
            | Self::Slurm(SlurmError::Value { .. } | SlurmError::Path { .. })
            | Self::Usage(_)
            | Self::Key(_)
            | Self::NotPlanned(_) => Exit::Usage,
            _ => Exit::Error,
        }
    }
}

impl Failure {
    /// True when a disk has no room left.
    pub fn is_full_disk(&self) -> bool {
        let mut cause: Option<&(dyn std::error::Error + 'static)> = Some(self);
        while let Some(error) = cause {
            if let Some(io) = error.downcast_ref::<std::io::Error>()
                && io.kind() == std::io::ErrorKind::StorageFull
            {
                return true;
            }
            cause = error.source();
        }
        false
    }
}

impl From<pao_sim::study::ConfigError> for Failure {
    fn from(error: pao_sim::study::ConfigError) -> Self {
        Self::Study(error.into())
    }
}

impl From<pao_sim::study::Failure> for Failure {
    fn from(failure: pao_sim::study::Failure) -> Self {
        Self::Work(failure)
    }
}

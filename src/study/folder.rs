//! The folder of a study: `results/<study>/`.

use super::{Config, ConfigError};
use crate::store::{JournalError, TableError, durable};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// Where a study's files lie.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StudyFolder {
    path: PathBuf,
}

/// A study that cannot be opened or run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error(transparent)]
    Table(#[from] TableError),
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        action: &'static str,
        path: PathBuf,
        #[source]
        cause: std::io::Error,
    },
    #[error(
        "{} is neither a study's folder (with a study.toml) nor a configuration file; give one of them",
        path.display()
    )]
    NoStudy { path: PathBuf },
    #[error("nothing was run of the study {name} yet ({} is not there); begin it with `pao-sim run`", path.display())]
    NotBegun { name: String, path: PathBuf },
    #[error(
        "another process works on {}; wait for it or stop it (it holds {})",
        path.display(), lock.display()
    )]
    Busy { path: PathBuf, lock: PathBuf },
    #[error(
        "the study in {} was begun with another configuration, other data or another program:\n{}\ntake another name or --results folder, or accept each change by name (--accept {})",
        path.display(), differences.join("\n"), keys.join(" --accept ")
    )]
    Mixed {
        path: PathBuf,
        /// One line a difference.
        differences: Vec<String>,
        /// What may be accepted by name.
        keys: Vec<String>,
    },
    #[error(transparent)]
    Simd(#[from] crate::simd::SimdError),
    #[error("cannot set up the study: {0}")]
    Worker(String),
}

impl StudyFolder {
    /// The folder of the study `name` under `results`.
    pub fn of(results: &Path, name: &str) -> Self {
        Self {
            path: results.join(name),
        }
    }

    /// The folder that a user means: itself, or that of a configuration file.
    ///
    /// # Errors
    /// When `study` is neither, or nothing of it was run yet.
    pub fn find(study: &Path, results: &Path) -> Result<Self, StudyError> {
        if study.join("study.toml").is_file() {
            return Ok(Self {
                path: study.to_owned(),
            });
        }
        if !study.is_file() {
            return Err(StudyError::NoStudy {
                path: study.to_owned(),
            });
        }
        let name = Config::read(study)?.study.name;
        let folder = Self::of(results, &name);
        if folder.config_file().is_file() {
            Ok(folder)
        } else {
            Err(StudyError::NotBegun {
                name,
                path: folder.config_file(),
            })
        }
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The resolved configuration.
    pub fn config_file(&self) -> PathBuf {
        self.path.join("study.toml")
    }

    /// Every attempt's provenance, as JSON.
    pub fn manifest(&self) -> PathBuf {
        self.path.join("manifest.json")
    }

    /// One journal an attempt.
    pub fn journals(&self) -> PathBuf {
        self.path.join("journal")
    }

    /// All rows as Parquet.
    pub fn table(&self) -> PathBuf {
        self.path.join("registrations.parquet")
    }

    /// Tables and figures.
    pub fn report(&self) -> PathBuf {
        self.path.join("report")
    }

    /// Logs of the attempts.
    pub fn logs(&self) -> PathBuf {
        self.path.join("logs")
    }

    /// Makes the folder and takes its lock, which lasts as long as the returned file.
    ///
    /// # Errors
    /// When it cannot be made, or another process has the lock.
    pub fn lock(&self) -> Result<File, StudyError> {
        let logs = self.logs();
        std::fs::create_dir_all(&logs).map_err(io("create", &logs))?;
        let path = self.path.join("lock");
        let file = File::create(&path).map_err(io("create", &path))?;
        match file.try_lock() {
            Ok(()) => Ok(file),
            Err(TryLockError::WouldBlock) => Err(StudyError::Busy {
                path: self.path.clone(),
                lock: path,
            }),
            // A file system without locks cannot tell; journals of several processes do not
            // disturb each other, they only do some work twice.
            Err(TryLockError::Error(cause)) => {
                tracing::warn!(
                    "{} cannot be locked ({cause}): see to it that no other process runs this study",
                    path.display()
                );
                Ok(file)
            }
        }
    }

    /// True while another process has the lock.
    pub fn is_locked(&self) -> bool {
        let file = File::open(self.path.join("lock"));
        file.is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }

    /// Writes a small file at once or not at all.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, path: &Path, text: &str) -> Result<(), StudyError> {
        durable::write(path, |out| out.write_all(text.as_bytes())).map_err(io("write", path))
    }
}

/// Words an input or output error.
pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> StudyError {
    let path = path.to_owned();
    move |cause| StudyError::Io {
        action,
        path,
        cause,
    }
}

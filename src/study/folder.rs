//! The folder of a study: `results/<study>/`.

use super::isolation::key_of;
use super::{Config, ConfigError};
use crate::store::locks::{self, Waited};
use crate::store::{JournalError, Store, StoreError, TableError, durable};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Duration;

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
    Store(#[from] StoreError),
    #[error(transparent)]
    Conflict(#[from] super::state::Conflict),
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
        "another process works on share {theirs} of {}, which overlaps with {ours}: attempt {attempt} on {host} (process {process}), last heard of {silence} s ago; wait for it or stop it",
        path.display()
    )]
    Busy {
        path: PathBuf,
        ours: String,
        theirs: String,
        attempt: u32,
        host: String,
        process: u64,
        /// Seconds since it last wrote.
        silence: u64,
    },
    #[error(
        "attempt {attempt} on {host} works on {} with another configuration, so shares cannot be told apart:\n{}\nwait for it, stop it, or use the configuration that it has",
        path.display(), differences.join("\n")
    )]
    Diverging {
        path: PathBuf,
        attempt: u32,
        host: String,
        /// One line a difference.
        differences: Vec<String>,
    },
    #[error("{} has been locked by another process for {} s; is it, or its machine, hanging?", path.display(), patience.as_secs())]
    Locked { path: PathBuf, patience: Duration },
    #[error(
        "{} was written by a newer version of the program (format {found}, expected at most {expected}): use that version, or take another results folder",
        path.display()
    )]
    Newer {
        path: PathBuf,
        found: u64,
        expected: u64,
    },
    #[error(
        "--fresh throws away {rows} rows of {attempts} attempts in {}; to do so give the study's name with it: --fresh={name}",
        path.display()
    )]
    Guarded {
        path: PathBuf,
        name: String,
        rows: usize,
        attempts: usize,
    },
    #[error("cannot try again what was in work when an attempt died: {0}")]
    Isolation(String),
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
    Surfaces(#[from] crate::anatomy::surfaces::ImportError),
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
        let name = Config::read_as_named(study)?.study.name;
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

    /// Rows of attempts that are over.
    pub fn parts(&self) -> PathBuf {
        self.path.join("parts")
    }

    /// Copies of programs that jobs run, each under its content's hash.
    pub fn programs(&self) -> PathBuf {
        self.path.join("bin")
    }

    /// Job scripts, and the configurations that they run.
    pub fn slurm(&self) -> PathBuf {
        self.path.join("slurm")
    }

    /// The records of the study.
    pub fn store(&self) -> Store {
        Store {
            journals: self.journals(),
            parts: self.parts(),
            key_of,
        }
    }

    /// Takes the study's lock, which lasts as long as the returned file. It is held for moments only:
    /// while an attempt is begun or sealed, or a file made of all rows is written.
    ///
    /// # Errors
    /// When the folder cannot be written, or others have the lock for minutes.
    pub fn lock(&self) -> Result<File, StudyError> {
        let path = self.path.join("lock");
        match locks::wait(&path, PATIENCE).map_err(io("write", &path))? {
            Waited::Locked(file) => Ok(file),
            Waited::NoLocks(file, cause) => {
                tracing::warn!(
                    "{} cannot be locked ({cause}): see to it that no two processes have the same share, and start them one after the other",
                    path.display()
                );
                Ok(file)
            }
            Waited::Busy => Err(StudyError::Locked {
                path,
                patience: PATIENCE,
            }),
        }
    }

    /// Writes a small file at once or not at all.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, path: &Path, text: &str) -> Result<(), StudyError> {
        durable::write(path, |out| out.write_all(text.as_bytes())).map_err(io("write", path))
    }
}

/// How long a process waits for others to begin or to end: a thousand may do so at once.
const PATIENCE: Duration = Duration::from_secs(900);

/// Words an input or output error.
pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> StudyError {
    let path = path.to_owned();
    move |cause| StudyError::Io {
        action,
        path,
        cause,
    }
}

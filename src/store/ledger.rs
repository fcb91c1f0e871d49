//! Everything that was recorded of a study: attempts and rows, from journals and parts.
//!
//! Others may write, seal and merge meanwhile. Journals are read before parts, so that a row is met at
//! least once while it moves from the one to the other, and reading begins anew when a file
//! vanished between being listed and being read.

use super::attempt::{Attempt, KeyOf};
use super::journal::{self, JournalError, numbered};
use super::locks;
use super::parts::{self, About, PartError};
use super::row::Row;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

/// Where the records of a study lie.
#[derive(Clone, Debug)]
pub struct Store {
    /// Folder of the journals.
    pub journals: PathBuf,
    /// Folder of the parts.
    pub parts: PathBuf,
    pub key_of: KeyOf,
}

/// The records of a study at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Every attempt, by number.
    pub attempts: Vec<Attempt>,
    /// Every row, attempt by attempt, in the order in which they were committed. A key may be there
    /// several times.
    pub rows: Vec<Row>,
    /// Journals with bytes at the end that cannot be read, and how many.
    pub torn: Vec<(PathBuf, u64)>,
}

/// Records that cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error(transparent)]
    Part(#[from] PartError),
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        action: &'static str,
        path: PathBuf,
        #[source]
        cause: std::io::Error,
    },
}

impl StoreError {
    /// True when a file went away while it was to be read.
    fn vanished(&self) -> bool {
        let gone = |cause: &std::io::Error| cause.kind() == std::io::ErrorKind::NotFound;
        match self {
            Self::Journal(JournalError::Io { cause, .. }) | Self::Io { cause, .. } => gone(cause),
            Self::Part(error) => error.vanished(),
            Self::Journal(JournalError::Foreign { .. }) => false,
        }
    }

    pub(super) fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        move |cause| Self::Io {
            action,
            path,
            cause,
        }
    }
}

/// How often reading begins anew before a vanished file is an error.
const TRIES: usize = 50;

impl Store {
    /// Reads everything.
    ///
    /// # Errors
    /// When a file cannot be read, is damaged, or another version wrote it.
    pub fn read(&self) -> Result<Ledger, StoreError> {
        self.again_while_files_vanish(|| self.read_once())
    }

    /// Reads what is known of the attempts without reading their rows: of those that only a journal
    /// tells of, no more than the header.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn attempts(&self) -> Result<Vec<Attempt>, StoreError> {
        self.again_while_files_vanish(|| {
            let mut attempts = Vec::new();
            for (_, path) in numbered(&self.journals)? {
                let (alive, sign) = signs_of_life(&path)?;
                if let Some(header) = journal::read_header(&path)? {
                    attempts.push(Attempt::begun(header, sign, alive));
                }
            }
            let listed = self.list_parts()?;
            for (_, about) in self.current_parts(&listed)? {
                attempts.retain(|a| about.attempts.iter().all(|b| a.attempt != b.attempt));
                attempts.extend(about.attempts);
            }
            attempts.sort_by_key(|attempt| attempt.attempt);
            Ok((attempts, listed))
        })
    }

    fn again_while_files_vanish<T>(
        &self,
        read: impl Fn() -> Result<(T, Vec<PathBuf>), StoreError>,
    ) -> Result<T, StoreError> {
        for _ in 0..TRIES {
            match read() {
                // A folder is not listed at one instant: a merged part may have been missed.
                Ok((value, listed)) if self.list_parts()? == listed => return Ok(value),
                Ok(_) => {}
                Err(error) if error.vanished() => {}
                Err(error) => return Err(error),
            }
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        read().map(|(value, _)| value)
    }

    fn read_once(&self) -> Result<(Ledger, Vec<PathBuf>), StoreError> {
        let mut found: Vec<(Attempt, Vec<Row>)> = Vec::new();
        let mut torn = Vec::new();
        for (_, path) in numbered(&self.journals)? {
            // Looked at before it is read: what lives may go on writing, what died does not.
            let (alive, sign) = signs_of_life(&path)?;
            let journal = journal::read(&path)?;
            if journal.torn_bytes > 0 && !alive {
                torn.push((path, journal.torn_bytes));
            }
            found.extend(Attempt::of(journal, self.key_of, sign, alive));
        }
        let listed = self.list_parts()?;
        let mut sealed = BTreeSet::new();
        let mut of_parts = Vec::new();
        for (path, _) in self.current_parts(&listed)? {
            let part = parts::read(&path)?;
            sealed.extend(part.attempts.iter().map(|attempt| attempt.attempt));
            of_parts.extend(by_attempt(part));
        }
        found.retain(|(attempt, _)| !sealed.contains(&attempt.attempt));
        found.extend(of_parts);
        torn.retain(|(path, _)| number_of(path).is_none_or(|n| !sealed.contains(&n)));
        found.sort_by_key(|(attempt, _)| attempt.attempt);
        let mut ledger = Ledger {
            torn,
            ..Ledger::default()
        };
        for (attempt, rows) in found {
            ledger.attempts.push(attempt);
            ledger.rows.extend(rows);
        }
        Ok((ledger, listed))
    }

    /// Paths of all parts, sorted.
    pub(super) fn list_parts(&self) -> Result<Vec<PathBuf>, StoreError> {
        let folder = &self.parts;
        let entries = match std::fs::read_dir(folder) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            entries => entries.map_err(StoreError::io("list", folder))?,
        };
        let mut found = Vec::new();
        for entry in entries {
            let path = entry.map_err(StoreError::io("list", folder))?.path();
            let hidden = path
                .file_name()
                .is_some_and(|n| n.as_encoded_bytes()[0] == b'.');
            if path.extension().is_some_and(|e| e == "parquet") && !hidden {
                found.push(path);
            }
        }
        found.sort();
        Ok(found)
    }

    /// The parts without those whose attempts all are in a larger one.
    pub(super) fn current_parts(
        &self,
        listed: &[PathBuf],
    ) -> Result<Vec<(PathBuf, About)>, StoreError> {
        let mut all = Vec::new();
        for path in listed {
            all.push((path.clone(), parts::read_about(path)?));
        }
        all.sort_by_key(|(_, about)| std::cmp::Reverse(about.attempts.len()));
        let mut covered = BTreeSet::new();
        all.retain(|(_, about)| {
            let numbers: Vec<u32> = about.attempts.iter().map(|a| a.attempt).collect();
            let superseded = numbers.iter().all(|number| covered.contains(number));
            covered.extend(numbers);
            !superseded
        });
        Ok(all)
    }
}

/// The rows of a part, attempt by attempt.
fn by_attempt(part: parts::Part) -> Vec<(Attempt, Vec<Row>)> {
    let mut found: Vec<(Attempt, Vec<Row>)> =
        part.attempts.into_iter().map(|a| (a, Vec::new())).collect();
    for row in part.rows {
        let number = row.integer("attempt");
        let own = found
            .iter()
            .position(|(a, _)| Some(i64::from(a.attempt)) == number);
        // A row without an attempt of its part goes to the first one, so that it is not lost.
        found[own.unwrap_or(0)].1.push(row);
    }
    found
}

/// Whether the attempt of a journal lives, and when it last wrote.
pub(super) fn signs_of_life(path: &Path) -> Result<(bool, u64), StoreError> {
    let alive = locks::is_held(path).map_err(StoreError::io("open", path))?;
    let metadata = path.metadata().map_err(StoreError::io("read", path))?;
    let changed = metadata.modified().map_err(StoreError::io("read", path))?;
    let since = changed.duration_since(UNIX_EPOCH).unwrap_or_default();
    Ok((alive, since.as_secs()))
}

/// The number of a journal.
fn number_of(path: &Path) -> Option<u32> {
    path.file_stem()?.to_str()?.parse().ok()
}

//! Turning journals into parts, and many parts into few.
//!
//! Whoever does this holds the study's lock. Every step leaves the records whole: the new file is there,
//! synced, before the old ones go, and readers prefer the new one.

use super::attempt::Attempt;
use super::journal::{self, numbered};
use super::ledger::{Store, StoreError, signs_of_life};
use super::parts;
use super::{durable, locks};
use std::collections::BTreeSet;
use std::path::Path;

/// So many parts of similar size are merged into one.
pub const MERGED_AT_ONCE: usize = 16;

impl Store {
    /// Seals the journal of an attempt that is over: its rows go into a part, the journal goes. An
    /// attempt that did nothing leaves nothing.
    ///
    /// # Errors
    /// When the part cannot be written or the journal not read; the journal then stays.
    pub fn seal(&self, path: &Path) -> Result<(), StoreError> {
        let (_, sign) = signs_of_life(path)?;
        let journal = journal::read(path)?;
        if let Some((attempt, rows)) = Attempt::of(journal, self.key_of, sign, false)
            && attempt.left_a_trace()
        {
            parts::write(&self.parts, vec![attempt], &rows)?;
        }
        crate::fail_point!("seal.before_removal");
        std::fs::remove_file(path).map_err(StoreError::io("remove", path))?;
        durable::sync_folder(&self.journals).map_err(StoreError::io("sync", &self.journals))
    }

    /// Seals journals whose attempts died, at most `most` of them, and removes those that were sealed
    /// already.
    ///
    /// # Errors
    /// As [`Self::seal`].
    pub fn seal_dead(&self, most: usize) -> Result<(), StoreError> {
        let mut sealed = BTreeSet::new();
        for (_, about) in self.current_parts(&self.list_parts()?)? {
            sealed.extend(about.attempts.iter().map(|attempt| attempt.attempt));
        }
        let mut left = most;
        for (number, path) in numbered(&self.journals)? {
            if left == 0 {
                break;
            }
            let lock = locks::take_over(&path).map_err(StoreError::io("open", &path))?;
            if lock.is_none() {
                continue;
            }
            if sealed.contains(&number) {
                std::fs::remove_file(&path).map_err(StoreError::io("remove", &path))?;
            } else {
                self.seal(&path)?;
                left -= 1;
            }
        }
        Ok(())
    }

    /// Merges parts, so that there are few: each time [`MERGED_AT_ONCE`] parts hold a like number of
    /// attempts, they become one. Removes parts that a larger one covers and temporary files that
    /// a dead process left.
    ///
    /// # Errors
    /// When a part cannot be read, written or removed.
    pub fn merge(&self) -> Result<(), StoreError> {
        durable::remove_temporary_files(&self.parts)
            .map_err(StoreError::io("clean", &self.parts))?;
        let listed = self.list_parts()?;
        let mut current = self.current_parts(&listed)?;
        for path in &listed {
            if current.iter().all(|(kept, _)| kept != path) {
                std::fs::remove_file(path).map_err(StoreError::io("remove", path))?;
            }
        }
        for level in 0..u32::BITS {
            let alike = |attempts: usize| attempts.ilog(MERGED_AT_ONCE) == level;
            let (own, rest): (Vec<_>, Vec<_>) = current
                .into_iter()
                .partition(|(_, about)| alike(about.attempts.len()));
            if own.len() < MERGED_AT_ONCE {
                current = rest;
                if current.is_empty() {
                    break;
                }
                continue;
            }
            let (mut attempts, mut rows) = (Vec::new(), Vec::new());
            for (path, _) in &own {
                let part = parts::read(path)?;
                attempts.extend(part.attempts);
                rows.extend(part.rows);
            }
            let merged = parts::write(&self.parts, attempts, &rows)?;
            crate::fail_point!("merge.before_removal");
            for (path, _) in &own {
                std::fs::remove_file(path).map_err(StoreError::io("remove", path))?;
            }
            current = rest;
            current.push((merged.clone(), parts::read_about(&merged)?));
        }
        durable::sync_folder(&self.parts)
            .or_else(|error| match error.kind() {
                std::io::ErrorKind::NotFound => Ok(()),
                _ => Err(error),
            })
            .map_err(StoreError::io("sync", &self.parts))
    }
}

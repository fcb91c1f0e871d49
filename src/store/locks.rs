//! Locks of files: who works on what.
//!
//! A lock is advisory and belongs to an open file: it ends with its process, however that ends.
//! Where a file system knows no locks, a file that was changed lately stands for a living process.

use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;
use std::time::{Duration, Instant};

/// Without locks, a file that nobody has touched for so long belongs to nobody.
pub const SILENCE: Duration = Duration::from_secs(300);

/// True while a process holds the lock of the file. A file that is not there is not held.
///
/// # Errors
/// When the file cannot be opened or its age cannot be told.
pub fn is_held(path: &Path) -> io::Result<bool> {
    let file = match File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
        file => file?,
    };
    match file.try_lock_shared() {
        Ok(()) => Ok(false),
        Err(TryLockError::WouldBlock) => Ok(true),
        Err(TryLockError::Error(_)) => {
            let age = file.metadata()?.modified()?.elapsed().unwrap_or_default();
            Ok(age < SILENCE)
        }
    }
}

/// Takes over a file that no living process holds: its lock, or `None` while somebody has it.
///
/// # Errors
/// When the file cannot be opened.
pub fn take_over(path: &Path) -> io::Result<Option<File>> {
    let file = OpenOptions::new().read(true).append(true).open(path)?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Ok(None),
        Err(TryLockError::Error(_)) => Ok((!is_held(path)?).then_some(file)),
    }
}

/// What came of waiting for a lock.
#[derive(Debug)]
pub enum Waited {
    /// It is ours as long as the file lives.
    Locked(File),
    /// The file system has no locks; the file is open all the same.
    NoLocks(File, io::Error),
    /// Somebody else had it all the time.
    Busy,
}

/// Waits for the lock of a file, which is made if it is not there.
///
/// # Errors
/// When the file cannot be opened for writing.
pub fn wait(path: &Path, patience: Duration) -> io::Result<Waited> {
    let begin = Instant::now();
    let file = OpenOptions::new()
        .create(true)
        .truncate(false)
        .write(true)
        .open(path)?;
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(Waited::Locked(file)),
            Err(TryLockError::Error(cause)) => return Ok(Waited::NoLocks(file, cause)),
            Err(TryLockError::WouldBlock) if begin.elapsed() >= patience => {
                return Ok(Waited::Busy);
            }
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(20)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_held_as_long_as_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        assert!(!is_held(&path).unwrap());
        let Waited::Locked(held) = wait(&path, Duration::ZERO).unwrap() else {
            panic!("nobody else has it")
        };
        assert!(is_held(&path).unwrap());
        assert!(take_over(&path).unwrap().is_none());
        let busy = wait(&path, Duration::from_millis(50)).unwrap();
        assert!(matches!(busy, Waited::Busy));
        drop(held);
        assert!(!is_held(&path).unwrap());
        assert!(take_over(&path).unwrap().is_some());
    }
}

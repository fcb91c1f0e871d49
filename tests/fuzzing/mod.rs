//! Fuzzing of readers by damage to valid files.

mod damage;
mod memory;
mod run;
mod streams;

pub use memory::CountingAllocator;
pub use run::fuzz;

use std::path::{Path, PathBuf};

/// A reader and what it reads. `read` gives the message of a refusal.
pub struct Reader {
    name: &'static str,
    seeds: Vec<Seed>,
    read: fn(&Path) -> Result<(), String>,
    memory: (u64, u64),
}

impl Reader {
    pub fn new(
        name: &'static str,
        seeds: Vec<Seed>,
        read: fn(&Path) -> Result<(), String>,
    ) -> Self {
        Self {
            name,
            seeds,
            read,
            memory: (8, 256 << 10),
        }
    }

    /// What a read may take in all: so many times the file's bytes and those they decompress to, and a constant
    /// (buffers, a decoder's window, tables that a library makes once). Default: 8 times, 256 KiB.
    pub fn memory(self, times: u64, constant: u64) -> Self {
        Self {
            memory: (times, constant),
            ..self
        }
    }
}

/// Valid files that belong together.
#[derive(Clone)]
pub struct Seed {
    files: Vec<(String, Vec<u8>)>,
    whole_folder: bool,
}

#[allow(dead_code, reason = "not every format is a folder")]
impl Seed {
    /// Some files; the reader is given the first.
    pub fn files(paths: Vec<PathBuf>) -> Self {
        let named = |path: PathBuf| {
            let name = path.file_name().expect("a file has a name");
            let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            (name.to_string_lossy().into_owned(), bytes)
        };
        Self {
            files: paths.into_iter().map(named).collect(),
            whole_folder: false,
        }
    }

    /// Bytes made by the test itself, as a file of this name.
    pub fn made(name: &str, bytes: Vec<u8>) -> Self {
        Self {
            files: vec![(name.into(), bytes)],
            whole_folder: false,
        }
    }

    /// All files of a folder; the reader is given the folder.
    pub fn folder(folder: &Path) -> Self {
        let entries =
            std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
        let mut paths: Vec<PathBuf> = entries
            .map(|entry| entry.expect("it can be listed").path())
            .collect();
        paths.sort();
        Self {
            whole_folder: true,
            ..Self::files(paths)
        }
    }
}

/// Whether a reader took a file or what it said.
pub fn said<T, E: std::fmt::Display>(result: Result<T, E>) -> Result<(), String> {
    result.map(drop).map_err(|error| error.to_string())
}

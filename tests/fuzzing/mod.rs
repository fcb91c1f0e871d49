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

/// Valid files that belong together; the reader is given the first.
#[derive(Clone)]
pub struct Seed {
    files: Vec<(String, Vec<u8>)>,
}

impl Seed {
    pub fn files(paths: Vec<PathBuf>) -> Self {
        let named = |path: PathBuf| {
            let name = path.file_name().expect("a file has a name");
            let bytes = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            (name.to_string_lossy().into_owned(), bytes)
        };
        Self {
            files: paths.into_iter().map(named).collect(),
        }
    }
}

/// Whether a reader took a file or what it said.
pub fn said<T, E: std::fmt::Display>(result: Result<T, E>) -> Result<(), String> {
    result.map(drop).map_err(|error| error.to_string())
}

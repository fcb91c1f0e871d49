//! Tells the program which sources it was made of (`manifest.json` keeps it).

use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    let inputs = [
        "src",
        "studies/paper/reference.toml",
        "Cargo.lock",
        "Cargo.toml",
        "build.rs",
    ];
    let mut files = Vec::new();
    for input in inputs {
        println!("cargo:rerun-if-changed={input}");
        collect(Path::new(input), &mut files);
    }
    files.sort();
    let mut hash = Fnv::new();
    for file in &files {
        hash.add(file.to_string_lossy().replace('\\', "/").as_bytes());
        hash.add(&std::fs::read(file).unwrap_or_default());
    }
    println!("cargo:rustc-env=PAO_SIM_CODE_HASH={:032x}", hash.0);
    println!(
        "cargo:rustc-env=PAO_SIM_COMMIT={}",
        commit().unwrap_or_else(|| "unknown".into())
    );
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    match std::fs::read_dir(path) {
        Ok(entries) => {
            for entry in entries.flatten() {
                collect(&entry.path(), files);
            }
        }
        Err(_) => files.push(path.to_owned()),
    }
}

/// The commit when the sources were last built, `-dirty` where they differed from it.
fn commit() -> Option<String> {
    let git = |arguments: &[&str]| {
        let output = Command::new("git").args(arguments).output().ok()?;
        output
            .status
            .success()
            .then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let dirty = !git(&["status", "--porcelain", "--untracked-files=no"])?.is_empty();
    Some(if dirty {
        format!("{commit}-dirty")
    } else {
        commit
    })
}

/// FNV-1a with 128 bits: enough to tell sources apart, and no dependency of the build.
struct Fnv(u128);

impl Fnv {
    fn new() -> Self {
        Self(0x6c62272e07bb014262b821756295c58d)
    }

    fn add(&mut self, bytes: &[u8]) {
        for &byte in (bytes.len() as u64).to_le_bytes().iter().chain(bytes) {
            self.0 = (self.0 ^ u128::from(byte)).wrapping_mul(0x0000000001000000000000000000013b);
        }
    }
}

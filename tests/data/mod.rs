//! Real anatomy for tests.

#![allow(dead_code, reason = "each test uses a part of it")]

use std::path::{Path, PathBuf};

/// The six people with closed bone surfaces.
pub const SUBJECTS: [&str; 6] = ["z001", "z013", "z019", "z042", "z046", "z056"];

/// The folder of their bones; as [`folder`].
pub fn vsd() -> Option<PathBuf> {
    folder("vsd", "landmarks.json")
}

/// The folder with two people's label maps of the pelvis; as [`folder`].
pub fn pelvic_labels() -> Option<PathBuf> {
    folder("pelvic_labels", "label_names.json")
}

/// A folder of the real data that holds `file`, or `None`, with a word on standard output, where it
/// does not exist.
///
/// # Panics
/// When it does not exist and `PAO_SIM_REQUIRE_DATA` is set: then no test may be skipped.
fn folder(name: &str, file: &str) -> Option<PathBuf> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let path = data.join(name);
    if path.join(file).is_file() {
        return Some(path);
    }
    assert!(
        std::env::var_os("PAO_SIM_REQUIRE_DATA").is_none(),
        "PAO_SIM_REQUIRE_DATA is set and there is no {file} in {}",
        path.display()
    );
    println!("SKIPPED: no {file} in {}", path.display());
    None
}

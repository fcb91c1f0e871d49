//! Real anatomy for tests.

use std::path::{Path, PathBuf};

/// The six people with closed bone surfaces.
pub const SUBJECTS: [&str; 6] = ["z001", "z013", "z019", "z042", "z046", "z056"];

/// The folder of their bones, or `None`, with a word on standard output, where it does not exist.
///
/// # Panics
/// When it does not exist and `PAO_SIM_REQUIRE_DATA` is set: then no test may be skipped.
pub fn vsd() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/vsd");
    if path.join("landmarks.json").is_file() {
        return Some(path);
    }
    assert!(
        std::env::var_os("PAO_SIM_REQUIRE_DATA").is_none(),
        "PAO_SIM_REQUIRE_DATA is set and there are no bones at {}",
        path.display()
    );
    println!("SKIPPED: no bones at {}", path.display());
    None
}

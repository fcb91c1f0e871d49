//! Folders that hold specimens' folders.

use crate::anatomy::disk::HEADER_FILE;
use std::path::{Path, PathBuf};

/// The specimens that a path of `population.specimens` means: itself or, where it is a folder of specimens'
/// folders, each of these by name.
///
/// # Errors
/// With what was looked for, when the folder is not there or holds no specimen.
pub fn specimens_in(path: &Path) -> Result<Vec<PathBuf>, String> {
    // A path with a variable that is not set has been told of already.
    let unset = path.as_os_str().to_string_lossy().contains("${");
    if unset || path.join(HEADER_FILE).is_file() {
        return Ok(vec![path.to_owned()]);
    }
    if !path.is_dir() {
        return Err(format!(
            "names {}, which is no folder; relative paths start at the configuration's own folder",
            path.display()
        ));
    }
    let entries = std::fs::read_dir(path)
        .and_then(|entries| entries.collect::<Result<Vec<_>, _>>())
        .map_err(|cause| format!("names {}, which cannot be read: {cause}", path.display()))?;
    let mut found: Vec<PathBuf> = entries
        .iter()
        // Folders that are being written have a dot before their name.
        .filter(|entry| !entry.file_name().as_encoded_bytes().starts_with(b"."))
        .map(|entry| entry.path())
        .filter(|folder| folder.join(HEADER_FILE).is_file())
        .collect();
    found.sort();
    if found.is_empty() {
        return Err(format!(
            "names {0}, which is no specimen and holds none; expected {0}/{HEADER_FILE} or \
             {0}/NAME/{HEADER_FILE} (`pao-sim specimen import` writes such folders)",
            path.display()
        ));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_of_specimens_is_each_of_them_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let none = specimens_in(root).unwrap_err();
        assert!(none.contains("NAME/specimen.toml"), "{none}");
        for name in ["z10", "a", "z2", ".partial-specimen-x", "notes"] {
            std::fs::create_dir(root.join(name)).unwrap();
            if name != "notes" {
                std::fs::write(root.join(name).join(HEADER_FILE), "").unwrap();
            }
        }
        std::fs::write(root.join("readme.txt"), "").unwrap();
        let expected = ["a", "z10", "z2"].map(|name| root.join(name));
        assert_eq!(specimens_in(root).unwrap(), expected);
        assert_eq!(specimens_in(&expected[0]).unwrap(), expected[..1]);
        let absent = specimens_in(&root.join("no")).unwrap_err();
        assert!(absent.contains("is no folder"), "{absent}");
        // A specimen is itself, whatever else lies in it.
        std::fs::write(root.join(HEADER_FILE), "").unwrap();
        assert_eq!(specimens_in(root).unwrap(), [root]);
    }
}

//! What people know about a specimen and surfaces do not say.

use super::error::ImportError;
use serde::Deserialize;
use std::path::Path;

/// The file in a folder of bone surfaces that says whose they are. It may be missing, as may each
/// of its keys: `sex`, `licence`, `from`.
pub const ORIGIN_FILE: &str = "surfaces.toml";

/// What people know about a specimen and surfaces do not say.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfacesOrigin {
    /// Letters, digits and `-`.
    pub name: String,
    /// `male`, `female` or `unknown`.
    pub sex: String,
    /// Licence of the surfaces.
    pub licence: String,
    /// Where the surfaces come from, for people.
    pub from: String,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Entries {
    sex: Option<String>,
    licence: Option<String>,
    from: Option<String>,
}

impl SurfacesOrigin {
    /// What [`ORIGIN_FILE`] of the surfaces' folder says, and that nothing is known where it says
    /// nothing. `name` becomes the specimen's.
    ///
    /// # Errors
    /// When the file is there and cannot be read.
    pub fn of_folder(dir: &Path, name: &str) -> Result<Self, ImportError> {
        let path = dir.join(ORIGIN_FILE);
        let entries = if path.exists() {
            let text = std::fs::read_to_string(&path).map_err(|source| ImportError::Io {
                path: path.clone(),
                source,
            })?;
            let bad = |reason| ImportError::Origin { path, reason };
            let entries: Entries = toml::from_str(&text).map_err(|e| bad(e.to_string()))?;
            entries
        } else {
            Entries::default()
        };
        Ok(Self {
            name: name.to_owned(),
            sex: entries.sex.unwrap_or_else(|| "unknown".into()),
            licence: entries.licence.unwrap_or_else(|| "not stated".into()),
            from: entries.from.unwrap_or_else(|| "an unnamed source".into()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_file_says_is_taken_and_the_rest_is_unknown() {
        let folder = tempfile::tempdir().unwrap();
        let read = || SurfacesOrigin::of_folder(folder.path(), "z1");
        assert_eq!(read().unwrap().sex, "unknown");
        let file = folder.path().join(ORIGIN_FILE);
        std::fs::write(&file, "sex = \"female\"\nfrom = \"a scanner\"\n").unwrap();
        let origin = read().unwrap();
        assert_eq!((&*origin.name, &*origin.sex), ("z1", "female"));
        assert_eq!(
            (&*origin.licence, &*origin.from),
            ("not stated", "a scanner")
        );
        std::fs::write(&file, "sexx = \"female\"\n").unwrap();
        let message = read().unwrap_err().to_string();
        assert!(
            message.contains("surfaces.toml") && message.contains("sexx"),
            "{message}"
        );
    }
}

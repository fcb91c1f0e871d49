//! What people know about a specimen and surfaces do not say.

use super::error::ImportError;
use crate::anatomy::PatientFrame;
use serde::Deserialize;
use std::path::Path;

/// The file in a folder of bone surfaces that says whose they are. It may be missing, as may each
/// of its keys: `sex`, `licence`, `from` and `frame`.
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
    frame: Option<PatientFrame>,
}

impl Entries {
    /// What the folder's file says; nothing if there is none.
    fn of_folder(dir: &Path) -> Result<Self, ImportError> {
        let path = dir.join(ORIGIN_FILE);
        if !path.exists() {
            return Ok(Self::default());
        }
        let text = std::fs::read_to_string(&path).map_err(|source| ImportError::Io {
            path: path.clone(),
            source,
        })?;
        toml::from_str(&text).map_err(|e| ImportError::Origin {
            path,
            reason: e.to_string(),
        })
    }
}

/// The frame of those of a folder's surfaces that state none themselves: what [`ORIGIN_FILE`] says,
/// and RAS where it says nothing.
///
/// # Errors
/// When the file is there and cannot be read.
pub(super) fn unstated_frame(dir: &Path) -> Result<PatientFrame, ImportError> {
    Ok(Entries::of_folder(dir)?.frame.unwrap_or(PatientFrame::Ras))
}

impl SurfacesOrigin {
    /// What [`ORIGIN_FILE`] of the surfaces' folder says, and that nothing is known where it says
    /// nothing. `name` becomes the specimen's.
    ///
    /// # Errors
    /// When the file is there and cannot be read.
    pub fn of_folder(dir: &Path, name: &str) -> Result<Self, ImportError> {
        let entries = Entries::of_folder(dir)?;
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
        assert_eq!(unstated_frame(folder.path()).unwrap(), PatientFrame::Ras);
        std::fs::write(&file, "frame = \"LPS\"\n").unwrap();
        assert_eq!(unstated_frame(folder.path()).unwrap(), PatientFrame::Lps);
        std::fs::write(&file, "frame = \"LAS\"\n").unwrap();
        let message = unstated_frame(folder.path()).unwrap_err().to_string();
        assert!(message.contains("frame, RAS or LPS"), "{message}");
        std::fs::write(&file, "sexx = \"female\"\n").unwrap();
        let message = read().unwrap_err().to_string();
        assert!(
            message.contains("surfaces.toml") && message.contains("sexx"),
            "{message}"
        );
    }
}

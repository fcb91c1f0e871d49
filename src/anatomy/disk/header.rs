//! `specimen.toml`.

use crate::anatomy::Source;
use serde::{Deserialize, Serialize};

/// The version of the folder's format that this code writes, and the only one it reads.
pub const FORMAT_VERSION: u32 = 1;

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    pub format_version: u32,
    pub name: String,
    pub source: Source,
}

/// Only the version, so that a newer file is called newer rather than misspelt.
#[derive(Deserialize)]
struct Version {
    format_version: u32,
}

impl Header {
    pub fn parse(text: &str) -> Result<Self, String> {
        let version: Version = toml::from_str(text).map_err(|e| e.to_string())?;
        if version.format_version != FORMAT_VERSION {
            return Err(format!(
                "format_version is {}; this program reads {FORMAT_VERSION}",
                version.format_version
            ));
        }
        toml::from_str(text).map_err(|e| e.to_string())
    }

    pub fn text(&self) -> String {
        toml::to_string(self).expect("strings, a number and a flag are valid TOML")
    }
}

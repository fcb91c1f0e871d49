//! The fields of a text header, and what may be wrong with them.

use super::VolumeFileError;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The values of the fields that a reader knows, as they are written.
#[derive(Debug)]
pub(super) struct HeaderFields<'a> {
    path: &'a Path,
    /// What the file is read as, for messages.
    format: &'static str,
    /// By the field's first name.
    values: BTreeMap<&'static str, String>,
}

impl<'a> HeaderFields<'a> {
    pub fn new(path: &'a Path, format: &'static str) -> Self {
        Self {
            path,
            format,
            values: BTreeMap::new(),
        }
    }

    pub fn path(&self) -> &'a Path {
        self.path
    }

    /// Gives a field its value and returns the one it had.
    pub fn insert(&mut self, field: &'static str, value: &str) -> Option<String> {
        self.values.insert(field, value.to_owned())
    }

    /// A field's value, if it is there.
    pub fn get(&self, field: &'static str) -> Option<&str> {
        self.values.get(field).map(String::as_str)
    }

    /// A field's value.
    pub fn needed(&self, field: &'static str) -> Result<&str, VolumeFileError> {
        self.get(field)
            .ok_or_else(|| self.wrong(format!("its header has no '{field}'")))
    }

    /// A whole number, or `default` where the field is missing.
    pub fn whole(&self, field: &'static str, default: i64) -> Result<i64, VolumeFileError> {
        self.parsed(field, default, "a whole number")
    }

    /// A number, or `default` where the field is missing.
    pub fn number(&self, field: &'static str, default: f64) -> Result<f64, VolumeFileError> {
        self.parsed(field, default, "a number")
    }

    fn parsed<T: FromStr>(
        &self,
        field: &'static str,
        default: T,
        expected: &str,
    ) -> Result<T, VolumeFileError> {
        let Some(text) = self.get(field) else {
            return Ok(default);
        };
        text.parse()
            .map_err(|_| self.wrong(format!("its '{field}' is '{text}'; expected {expected}")))
    }

    /// The numbers of a field, of which there must be `N`.
    pub fn numbers<const N: usize>(
        &self,
        field: &'static str,
    ) -> Result<[f64; N], VolumeFileError> {
        let text = self.needed(field)?;
        let numbers: Option<Vec<f64>> = text.split_whitespace().map(|n| n.parse().ok()).collect();
        numbers
            .and_then(|n| n.try_into().ok())
            .ok_or_else(|| self.wrong(format!("its '{field}' is '{text}'; expected {N} numbers")))
    }

    /// Samples along every axis, which `field` lists and `axes` counts.
    pub fn sizes(
        &self,
        axes: &'static str,
        field: &'static str,
    ) -> Result<Vec<i64>, VolumeFileError> {
        let text = self.needed(field)?;
        let sizes: Option<Vec<i64>> = text.split_whitespace().map(|s| s.parse().ok()).collect();
        let sizes = sizes.ok_or_else(|| {
            self.wrong(format!("its '{field}' is '{text}'; expected whole numbers"))
        })?;
        let count = self.needed(axes)?;
        if count.parse() != Ok(sizes.len()) {
            return Err(self.wrong(format!(
                "its '{axes}' is {count} and its '{field}' '{text}'; expected so many numbers"
            )));
        }
        Ok(sizes)
    }

    /// The file beside the header that `field` names with `name`.
    ///
    /// # Errors
    /// When it names several.
    pub fn data_file(&self, field: &'static str, name: &str) -> Result<PathBuf, VolumeFileError> {
        let list = name.split_whitespace().next() == Some("LIST");
        if name.is_empty() || list || name.contains('%') {
            return Err(self.wrong(format!(
                "its voxels lie in several files ('{field}' is '{name}'); write it anew as one file"
            )));
        }
        Ok(self.path.parent().unwrap_or(Path::new("")).join(name))
    }

    /// What is wrong with the header.
    pub fn wrong(&self, reason: String) -> VolumeFileError {
        VolumeFileError::Format {
            path: self.path.into(),
            format: self.format,
            reason,
        }
    }

    /// What is missing of the voxels' place.
    pub fn no_place(&self, reason: String) -> VolumeFileError {
        VolumeFileError::Place {
            path: self.path.into(),
            reason,
        }
    }

    /// Sizes that are not those of a volume.
    pub fn dimensions(&self, dims: Vec<i64>) -> VolumeFileError {
        VolumeFileError::Dimensions {
            path: self.path.into(),
            dims,
        }
    }

    /// A type of numbers that is not read, as its format names it.
    pub fn data_type(&self, found: String) -> VolumeFileError {
        VolumeFileError::DataType {
            path: self.path.into(),
            found,
        }
    }

    /// A unit of length that is not mm, and the field that says so.
    pub fn unit(&self, field: &str, unit: &str) -> VolumeFileError {
        VolumeFileError::Unit {
            path: self.path.into(),
            found: format!("'{unit}' ({field})"),
        }
    }
}

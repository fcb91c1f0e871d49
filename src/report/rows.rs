//! A study's rows as columns in memory.

use polars::prelude::*;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

/// A table of registrations that cannot be reported.
#[derive(Debug, thiserror::Error)]
pub enum RowsError {
    #[error("cannot open {path}: {source}; run the study first")]
    Open {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("cannot read {path} as Parquet: {source}")]
    Parquet { path: PathBuf, source: PolarsError },
    #[error(
        "{path} has no column `{column}` of the expected type: {source}; was it written by another version?"
    )]
    Column {
        path: PathBuf,
        column: String,
        source: PolarsError,
    },
}

/// Registrations as columns: texts and numbers of equal length, in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    text: BTreeMap<String, Vec<String>>,
    numbers: BTreeMap<String, Vec<f64>>,
    len: usize,
}

impl Rows {
    /// Reads a Parquet file. Nulls become empty texts and NaN.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, RowsError> {
        let file = File::open(path).map_err(|source| RowsError::Open {
            path: path.into(),
            source,
        })?;
        let frame = ParquetReader::new(file)
            .finish()
            .map_err(|source| RowsError::Parquet {
                path: path.into(),
                source,
            })?;
        let mut rows = Self {
            len: frame.height(),
            ..Self::default()
        };
        for column in frame.columns() {
            let name = column.name().to_string();
            let failed = |source| RowsError::Column {
                path: path.into(),
                column: name.clone(),
                source,
            };
            if column.dtype() == &DataType::String {
                let values = column.str().map_err(failed)?;
                let values = values.iter().map(|v| v.unwrap_or("").to_string());
                rows.text.insert(name, values.collect());
            } else {
                let cast = column.cast(&DataType::Float64).map_err(failed)?;
                let values = cast.f64().map_err(failed)?;
                let values = values.iter().map(|v| v.unwrap_or(f64::NAN));
                rows.numbers.insert(name, values.collect());
            }
        }
        Ok(rows)
    }

    /// Rows of given columns.
    ///
    /// # Panics
    /// When columns differ in length.
    pub fn of(text: BTreeMap<String, Vec<String>>, numbers: BTreeMap<String, Vec<f64>>) -> Self {
        let lengths = text.values().map(Vec::len);
        let mut lengths = lengths.chain(numbers.values().map(Vec::len));
        let len = lengths.next().unwrap_or(0);
        assert!(lengths.all(|l| l == len), "columns of one length");
        Self { text, numbers, len }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True without any row.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// A text column.
    ///
    /// # Panics
    /// When there is none of this name: the schema is the program's own.
    pub fn text(&self, column: &str) -> &[String] {
        self.text
            .get(column)
            .unwrap_or_else(|| panic!("rows have no text column {column}"))
    }

    /// A column of numbers.
    ///
    /// # Panics
    /// When there is none of this name: the schema is the program's own.
    pub fn numbers(&self, column: &str) -> &[f64] {
        self.numbers
            .get(column)
            .unwrap_or_else(|| panic!("rows have no column {column} of numbers"))
    }

    /// True when the column is there.
    pub fn has(&self, column: &str) -> bool {
        self.text.contains_key(column) || self.numbers.contains_key(column)
    }

    /// The rows for whose index `keep` is true.
    pub fn filter(&self, keep: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.len).filter(|&i| keep(i)).collect();
        let pick = |(name, values): (&String, &Vec<f64>)| {
            (name.clone(), kept.iter().map(|&i| values[i]).collect())
        };
        Self {
            text: (self.text.iter())
                .map(|(name, values)| {
                    let values = kept.iter().map(|&i| values[i].clone()).collect();
                    (name.clone(), values)
                })
                .collect(),
            numbers: self.numbers.iter().map(pick).collect(),
            len: kept.len(),
        }
    }

    /// The rows with this text in a column.
    pub fn with(&self, column: &str, value: &str) -> Self {
        let values = self.text(column);
        self.filter(|i| values[i] == value)
    }

    /// The different texts of a column, in order of first appearance.
    pub fn distinct(&self, column: &str) -> Vec<String> {
        let mut seen: Vec<String> = Vec::new();
        for value in self.text(column) {
            if !seen.contains(value) {
                seen.push(value.clone());
            }
        }
        seen
    }
}

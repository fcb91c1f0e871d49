//! Reading a part back.

use super::{About, FORMAT, METADATA, PartError, checksum};
use crate::store::attempt::Attempt;
use crate::store::journal::places;
use crate::store::row::{Row, Value};
use crate::store::schema::{Kind, SCHEMA};
use polars::prelude::*;
use std::io::Cursor;
use std::path::Path;

/// A part that was read and is intact.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The attempts whose rows it holds, by number.
    pub attempts: Vec<Attempt>,
    pub rows: Vec<Row>,
}

/// Reads what a part says of itself, without its rows.
///
/// # Errors
/// When it cannot be read, is damaged, or another version wrote it.
pub fn read_about(path: &Path) -> Result<About, PartError> {
    Ok(open(path)?.1)
}

/// Reads a part and checks every byte of it.
///
/// # Errors
/// When it cannot be read, is damaged, or another version wrote it.
pub fn read(path: &Path) -> Result<Part, PartError> {
    let damaged = |problem: String| PartError::Damaged {
        path: path.to_owned(),
        problem,
    };
    let (reader, about) = open(path)?;
    let places = places(&about.columns).map_err(|problem| PartError::Foreign {
        path: path.to_owned(),
        problem,
    })?;
    let frame = reader
        .finish()
        .map_err(|error| damaged(error.to_string()))?;
    if frame.height() != about.rows {
        let found = frame.height();
        let expected = about.rows;
        return Err(damaged(format!("it has {found} rows, expected {expected}")));
    }
    let mut rows = vec![Row::default(); about.rows];
    for &place in &places {
        fill(&mut rows, &frame, place).map_err(|error| damaged(error.to_string()))?;
    }
    Ok(Part {
        attempts: about.attempts,
        rows,
    })
}

type Reader = ParquetReader<Cursor<Vec<u8>>>;

fn open(path: &Path) -> Result<(Reader, About), PartError> {
    let damaged = |problem: String| PartError::Damaged {
        path: path.to_owned(),
        problem,
    };
    let bytes = std::fs::read(path).map_err(|cause| PartError::Io {
        action: "read",
        path: path.to_owned(),
        cause,
    })?;
    let name = path.file_name().map(|name| name.to_string_lossy());
    let expected = checksum(&bytes);
    if name.as_deref().and_then(|name| name.split('.').nth(1)) != Some(expected.as_str()) {
        let problem =
            format!("its bytes have the checksum {expected}, which its name does not hold");
        return Err(damaged(problem));
    }
    let mut reader = ParquetReader::new(Cursor::new(bytes));
    let metadata = reader
        .get_metadata()
        .map_err(|error| damaged(error.to_string()))?
        .clone();
    let about = metadata
        .key_value_metadata()
        .iter()
        .flatten()
        .find(|entry| entry.key == METADATA)
        .and_then(|entry| entry.value.as_deref())
        .ok_or_else(|| damaged(format!("it has no metadata `{METADATA}`")))?;
    // The version first: the rest of another version may have another form.
    let value: serde_json::Value =
        serde_json::from_str(about).map_err(|error| damaged(error.to_string()))?;
    if value["format"] != FORMAT {
        return Err(PartError::Foreign {
            path: path.to_owned(),
            problem: format!("it has format {}, expected {FORMAT}", value["format"]),
        });
    }
    let about = serde_json::from_value(value).map_err(|error| damaged(error.to_string()))?;
    Ok((reader, about))
}

fn fill(rows: &mut [Row], frame: &DataFrame, place: usize) -> PolarsResult<()> {
    fn set<T: Into<Value>>(
        rows: &mut [Row],
        place: usize,
        values: impl Iterator<Item = Option<T>>,
    ) {
        for (row, value) in rows.iter_mut().zip(values) {
            row.values[place] = value.map(Into::into);
        }
    }
    let column = &SCHEMA.columns[place];
    let values = frame.column(&column.name)?;
    match column.kind {
        Kind::Text => set(rows, place, values.str()?.iter()),
        Kind::Integer => set(rows, place, values.i64()?.iter()),
        Kind::Number => set(rows, place, values.f64()?.iter()),
        Kind::Flag => set(rows, place, values.bool()?.iter()),
    }
    Ok(())
}

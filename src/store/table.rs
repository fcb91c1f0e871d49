//! Rows as one Parquet file.

use super::durable;
use super::row::{Row, Value};
use super::schema::{Kind, SCHEMA};
use polars::prelude::*;
use std::path::{Path, PathBuf};

/// A table that cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write the table {}: {cause}", path.display())]
pub struct TableError {
    path: PathBuf,
    #[source]
    cause: std::io::Error,
}

/// Writes rows, in their order, as Parquet with the schema's columns; the file is replaced at once or
/// stays as it was.
///
/// # Errors
/// When the file cannot be written.
pub fn write_parquet(path: &Path, rows: &[&Row]) -> Result<(), TableError> {
    let result = frame(rows).and_then(|mut frame| {
        durable::write(path, |out| {
            let written = ParquetWriter::new(out).finish(&mut frame);
            written.map(drop).map_err(std::io::Error::other)
        })
    });
    result.map_err(|cause| TableError {
        path: path.to_owned(),
        cause,
    })
}

/// Rows as columns.
pub(super) fn frame(rows: &[&Row]) -> std::io::Result<DataFrame> {
    let columns = SCHEMA.columns.iter().enumerate();
    let columns = columns.map(|(place, column)| column_of(rows, place, &column.name, column.kind));
    DataFrame::new(rows.len(), columns.collect()).map_err(std::io::Error::other)
}

fn column_of(rows: &[&Row], place: usize, name: &str, kind: Kind) -> Column {
    let values = rows.iter().map(|row| row.values[place].as_ref());
    // A row's values are of their column's kind: `Row::set` and the journal's reader see to it.
    match kind {
        Kind::Text => {
            let text = |value: &Value| match value {
                Value::Text(text) => Some(text.clone()),
                _ => None,
            };
            let values: Vec<Option<String>> = values.map(|v| v.and_then(text)).collect();
            Column::new(name.into(), values)
        }
        Kind::Integer => {
            let integer = |value: &Value| match value {
                Value::Integer(number) => Some(*number),
                _ => None,
            };
            let values: Vec<Option<i64>> = values.map(|v| v.and_then(integer)).collect();
            Column::new(name.into(), values)
        }
        Kind::Number => {
            let number = |value: &Value| match value {
                Value::Number(number) => Some(*number),
                _ => None,
            };
            let values: Vec<Option<f64>> = values.map(|v| v.and_then(number)).collect();
            Column::new(name.into(), values)
        }
        Kind::Flag => {
            let flag = |value: &Value| match value {
                Value::Flag(flag) => Some(*flag),
                _ => None,
            };
            let values: Vec<Option<bool>> = values.map(|v| v.and_then(flag)).collect();
            Column::new(name.into(), values)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_with_their_bits_and_gaps() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.parquet");
        let (mut a, mut b) = (Row::default(), Row::default());
        a.set("specimen", "phantom-1");
        a.set("true_lce_deg", 0.1 + 0.2);
        b.set("movement", 7u32);
        b.set("assigned_density", true);
        write_parquet(&path, &[&a, &b]).unwrap();

        let frame = ParquetReader::new(std::fs::File::open(&path).unwrap())
            .finish()
            .unwrap();
        assert_eq!((frame.height(), frame.width()), (2, SCHEMA.columns.len()));
        let number = frame.column("true_lce_deg").unwrap().f64().unwrap();
        assert_eq!((number.get(0), number.get(1)), (Some(0.1 + 0.2), None));
        let text = frame.column("specimen").unwrap().str().unwrap();
        assert_eq!((text.get(0), text.get(1)), (Some("phantom-1"), None));
        let movement = frame.column("movement").unwrap().i64().unwrap();
        assert_eq!(movement.get(1), Some(7));
        let flag = frame.column("assigned_density").unwrap().bool().unwrap();
        assert_eq!(flag.get(1), Some(true));
    }
}

//! Writing a part.

use super::{About, FORMAT, METADATA, PartError, checksum};
use crate::store::attempt::Attempt;
use crate::store::journal::todays_columns;
use crate::store::row::Row;
use crate::store::{durable, table};
use polars::prelude::{KeyValueMetadata, ParquetWriter};
use std::path::{Path, PathBuf};

/// Writes the rows of attempts into a part of `folder`, which is made if it is not there, and gives the
/// part's path. The part is there whole or not at all.
///
/// # Errors
/// When it cannot be written.
///
/// # Panics
/// Without any attempt.
pub fn write(folder: &Path, attempts: Vec<Attempt>, rows: &[Row]) -> Result<PathBuf, PartError> {
    write_format(folder, attempts, rows, FORMAT)
}

pub(super) fn write_format(
    folder: &Path,
    mut attempts: Vec<Attempt>,
    rows: &[Row],
    format: u32,
) -> Result<PathBuf, PartError> {
    attempts.sort_by_key(|attempt| attempt.attempt);
    let first = attempts.first().expect("a part holds an attempt").attempt;
    let last = attempts.last().expect("a part holds an attempt").attempt;
    let about = About {
        format,
        columns: todays_columns(),
        attempts,
        rows: rows.len(),
    };
    let about = serde_json::to_string(&about).expect("it is plain data");
    let metadata = KeyValueMetadata::from_static(vec![(METADATA.into(), about)]);
    let rows: Vec<&Row> = rows.iter().collect();
    let name = if first == last {
        format!("{first:04}")
    } else {
        format!("{first:04}-{last:04}")
    };
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |cause| PartError::Io {
            action: "write",
            path,
            cause,
        }
    };
    let mut bytes = Vec::new();
    table::frame(&rows)
        .and_then(|mut frame| {
            let writer = ParquetWriter::new(&mut bytes).with_key_value_metadata(Some(metadata));
            writer.finish(&mut frame).map_err(std::io::Error::other)
        })
        .map_err(failed(&folder.join(&name)))?;
    let path = folder.join(format!("{name}.{}.parquet", checksum(&bytes)));
    std::fs::create_dir_all(folder)
        .and_then(|()| durable::write(&path, |out| out.write_all(&bytes)))
        .map_err(failed(&path))?;
    Ok(path)
}

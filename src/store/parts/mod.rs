//! Parts: the rows of attempts that are over, as Parquet.
//!
//! `parts/0007.CHECKSUM.parquet` holds the rows of attempt 7, `parts/0001-0016.CHECKSUM.parquet` those of
//! several. A part is written once and never changed. The checksum is that of its bytes, so that what
//! was cut or changed is refused before anything tries to make sense of it; readers of Parquet end
//! the process on some such files. The metadata (key `pao_sim`) hold the format's version and the
//! attempts.

mod read;
mod write;

pub use read::{Part, read, read_about};
pub use write::write;

use super::attempt::Attempt;
use super::schema::Kind;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Version of the parts that this program writes and reads.
const FORMAT: u32 = 1;
/// Key of the metadata.
const METADATA: &str = "pao_sim";

/// What a part says of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    format: u32,
    /// Columns of the rows.
    columns: Vec<(String, Kind)>,
    /// The attempts whose rows it holds, by number.
    pub attempts: Vec<Attempt>,
    rows: usize,
}

/// A part that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PartError {
    #[error("cannot {action} {}: {cause}", path.display())]
    Io {
        action: &'static str,
        path: PathBuf,
        #[source]
        cause: std::io::Error,
    },
    #[error(
        "{} is damaged: {problem}; put back an intact copy of it, or move it away: `pao-sim run` then makes its rows again",
        path.display()
    )]
    Damaged { path: PathBuf, problem: String },
    #[error(
        "{} was written by another version of the program: {problem}; continue the study with the version that wrote it, or take another results folder",
        path.display()
    )]
    Foreign { path: PathBuf, problem: String },
}

impl PartError {
    /// True when the file is not there: it was merged into another one a moment ago.
    pub fn vanished(&self) -> bool {
        matches!(self, Self::Io { cause, .. } if cause.kind() == std::io::ErrorKind::NotFound)
    }
}

/// The checksum in a part's name: the first 16 hexadecimal digits of its bytes' BLAKE3.
fn checksum(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex()[..16].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::journal::Header;
    use crate::store::row::Row;
    use std::path::Path;

    fn attempts_of(path: &Path) -> String {
        let name = path.file_name().unwrap().to_string_lossy();
        name.split('.').next().unwrap().to_owned()
    }

    fn rows() -> Vec<Row> {
        let row = |number: u32| {
            let mut row = Row::default();
            row.set("specimen", "phantom-1");
            row.set("movement", number);
            row.set("true_lce_deg", f64::from(number) * 0.1 - 0.2);
            row.set("assigned_density", number == 1);
            row
        };
        let mut rows: Vec<Row> = (0..3).map(row).collect();
        rows[2].set("true_lce_deg", -0.0);
        rows[1].set("message", "line\nline, \"quoted\"");
        rows
    }

    fn attempt(number: u32, rows: usize) -> Attempt {
        let header = Header::new(number, (0, 1), serde_json::json!({"host": "here"}));
        let mut attempt = Attempt::begun(header, 17, false);
        attempt.rows = rows;
        attempt
    }

    #[test]
    fn attempts_and_rows_come_back_with_their_bits() {
        let folder = tempfile::tempdir().unwrap();
        let rows = rows();
        let path = write(folder.path(), vec![attempt(7, 3)], &rows).unwrap();
        assert_eq!(attempts_of(&path), "0007");
        let part = read(&path).unwrap();
        assert_eq!(part.attempts, [attempt(7, 3)]);
        assert_eq!(read_about(&path).unwrap().attempts, part.attempts);
        let equal = rows.iter().zip(&part.rows);
        assert!(equal.clone().all(|(a, b)| a.differences(b).is_empty()));
        assert_eq!(part.rows.len(), 3);
        let none = write(folder.path(), vec![attempt(2, 0), attempt(9, 0)], &[]).unwrap();
        assert_eq!(attempts_of(&none), "0002-0009");
        assert_eq!(read(&none).unwrap().rows, []);
    }

    /// No byte that is lost or changed goes unnoticed and none ends the program.
    #[test]
    fn a_cut_or_changed_part_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = write(folder.path(), vec![attempt(7, 3)], &rows()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let refused = |bytes: &[u8], what: &str| {
            std::fs::write(&path, bytes).unwrap();
            let message = read(&path).expect_err(what).to_string();
            assert!(message.contains("is damaged"), "{what}: {message}");
            assert!(read_about(&path).is_err(), "{what}");
        };
        for place in (0..bytes.len()).step_by(7) {
            refused(&bytes[..place], &format!("cut at {place}"));
            let mut changed = bytes.clone();
            changed[place] ^= 0x11;
            refused(&changed, &format!("changed at {place}"));
        }
        std::fs::write(&path, &bytes).unwrap();
        assert!(read(&path).is_ok());
    }

    #[test]
    fn a_newer_format_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let newer = write::write_format(folder.path(), vec![attempt(1, 3)], &rows(), 2).unwrap();
        let message = read(&newer).unwrap_err().to_string();
        assert!(message.contains("format 2, expected 1"), "{message}");
    }
}

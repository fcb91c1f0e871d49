//! Reading journals back.

use super::JournalError;
use super::frame::{self, MAGIC};
use super::record::{End, HEADER, Header, Record};
use crate::store::schema::{Kind, SCHEMA};
use std::io::Read;
use std::path::{Path, PathBuf};

/// What a journal holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Journal {
    pub path: PathBuf,
    /// `None` when the attempt ended before it had written one.
    pub header: Option<Header>,
    /// All whole records, in their order.
    pub records: Vec<Record>,
    /// Position behind the last whole record.
    pub good_bytes: u64,
    /// Bytes behind it: a record that was cut when the attempt ended, or damage.
    pub torn_bytes: u64,
}

impl Journal {
    /// How the attempt ended, if it did so in order.
    pub fn end(&self) -> Option<&End> {
        match self.records.last() {
            Some(Record::Ended(end)) => Some(end),
            _ => None,
        }
    }
}

/// Reads one journal.
///
/// # Errors
/// When it cannot be read, or another version of the program wrote it. A torn end is no error.
pub fn read(path: &Path) -> Result<Journal, JournalError> {
    let bytes = std::fs::read(path).map_err(|cause| JournalError::Io {
        action: "read",
        path: path.to_owned(),
        cause,
    })?;
    parse(&bytes, path)
}

/// The journal of a file's bytes.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Journal, JournalError> {
    let foreign = |problem: String| JournalError::Foreign {
        path: path.to_owned(),
        problem,
    };
    let mut journal = Journal {
        path: path.to_owned(),
        header: None,
        records: Vec::new(),
        good_bytes: 0,
        torn_bytes: bytes.len() as u64,
    };
    let opening = &bytes[..bytes.len().min(MAGIC.len())];
    if opening != &MAGIC[..opening.len()] {
        return Err(foreign(format!(
            "it opens with {opening:?}, expected {MAGIC:?}"
        )));
    }
    let mut position = MAGIC.len();
    let Some((HEADER, payload, length)) = bytes.get(position..).and_then(frame::read) else {
        return Ok(journal);
    };
    let header: Header = serde_json::from_slice(payload)
        .map_err(|error| foreign(format!("its header cannot be read ({error})")))?;
    position += length;
    let columns = places(&header.columns).map_err(foreign)?;
    while let Some((kind, payload, length)) = frame::read(&bytes[position..]) {
        // A whole frame that makes no sense was not torn: it is another version's.
        let record = Record::decode(kind, payload, &columns).ok_or_else(|| {
            foreign(format!(
                "the record at byte {position} is of an unknown form (kind {kind})"
            ))
        })?;
        journal.records.push(record);
        position += length;
    }
    journal.header = Some(header);
    journal.good_bytes = position as u64;
    journal.torn_bytes = (bytes.len() - position) as u64;
    Ok(journal)
}

/// Today's places of stored columns. A column that is new since then stays empty; one that is gone or
/// holds another kind cannot be read.
pub(in crate::store) fn places(columns: &[(String, Kind)]) -> Result<Vec<usize>, String> {
    let place = |(name, kind): &(String, _)| match SCHEMA.place(name) {
        Some(place) if SCHEMA.columns[place].kind == *kind => Ok(place),
        _ => Err(format!(
            "it has a column {name} ({kind:?}) that is not known"
        )),
    };
    columns.iter().map(place).collect()
}

/// Reads the header of a journal alone; `None` when its attempt ended before it had written one.
///
/// # Errors
/// As [`read`].
pub fn read_header(path: &Path) -> Result<Option<Header>, JournalError> {
    let io = |cause| JournalError::Io {
        action: "read",
        path: path.to_owned(),
        cause,
    };
    let mut file = std::fs::File::open(path).map_err(io)?;
    let mut start = Vec::new();
    let opening = MAGIC.len() as u64 + 4;
    (&mut file)
        .take(opening)
        .read_to_end(&mut start)
        .map_err(io)?;
    if let Some(Ok(length)) = start.get(MAGIC.len()..).map(<[u8; 4]>::try_from) {
        // The rest of the header's frame: kind, payload and checksum.
        file.take(u64::from(u32::from_le_bytes(length)) + 5)
            .read_to_end(&mut start)
            .map_err(io)?;
    }
    Ok(parse(&start, path)?.header)
}

/// Reads every journal of a folder in the order of their numbers. A folder that is not there holds
/// none.
///
/// # Errors
/// As [`read`].
pub fn read_all(folder: &Path) -> Result<Vec<Journal>, JournalError> {
    numbered(folder)?
        .into_iter()
        .map(|(_, path)| read(&path))
        .collect()
}

/// The journals of a folder with their numbers, ascending.
pub(in crate::store) fn numbered(folder: &Path) -> Result<Vec<(u32, PathBuf)>, JournalError> {
    let failed = |cause| JournalError::Io {
        action: "list",
        path: folder.to_owned(),
        cause,
    };
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries.map_err(failed)?,
    };
    let mut found = Vec::new();
    for entry in entries {
        let path = entry.map_err(failed)?.path();
        let number = path
            .file_name()
            .and_then(|name| name.to_str()?.strip_suffix(".journal")?.parse().ok());
        if let Some(number) = number {
            found.push((number, path));
        }
    }
    found.sort();
    Ok(found)
}

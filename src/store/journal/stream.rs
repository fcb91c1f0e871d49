//! Records that go from one process to another.

use super::frame;
use super::record::Record;
use super::write::Writer;
use super::{JournalError, todays_columns};
use crate::store::journal::places;
use std::io::{self, Read, Write};
use std::path::PathBuf;

/// What takes the records of a run.
pub trait Sink: Send {
    /// Takes a record.
    ///
    /// # Errors
    /// When it cannot be written; the records before stay whole.
    fn append(&mut self, record: &Record) -> Result<(), JournalError>;

    /// Makes records durable when it is time to.
    ///
    /// # Errors
    /// When the disk reports one.
    fn sync_if_due(&mut self) -> Result<(), JournalError>;
}

impl Sink for Writer {
    fn append(&mut self, record: &Record) -> Result<(), JournalError> {
        Self::append(self, record)
    }

    fn sync_if_due(&mut self) -> Result<(), JournalError> {
        Self::sync_if_due(self)
    }
}

/// Writes records for [`read_stream`]; both ends are the same program.
#[derive(Debug)]
pub struct StreamWriter<W>(pub W);

impl<W: Write + Send> Sink for StreamWriter<W> {
    fn append(&mut self, record: &Record) -> Result<(), JournalError> {
        let (kind, payload) = record.encode();
        let mut bytes = Vec::with_capacity(payload.len() + 16);
        frame::write(&mut bytes, kind, &payload);
        let written = self.0.write_all(&bytes).and_then(|()| self.0.flush());
        written.map_err(|cause| JournalError::Io {
            action: "write",
            path: PathBuf::from("the stream of records"),
            cause,
        })
    }

    fn sync_if_due(&mut self) -> Result<(), JournalError> {
        Ok(())
    }
}

/// Hands on each whole record of a stream until its end. A torn one at the end is dropped.
///
/// # Errors
/// When reading fails, or the bytes are no records.
pub fn read_stream(mut stream: impl Read, mut on: impl FnMut(Record)) -> io::Result<()> {
    let columns = todays_columns();
    let places = places(&columns).expect("today's columns have places");
    let (mut bytes, mut chunk) = (Vec::new(), vec![0; 1 << 16]);
    loop {
        let count = match stream.read(&mut chunk) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            count => count?,
        };
        if count == 0 {
            return Ok(());
        }
        bytes.extend_from_slice(&chunk[..count]);
        let mut position = 0;
        while let Some((kind, payload, length)) = frame::read(&bytes[position..]) {
            let record = Record::decode(kind, payload, &places)
                .ok_or_else(|| io::Error::other(format!("no record of kind {kind}")))?;
            on(record);
            position += length;
        }
        bytes.drain(..position);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_come_through_and_a_torn_end_is_dropped() {
        let records = [
            Record::Started("a".into()),
            Record::Row(Box::default()),
            Record::Finished("a".into()),
        ];
        let mut bytes = Vec::new();
        for record in &records {
            StreamWriter(&mut bytes).append(record).unwrap();
        }
        for cut in [0, 1, 9] {
            let mut found = Vec::new();
            read_stream(&bytes[..bytes.len() - cut], |record| found.push(record)).unwrap();
            assert_eq!(found, records[..if cut == 0 { 3 } else { 2 }]);
        }
    }
}

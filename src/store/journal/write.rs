//! Writing a journal.

use super::JournalError;
use super::frame::{self, MAGIC};
use super::read::numbered;
use super::record::{HEADER, Header, Record};
use crate::store::durable::sync_folder;
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// The journal of the running attempt. A record that [`Writer::append`] has taken survives the end of
/// the process; it survives the end of the machine once it is synced, at most [`SYNC_EVERY`] later
/// when [`Writer::sync_if_due`] is called often enough.
#[derive(Debug)]
pub struct Writer {
    file: File,
    path: PathBuf,
    attempt: u32,
    /// Length of the whole records.
    length: u64,
    synced: u64,
    last_sync: Instant,
    last_sign: Instant,
}

/// How long a record may wait for the disk.
pub const SYNC_EVERY: Duration = Duration::from_secs(2);
/// How often a journal to which nothing is written is touched, as a sign that its attempt lives.
const SIGN_EVERY: Duration = Duration::from_secs(30);

impl Writer {
    /// Opens the journal of a new attempt: the first free number of `folder` from `first` on. The folder
    /// is made if it is not there. Several processes may do this at once. The journal stays locked
    /// as long as the writer lives, which tells others that the attempt does.
    ///
    /// # Errors
    /// When the folder or file cannot be written.
    pub fn create(
        folder: &Path,
        first: u32,
        share: (u32, u32),
        provenance: serde_json::Value,
    ) -> Result<Self, JournalError> {
        std::fs::create_dir_all(folder).map_err(io("create", folder))?;
        let mut attempt = numbered(folder)?
            .last()
            .map_or(first, |(number, _)| first.max(number + 1));
        loop {
            let path = folder.join(format!("{attempt:04}.journal"));
            match OpenOptions::new().append(true).create_new(true).open(&path) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => attempt += 1,
                Err(cause) => return Err(io("create", &path)(cause)),
                Ok(file) => {
                    return Self::begin(file, path, Header::new(attempt, share, provenance));
                }
            }
        }
    }

    fn begin(file: File, path: PathBuf, header: Header) -> Result<Self, JournalError> {
        // Whoever looks whether it is locked holds it for a moment only. On a file system without locks
        // the time of the last change tells that the attempt lives.
        let _ = file.lock();
        let mut writer = Self {
            file,
            path,
            attempt: header.attempt,
            length: 0,
            synced: 0,
            last_sync: Instant::now(),
            last_sign: Instant::now(),
        };
        let header = serde_json::to_vec(&header).expect("a header is plain data");
        let mut bytes = MAGIC.to_vec();
        frame::write(&mut bytes, HEADER, &header);
        writer.write(&bytes)?;
        writer.sync()?;
        let folder = writer.path.parent().unwrap_or(Path::new("."));
        sync_folder(folder).map_err(io("sync", folder))?;
        Ok(writer)
    }

    /// Number of the attempt, from 1.
    pub fn attempt(&self) -> u32 {
        self.attempt
    }

    /// Where the journal lies.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Hands a record to the operating system.
    ///
    /// # Errors
    /// When it cannot be written, on a full disk for instance; the records before stay whole.
    pub fn append(&mut self, record: &Record) -> Result<(), JournalError> {
        let (kind, payload) = record.encode();
        let mut bytes = Vec::with_capacity(payload.len() + 16);
        frame::write(&mut bytes, kind, &payload);
        self.write(&bytes)?;
        self.sync_if_due()
    }

    /// Syncs when there is something to sync and the last time was [`SYNC_EVERY`] ago.
    ///
    /// # Errors
    /// When the disk reports one.
    pub fn sync_if_due(&mut self) -> Result<(), JournalError> {
        if self.synced < self.length && self.last_sync.elapsed() >= SYNC_EVERY {
            self.sync()?;
        }
        if self.last_sign.elapsed() >= SIGN_EVERY {
            self.last_sign = Instant::now();
            let touched = self.file.set_modified(SystemTime::now());
            touched.map_err(io("touch", &self.path))?;
        }
        Ok(())
    }

    /// Waits until every record is on the disk.
    ///
    /// # Errors
    /// When the disk reports one.
    pub fn sync(&mut self) -> Result<(), JournalError> {
        self.file.sync_data().map_err(io("sync", &self.path))?;
        self.synced = self.length;
        self.last_sync = Instant::now();
        Ok(())
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), JournalError> {
        #[cfg(feature = "fail-points")]
        let bytes = {
            let (half, rest) = bytes.split_at(bytes.len() / 2);
            self.file.write_all(half).map_err(io("write", &self.path))?;
            self.length += half.len() as u64;
            crate::fail_point!("journal.half_written");
            rest
        };
        if let Err(cause) = self.file.write_all(bytes) {
            // What was written of it would hide every record behind it. When cutting it off fails
            // too, the reader still finds the whole records before it.
            let _ = self.file.set_len(self.length);
            return Err(io("write", &self.path)(cause));
        }
        self.length += bytes.len() as u64;
        Ok(())
    }
}

fn io(action: &'static str, path: &Path) -> impl FnOnce(std::io::Error) -> JournalError {
    let path = path.to_owned();
    move |cause| JournalError::Io {
        action,
        path,
        cause,
    }
}

#[cfg(test)]
mod tests {
    use super::super::read::{parse, read, read_all, read_header};
    use super::super::record::End;
    use super::*;
    use crate::store::Row;
    use serde_json::json;

    fn row(number: u32) -> Record {
        let mut row = Row::default();
        row.set("specimen", "phantom-1");
        row.set("fragment", number);
        row.set("rotation_error_deg", 0.1 * f64::from(number));
        row.set("view1_cmaes_capped", number.is_multiple_of(2));
        Record::Row(Box::new(row))
    }

    fn records() -> Vec<Record> {
        vec![
            Record::Started("phantom-1/left/f00/m00".into()),
            row(0),
            Record::Finished("phantom-1/left/f00/m00".into()),
            row(1),
            row(2),
            Record::Crashed {
                key: "phantom-1/left/f00/m01".into(),
                how: "signal 11".into(),
            },
            Record::Ended(End::default()),
        ]
    }

    /// Writes the records and gives the length of the file after each of them, the header first.
    fn written(folder: &Path) -> (PathBuf, Vec<u64>) {
        let mut writer = Writer::create(folder, 1, (0, 1), json!({"host": "here"})).unwrap();
        let mut lengths = vec![writer.length];
        for record in records() {
            writer.append(&record).unwrap();
            lengths.push(writer.length);
        }
        (writer.path, lengths)
    }

    #[test]
    fn records_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let (path, lengths) = written(folder.path());
        let journal = read(&path).unwrap();
        assert_eq!(journal.records, records());
        assert_eq!(journal.header.as_ref().unwrap().attempt, 1);
        assert_eq!(journal.header.as_ref().unwrap().provenance["host"], "here");
        assert_eq!((journal.good_bytes, journal.torn_bytes), (lengths[7], 0));
        assert_eq!(journal.end(), Some(&End::default()));
    }

    #[test]
    fn a_cut_at_any_byte_loses_the_torn_record_only() {
        let folder = tempfile::tempdir().unwrap();
        let (path, lengths) = written(folder.path());
        let bytes = std::fs::read(&path).unwrap();
        for length in 0..bytes.len() {
            let journal = parse(&bytes[..length], &path).unwrap();
            let whole = lengths.iter().filter(|&&end| end <= length as u64).count();
            assert_eq!(journal.header.is_some(), whole > 0, "cut at {length}");
            let expected = &records()[..whole.saturating_sub(1)];
            assert_eq!(journal.records, expected, "cut at {length}");
            let good = whole.checked_sub(1).map_or(0, |last| lengths[last]);
            assert_eq!(journal.good_bytes, good, "cut at {length}");
            assert_eq!(journal.torn_bytes, length as u64 - good, "cut at {length}");
            std::fs::write(&path, &bytes[..length]).unwrap();
            assert_eq!(
                read_header(&path).unwrap(),
                journal.header,
                "cut at {length}"
            );
        }
    }

    #[test]
    fn a_damaged_byte_ends_the_reading_before_its_record() {
        let folder = tempfile::tempdir().unwrap();
        let (path, lengths) = written(folder.path());
        let bytes = std::fs::read(&path).unwrap();
        for place in lengths[0] as usize..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[place] ^= 0x10;
            let journal = parse(&damaged, &path).unwrap();
            let whole = lengths.iter().filter(|&&end| end <= place as u64).count() - 1;
            assert_eq!(journal.records, &records()[..whole], "damaged at {place}");
        }
    }

    #[test]
    fn attempts_are_numbered_and_read_in_order() {
        let folder = tempfile::tempdir().unwrap();
        for expected in 1..=3 {
            let writer = Writer::create(folder.path(), 1, (0, 1), json!({})).unwrap();
            assert_eq!(writer.attempt(), expected);
        }
        let all = read_all(folder.path()).unwrap();
        let attempts: Vec<u32> = all
            .iter()
            .map(|j| j.header.as_ref().unwrap().attempt)
            .collect();
        assert_eq!(attempts, [1, 2, 3]);
        assert_eq!(read_all(&folder.path().join("none")).unwrap(), []);
    }

    #[test]
    fn what_another_version_wrote_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("0001.journal");
        std::fs::write(&path, b"PAO-SIM\x07and more").unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(
            message.contains("is no journal of this version"),
            "{message}"
        );

        let mut header = Header::new(1, (0, 1), json!({}));
        header
            .columns
            .push(("colour".into(), crate::store::Kind::Text));
        let mut bytes = MAGIC.to_vec();
        frame::write(&mut bytes, HEADER, &serde_json::to_vec(&header).unwrap());
        std::fs::write(&path, bytes).unwrap();
        let message = read(&path).unwrap_err().to_string();
        assert!(
            message.contains("a column colour (Text) that is not known"),
            "{message}"
        );
    }

    /// A journal of an earlier schema: fewer columns, in another order.
    #[test]
    fn columns_are_found_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("0001.journal");
        let header = Header {
            attempt: 1,
            share: (0, 1),
            columns: vec![
                ("rotation_error_deg".into(), crate::store::Kind::Number),
                ("specimen".into(), crate::store::Kind::Text),
            ],
            provenance: json!({}),
        };
        let mut bytes = MAGIC.to_vec();
        frame::write(&mut bytes, HEADER, &serde_json::to_vec(&header).unwrap());
        let mut payload = vec![3];
        payload.extend(2.5f64.to_le_bytes());
        payload.extend([1, 1, 0, 0, 0, b'a']);
        frame::write(&mut bytes, 3, &payload);
        std::fs::write(&path, bytes).unwrap();
        let journal = read(&path).unwrap();
        let Record::Row(row) = &journal.records[0] else {
            panic!("{:?}", journal.records)
        };
        assert_eq!(
            (row.number("rotation_error_deg"), row.text("specimen")),
            (Some(2.5), "a")
        );
    }
}

//! A volume file's bytes. Nothing here allocates by what a header claims: buffers grow with what is
//! really read, so a header's large number costs no more than the file behind it.

use super::{Volume, VolumeFileError, Voxel};
use crate::volume::Grid;
use crate::volume::samples::{SampleType, voxel_of};
use std::fs::File;
use std::io::{BufRead, BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes that a text header may have; Slicer's with a hundred segments have a tenth.
const MAX_HEADER_BYTES: u64 = 1 << 20;

/// An error of the disk while `path` was read.
pub(super) fn unreadable(path: &Path) -> impl Fn(std::io::Error) -> VolumeFileError {
    let path = path.to_path_buf();
    move |source| VolumeFileError::Io {
        doing: "read",
        path: path.clone(),
        source,
    }
}

/// Opens a file. What is no regular file (a folder, a pipe, a device) is refused: it might never end.
pub(super) fn open(path: &Path) -> Result<BufReader<File>, VolumeFileError> {
    let io = unreadable(path);
    if !std::fs::metadata(path).map_err(&io)?.is_file() {
        let reason = "it is no regular file";
        return Err(io(std::io::Error::new(ErrorKind::InvalidInput, reason)));
    }
    File::open(path).map(BufReader::new).map_err(io)
}

/// True when what comes next starts with these few bytes.
pub(super) fn starts_with(
    stream: &mut dyn BufRead,
    bytes: &[u8],
    path: &Path,
) -> Result<bool, VolumeFileError> {
    let start = stream.fill_buf().map_err(unreadable(path))?;
    Ok(start.starts_with(bytes))
}

/// True when what comes next starts as gzip does.
pub(super) fn is_gzip(stream: &mut dyn BufRead, path: &Path) -> Result<bool, VolumeFileError> {
    starts_with(stream, &[0x1f, 0x8b], path)
}

/// Lines of a text header.
#[derive(Debug)]
pub(super) struct HeaderLines<'a> {
    path: &'a Path,
    /// What it is read as, for messages.
    format: &'static str,
    left: u64,
}

impl<'a> HeaderLines<'a> {
    pub fn new(path: &'a Path, format: &'static str) -> Self {
        Self {
            path,
            format,
            left: MAX_HEADER_BYTES,
        }
    }

    /// The next line without its end, or `None` after the last.
    pub fn next(&mut self, stream: &mut dyn BufRead) -> Result<Option<String>, VolumeFileError> {
        let mut line = Vec::new();
        let read = stream
            .take(self.left)
            .read_until(b'\n', &mut line)
            .map_err(unreadable(self.path))?;
        self.left -= read as u64;
        if self.left == 0 {
            return Err(VolumeFileError::Format {
                path: self.path.into(),
                format: self.format,
                reason: format!("its header does not end within {MAX_HEADER_BYTES} bytes"),
            });
        }
        if line.is_empty() {
            return Ok(None);
        }
        let text = String::from_utf8_lossy(&line);
        Ok(Some(text.trim_end_matches(['\n', '\r']).to_owned()))
    }
}

/// Passes over so many bytes, or all there are.
pub(super) fn skip_bytes(
    stream: &mut dyn Read,
    bytes: u64,
    path: &Path,
) -> Result<(), VolumeFileError> {
    match std::io::copy(&mut stream.take(bytes), &mut std::io::sink()) {
        Err(error) if error.kind() != ErrorKind::UnexpectedEof => Err(unreadable(path)(error)),
        // What is missing will be missed by whoever reads on.
        _ => Ok(()),
    }
}

/// Moves to where the last `bytes` of a file start, or to the start of a shorter one.
pub(super) fn skip_to_last(
    file: &mut BufReader<File>,
    bytes: u64,
    path: &Path,
) -> Result<(), VolumeFileError> {
    let length = file.get_ref().metadata().map_err(unreadable(path))?.len();
    skip_to(file, length.saturating_sub(bytes), path)
}

/// Moves to a byte of a file, counted from its start.
pub(super) fn skip_to(
    file: &mut BufReader<File>,
    byte: u64,
    path: &Path,
) -> Result<(), VolumeFileError> {
    file.seek(SeekFrom::Start(byte))
        .map(|_| ())
        .map_err(unreadable(path))
}

/// Passes over so many lines, or all there are.
pub(super) fn skip_lines(
    stream: &mut dyn BufRead,
    lines: u64,
    path: &Path,
) -> Result<(), VolumeFileError> {
    for _ in 0..lines {
        if stream.skip_until(b'\n').map_err(unreadable(path))? == 0 {
            break;
        }
    }
    Ok(())
}

/// Bytes of a grid's raw values.
///
/// # Errors
/// When their number is beyond any file's.
pub(super) fn raw_bytes(
    dims: [usize; 3],
    kind: SampleType,
    path: &Path,
) -> Result<u64, VolumeFileError> {
    dims.iter()
        .try_fold(kind.size(), |bytes, &d| bytes.checked_mul(d))
        .filter(|&bytes| bytes <= isize::MAX as usize)
        .map(|bytes| bytes as u64)
        .ok_or_else(|| VolumeFileError::TooLarge {
            path: path.into(),
            dims,
        })
}

/// The next `expected` bytes.
///
/// # Errors
/// When there are fewer.
pub(super) fn read_raw(
    stream: &mut dyn Read,
    expected: u64,
    path: &Path,
) -> Result<Vec<u8>, VolumeFileError> {
    let mut raw = Vec::new();
    // A compressed stream that was cut off ends with an error rather than quietly.
    if let Err(error) = stream.take(expected).read_to_end(&mut raw)
        && error.kind() != ErrorKind::UnexpectedEof
    {
        return Err(unreadable(path)(error));
    }
    if raw.len() as u64 != expected {
        return Err(VolumeFileError::Truncated {
            path: path.into(),
            found: raw.len() as u64,
            expected,
        });
    }
    Ok(raw)
}

/// The volume of numbers that are written as text with white space between them, i fastest.
///
/// # Errors
/// When one is no number or none that `T` can hold, or there are too few.
pub(super) fn read_text<T: Voxel>(
    grid: Grid,
    stream: &mut dyn Read,
    (path, format): (&Path, &'static str),
) -> Result<Volume<T>, VolumeFileError> {
    let not_text = |reason: String| VolumeFileError::Format {
        path: path.into(),
        format,
        reason,
    };
    let mut text = Vec::new();
    stream.read_to_end(&mut text).map_err(unreadable(path))?;
    let words = text
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty());
    let mut data = Vec::new();
    for word in words.take(grid.len()) {
        let number = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        let value: f64 = number.ok_or_else(|| {
            let voxel = grid.voxel(data.len());
            let start = String::from_utf8_lossy(&word[..word.len().min(40)]);
            not_text(format!("voxel {voxel:?} is '{start}', which is no number"))
        })?;
        data.push(voxel_of(value, &grid, data.len(), path)?);
    }
    if data.len() != grid.len() {
        let (found, expected) = (data.len(), grid.len());
        return Err(not_text(format!(
            "it holds {found} numbers, {expected} expected; copy it again"
        )));
    }
    Ok(Volume::new(grid, data))
}

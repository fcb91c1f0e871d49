//! The attributes of one DICOM file, and where its pixels lie.

use super::meta::{Meta, has_magic};
use super::problem::DicomProblem;
use super::syntax::Syntax;
use super::walk::walk;
use crate::volume::VolumeFileError;
use dicom_core::{DataDictionary, PrimitiveValue, Tag};
use dicom_dictionary_std::StandardDataDictionary;
use flate2::read::DeflateDecoder;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// More than any slice: what a deflated file may become in memory. Deflate shrinks to a thousandth,
/// so a small file could claim a large memory.
const MAX_INFLATED_BYTES: u64 = 1 << 28;

/// What a data set is read from: a file, or what a deflated one became.
pub(super) trait Source: Read + Seek {}
impl<T: Read + Seek> Source for T {}

/// Where the pixels begin in the [`Source`], after the header of PixelData.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelData {
    pub offset: u64,
    /// `None` where they are encapsulated.
    pub length: Option<u64>,
}

/// What is known of one file.
#[derive(Debug)]
pub(super) struct DataSet {
    pub path: PathBuf,
    /// Bytes of the file, or of what it was inflated to.
    pub bytes: u64,
    pub syntax: Syntax,
    pub pixels: PixelData,
    values: BTreeMap<Tag, PrimitiveValue>,
}

/// What a file is.
#[derive(Debug)]
pub(super) enum Opened {
    NotDicom,
    /// A DICOM object without pixels: a DICOMDIR, a structure set, a report.
    NoImage,
    Image(Box<DataSet>),
}

impl DataSet {
    /// Reads the attributes of a file.
    ///
    /// # Errors
    /// When it cannot be read, is broken, in a transfer syntax that is not read, or a CT image
    /// that ends before its pixels.
    pub fn open(path: &Path) -> Result<Opened, VolumeFileError> {
        let mut file = open_file(path)?;
        if !has_magic(&mut file).map_err(|e| io(path, e))? {
            return Ok(Opened::NotDicom);
        }
        let meta = Meta::read(&mut file).map_err(|p| p.at(path))?;
        if meta.is_directory() {
            return Ok(Opened::NoImage);
        }
        let syntax = meta.syntax().map_err(|p| p.at(path))?;
        let (mut source, bytes) = after_meta(file, syntax, path)?;
        let walked = walk(&mut source, syntax, bytes).map_err(|p| p.at(path))?;
        let Some(pixels) = walked.pixels else {
            if meta.is_ct(&walked.values) {
                return Err(DicomProblem::Structure(
                    "it is a CT image and ends before its PixelData (7FE0,0010)".into(),
                )
                .at(path));
            }
            return Ok(Opened::NoImage);
        };
        Ok(Opened::Image(Box::new(Self {
            path: path.into(),
            bytes,
            syntax,
            pixels,
            values: walked.values,
        })))
    }

    /// The source again, placed at the first byte of the pixels.
    pub fn pixel_source(&self) -> Result<Box<dyn Source>, VolumeFileError> {
        let mut file = open_file(&self.path)?;
        if self.syntax == Syntax::Deflated {
            Meta::read(&mut file).map_err(|p| p.at(&self.path))?;
        }
        let (mut source, _) = after_meta(file, self.syntax, &self.path)?;
        source
            .seek(SeekFrom::Start(self.pixels.offset))
            .map_err(|e| io(&self.path, e))?;
        Ok(source)
    }

    /// A text without its padding, or `None` where it is absent or empty. Several values are
    /// separated by a backslash.
    pub fn text(&self, tag: Tag) -> Option<String> {
        let text = self.values.get(&tag)?.to_str();
        let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
        (!text.is_empty()).then(|| text.to_owned())
    }

    /// A whole number, or `None` where it is absent or empty.
    ///
    /// # Errors
    /// When it is no whole number.
    pub fn whole(&self, tag: Tag) -> Result<Option<i64>, VolumeFileError> {
        let Some(text) = self.text(tag) else {
            return Ok(None);
        };
        let value = self.values[&tag].to_int::<i64>();
        value
            .map(Some)
            .map_err(|_| self.unexpected(tag, &text, "a whole number"))
    }

    /// The numbers of an attribute, or `None` where it is absent or empty.
    ///
    /// # Errors
    /// When they are not `N` finite numbers.
    pub fn numbers<const N: usize>(&self, tag: Tag) -> Result<Option<[f64; N]>, VolumeFileError> {
        let Some(text) = self.text(tag) else {
            return Ok(None);
        };
        let numbers = self.values[&tag].to_multi_float64().ok();
        let numbers = numbers.and_then(|n| <[f64; N]>::try_from(n).ok());
        match numbers {
            Some(numbers) if numbers.iter().all(|n| n.is_finite()) => Ok(Some(numbers)),
            _ => Err(self.unexpected(tag, &text, &format!("{N} finite numbers"))),
        }
    }

    /// True when the attribute is there, with a value or without.
    pub fn has(&self, tag: Tag) -> bool {
        self.values.contains_key(&tag)
    }

    /// The error of an attribute that is not there.
    pub fn missing(&self, tag: Tag, advice: &'static str) -> VolumeFileError {
        let attribute = attribute(tag);
        DicomProblem::Missing { attribute, advice }.at(&self.path)
    }

    /// The error of an attribute with another value than is read.
    pub fn unexpected(&self, tag: Tag, found: &str, expected: &str) -> VolumeFileError {
        DicomProblem::Attribute {
            attribute: attribute(tag),
            found: found.into(),
            expected: expected.into(),
        }
        .at(&self.path)
    }
}

/// Keyword and tag of an attribute: `Rows (0028,0010)`.
pub(super) fn attribute(tag: Tag) -> String {
    let keyword = StandardDataDictionary
        .by_tag(tag)
        .map_or("element", |entry| entry.alias);
    format!("{keyword} {tag}")
}

pub(super) fn io(path: &Path, source: std::io::Error) -> VolumeFileError {
    VolumeFileError::Io {
        doing: "read",
        path: path.into(),
        source,
    }
}

fn open_file(path: &Path) -> Result<BufReader<File>, VolumeFileError> {
    File::open(path)
        .map(BufReader::new)
        .map_err(|e| io(path, e))
}

/// What the data set is read from, at its first byte, and its length in bytes.
fn after_meta(
    mut file: BufReader<File>,
    syntax: Syntax,
    path: &Path,
) -> Result<(Box<dyn Source>, u64), VolumeFileError> {
    if syntax != Syntax::Deflated {
        let bytes = file.get_ref().metadata().map_err(|e| io(path, e))?.len();
        return Ok((Box::new(file), bytes));
    }
    let mut inflated = Vec::new();
    DeflateDecoder::new(&mut file)
        .take(MAX_INFLATED_BYTES + 1)
        .read_to_end(&mut inflated)
        .map_err(|e| DicomProblem::Structure(format!("it does not inflate ({e})")).at(path))?;
    if inflated.len() as u64 > MAX_INFLATED_BYTES {
        let reason = format!("it inflates to more than {MAX_INFLATED_BYTES} bytes");
        return Err(DicomProblem::Structure(reason).at(path));
    }
    let bytes = inflated.len() as u64;
    Ok((Box::new(Cursor::new(inflated)), bytes))
}

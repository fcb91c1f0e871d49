//! The attributes of one DICOM file, and where its pixels lie.

use super::problem::DicomProblem;
use super::syntax::Syntax;
use crate::volume::VolumeFileError;
use dicom_core::header::{DataElementHeader, Header};
use dicom_core::{DataDictionary, PrimitiveValue, Tag};
use dicom_dictionary_std::{StandardDataDictionary, tags, uids};
use dicom_parser::StatefulDecode;
use dicom_parser::dataset::LazyDataToken;
use dicom_parser::dataset::lazy_read::LazyDataSetReader;
use flate2::read::DeflateDecoder;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Cursor, ErrorKind, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// The attributes that are kept.
const WANTED: [Tag; 27] = [
    tags::SPECIFIC_CHARACTER_SET,
    tags::IMAGE_TYPE,
    tags::SOP_CLASS_UID,
    tags::MODALITY,
    tags::SERIES_DESCRIPTION,
    tags::SERIES_INSTANCE_UID,
    tags::IMAGE_POSITION_PATIENT,
    tags::IMAGE_ORIENTATION_PATIENT,
    tags::FRAME_OF_REFERENCE_UID,
    tags::SAMPLES_PER_PIXEL,
    tags::PHOTOMETRIC_INTERPRETATION,
    tags::NUMBER_OF_FRAMES,
    tags::ROWS,
    tags::COLUMNS,
    tags::PIXEL_SPACING,
    tags::BITS_ALLOCATED,
    tags::BITS_STORED,
    tags::HIGH_BIT,
    tags::PIXEL_REPRESENTATION,
    tags::PIXEL_PADDING_VALUE,
    tags::PIXEL_PADDING_RANGE_LIMIT,
    tags::RESCALE_INTERCEPT,
    tags::RESCALE_SLOPE,
    tags::RESCALE_TYPE,
    tags::LOSSY_IMAGE_COMPRESSION,
    tags::MODALITY_LUT_SEQUENCE,
    tags::PIXEL_DATA,
];

/// Longer than any value of the kept attributes, in bytes.
const MAX_VALUE_BYTES: u64 = 1 << 16;

/// More than any slice: what a deflated file may become in memory. Deflate shrinks to a thousandth,
/// so a small file could claim a large memory.
const MAX_INFLATED_BYTES: u64 = 1 << 28;

/// Bytes before `DICM`.
const PREAMBLE_BYTES: u64 = 128;

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

/// Whether a file says that it is DICOM; then the next byte read is the first of its meta group.
fn has_magic(file: &mut BufReader<File>) -> std::io::Result<bool> {
    let mut start = Vec::new();
    file.take(PREAMBLE_BYTES + 4).read_to_end(&mut start)?;
    Ok(start.get(PREAMBLE_BYTES as usize..) == Some(b"DICM".as_slice()))
}

/// What the meta group says, always in explicit VR little endian.
#[derive(Debug, Default)]
struct Meta {
    sop_class: String,
    transfer_syntax: String,
}

impl Meta {
    /// Reads the group from its first byte, or from the file's, to its end. Its length is not
    /// relied upon: some writers leave it out or wrong.
    fn read(file: &mut BufReader<File>) -> Result<Self, DicomProblem> {
        let broken = |e: std::io::Error| match e.kind() {
            ErrorKind::UnexpectedEof => {
                DicomProblem::Structure("it ends inside its meta group (0002,xxxx)".into())
            }
            _ => DicomProblem::Structure(e.to_string()),
        };
        file.seek(SeekFrom::Start(PREAMBLE_BYTES + 4))
            .map_err(broken)?;
        let mut meta = Self::default();
        loop {
            let mut start = [0; 8];
            file.read_exact(&mut start).map_err(broken)?;
            let [g0, g1, e0, e1, v0, v1, l0, l1] = start;
            if u16::from_le_bytes([g0, g1]) != 0x0002 {
                file.seek_relative(-8).map_err(broken)?;
                return Ok(meta);
            }
            let length = match [v0, v1].as_slice() {
                b"OB" | b"OW" | b"UN" | b"UT" => {
                    let mut long = [0; 4];
                    file.read_exact(&mut long).map_err(broken)?;
                    u32::from_le_bytes(long)
                }
                _ => u16::from_le_bytes([l0, l1]).into(),
            };
            let field = match u16::from_le_bytes([e0, e1]) {
                0x0002 => &mut meta.sop_class,
                0x0010 => &mut meta.transfer_syntax,
                _ => {
                    file.seek_relative(length.into()).map_err(broken)?;
                    continue;
                }
            };
            let mut uid = Vec::new();
            file.take(length.min(64).into())
                .read_to_end(&mut uid)
                .map_err(broken)?;
            file.seek_relative(i64::from(length) - uid.len() as i64)
                .map_err(broken)?;
            let uid = String::from_utf8_lossy(&uid);
            *field = uid.trim_end_matches(['\0', ' ']).to_owned();
        }
    }

    fn syntax(&self) -> Result<Syntax, DicomProblem> {
        if self.transfer_syntax.is_empty() {
            return Err(DicomProblem::Missing {
                attribute: attribute(tags::TRANSFER_SYNTAX_UID),
                advice: "its encoding would be a guess: export it again",
            });
        }
        Syntax::of(&self.transfer_syntax)
    }

    /// A DICOMDIR.
    fn is_directory(&self) -> bool {
        self.sop_class == uids::MEDIA_STORAGE_DIRECTORY_STORAGE
    }

    fn is_ct(&self, values: &BTreeMap<Tag, PrimitiveValue>) -> bool {
        self.sop_class == uids::CT_IMAGE_STORAGE || values.contains_key(&tags::ROWS)
    }
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

struct Walked {
    values: BTreeMap<Tag, PrimitiveValue>,
    pixels: Option<PixelData>,
}

/// Goes through a data set up to its pixels.
fn walk(source: &mut Box<dyn Source>, syntax: Syntax, bytes: u64) -> Result<Walked, DicomProblem> {
    let mut values = BTreeMap::new();
    if !starts_as(source, syntax)? {
        return Ok(Walked {
            values,
            pixels: None,
        });
    }
    let broken = |what: &dyn std::fmt::Display| DicomProblem::Structure(what.to_string());
    let mut reader =
        LazyDataSetReader::new_with_ts(source, &syntax.of_data_set()).map_err(|e| broken(&e))?;
    // Items and sequences that are open: the parser panics on an end too many.
    let mut depth = 0_usize;
    let mut last = tags::SPECIFIC_CHARACTER_SET;
    let pixels = loop {
        let Some(token) = reader.advance() else {
            if depth > 0 {
                return Err(broken(&format!("it ends inside a sequence after {last}")));
            }
            break None;
        };
        match token.map_err(|e| broken(&format!("after {last}: {e}")))? {
            LazyDataToken::PixelSequenceStart if depth == 0 => break Some(None),
            LazyDataToken::ElementHeader(header) => {
                last = header.tag;
                if depth == 0 && last == tags::PIXEL_DATA {
                    break Some(header.len.get());
                }
            }
            LazyDataToken::SequenceStart { tag, .. } => {
                if depth == 0 && WANTED.contains(&tag) {
                    values.insert(tag, PrimitiveValue::Empty);
                }
                last = tag;
                depth += 1;
            }
            LazyDataToken::ItemStart { .. } | LazyDataToken::PixelSequenceStart => depth += 1,
            LazyDataToken::ItemEnd | LazyDataToken::SequenceEnd => {
                depth = depth
                    .checked_sub(1)
                    .ok_or_else(|| broken(&format!("a sequence ends twice after {last}")))?;
            }
            LazyDataToken::LazyValue { header, decoder } => {
                let left = bytes.saturating_sub(decoder.position());
                let length = check_length(&header, left)?;
                let wanted = depth == 0 && WANTED.contains(&header.tag);
                if !wanted {
                    decoder.skip_bytes(length).map_err(|e| broken(&e))?;
                    continue;
                }
                if u64::from(length) > MAX_VALUE_BYTES {
                    let name = attribute(header.tag);
                    return Err(broken(&format!("{name} claims {length} bytes")));
                }
                let value = decoder
                    .read_value_preserved(&header)
                    .map_err(|e| broken(&format!("{}: {e}", attribute(header.tag))))?;
                values.insert(header.tag, value);
            }
            LazyDataToken::LazyItemValue { len, decoder } => {
                let left = bytes.saturating_sub(decoder.position());
                if u64::from(len) > left {
                    return Err(broken(&format!(
                        "an item after {last} claims {len} bytes where {left} are left"
                    )));
                }
                decoder.skip_bytes(len).map_err(|e| broken(&e))?;
            }
            _ => return Err(broken(&format!("after {last}: a token of no known kind"))),
        }
    };
    let offset = reader.into_decoder().position();
    let pixels = pixels.map(|length| PixelData {
        offset,
        length: length.map(u64::from),
    });
    Ok(Walked { values, pixels })
}

/// Looks at the first element; false where there is none.
fn starts_as(source: &mut Box<dyn Source>, syntax: Syntax) -> Result<bool, DicomProblem> {
    let broken = |e: std::io::Error| DicomProblem::Structure(e.to_string());
    let at = source.stream_position().map_err(broken)?;
    let mut start = Vec::new();
    source.take(6).read_to_end(&mut start).map_err(broken)?;
    source.seek(SeekFrom::Start(at)).map_err(broken)?;
    let Ok(start) = <[u8; 6]>::try_from(start) else {
        return Ok(false);
    };
    syntax.check_start(start).map(|()| true)
}

fn check_length(header: &DataElementHeader, left: u64) -> Result<u32, DicomProblem> {
    let claims = match header.len.get() {
        Some(length) if u64::from(length) <= left => return Ok(length),
        Some(length) => format!("{length} bytes where {left} are left"),
        None => "no length".into(),
    };
    Err(DicomProblem::Structure(format!(
        "{} claims {claims}",
        attribute(header.tag())
    )))
}

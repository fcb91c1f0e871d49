//! One slice of a CT: what its attributes must say.

use super::data_set::DataSet;
use super::problem::DicomProblem;
use super::syntax::Syntax;
use crate::geometry::{Point, Vector};
use crate::volume::VolumeFileError;
use dicom_core::Tag;
use dicom_dictionary_std::{tags, uids};
use std::path::Path;

/// How far a direction cosine's length may be from 1, and two from a right angle (their cosine):
/// the rounding of decimal strings stays far below.
const MAX_COSINE_ERROR: f64 = 1e-3;

/// A slice that was checked by itself; its pixels are not read yet.
#[derive(Debug)]
pub(super) struct Slice {
    pub data: DataSet,
    pub rows: usize,
    pub columns: usize,
    /// The centre of the first pixel, LPS mm.
    pub position: Point,
    /// Unit vector along a row, in the direction of growing column numbers (i).
    pub along_row: Vector,
    /// Unit vector along a column, in the direction of growing row numbers (j).
    pub along_column: Vector,
    /// Distance in mm between columns (i) and between rows (j). PixelSpacing has them the other
    /// way round.
    pub spacing: [f64; 2],
    pub frame_of_reference: Option<String>,
    pub format: PixelFormat,
}

/// How the numbers of a slice are stored, and how they become Hounsfield units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PixelFormat {
    /// 1, 2 or 4.
    pub bytes: usize,
    pub bits_stored: u32,
    pub signed: bool,
    pub slope: f64,
    pub intercept: f64,
    /// The stored values, both included, that stand for no measurement.
    pub padding: Option<(i64, i64)>,
}

impl Slice {
    /// Checks what a CT slice must say.
    ///
    /// # Errors
    /// With the first attribute that is missing or says something else.
    pub fn new(data: DataSet) -> Result<Self, VolumeFileError> {
        check_kind(&data)?;
        let rows = size(&data, tags::ROWS)?;
        let columns = size(&data, tags::COLUMNS)?;
        let format = pixel_format(&data)?;
        check_bytes(&data, rows, columns, &format)?;
        let [along_row, along_column] = directions(&data)?;
        let position = data
            .numbers::<3>(tags::IMAGE_POSITION_PATIENT)?
            .ok_or_else(|| {
                let advice = "slices are ordered by it: export the original series";
                data.missing(tags::IMAGE_POSITION_PATIENT, advice)
            })?;
        let spacing = data
            .numbers::<2>(tags::PIXEL_SPACING)?
            .ok_or_else(|| data.missing(tags::PIXEL_SPACING, "export the original series"))?;
        if spacing.iter().any(|&mm| !(1e-3..=1e3).contains(&mm)) {
            let found = format!("{}\\{}", spacing[0], spacing[1]);
            return Err(data.unexpected(tags::PIXEL_SPACING, &found, "0.001 to 1000 mm"));
        }
        Ok(Self {
            rows,
            columns,
            position: Point::from(position),
            along_row,
            along_column,
            spacing: [spacing[1], spacing[0]],
            frame_of_reference: data.text(tags::FRAME_OF_REFERENCE_UID),
            format,
            data,
        })
    }

    pub fn path(&self) -> &Path {
        &self.data.path
    }

    pub fn normal(&self) -> Vector {
        self.along_row.cross(&self.along_column)
    }
}

fn check_kind(data: &DataSet) -> Result<(), VolumeFileError> {
    let equals = |tag: Tag, wanted: &str, advice: &str| match data.text(tag) {
        Some(text) if text == wanted => Ok(()),
        Some(text) => Err(data.unexpected(tag, &text, &format!("{wanted}: {advice}"))),
        None => Err(data.missing(tag, "export the original series")),
    };
    equals(
        tags::MODALITY,
        "CT",
        "only a CT has the Hounsfield units that radiographs are made from; name the folder of a CT series",
    )?;
    let class = data.text(tags::SOP_CLASS_UID).unwrap_or_default();
    let frames = data.whole(tags::NUMBER_OF_FRAMES)?.unwrap_or(1);
    let enhanced = [
        uids::ENHANCED_CT_IMAGE_STORAGE,
        uids::LEGACY_CONVERTED_ENHANCED_CT_IMAGE_STORAGE,
    ];
    if enhanced.contains(&class.as_str()) || frames != 1 {
        return Err(data.unexpected(
            tags::NUMBER_OF_FRAMES,
            &frames.to_string(),
            "one slice a file: enhanced (multi-frame) CT is not read; split it with dcm4che's \
             emf2sf, or convert it to NIfTI with dcm2niix",
        ));
    }
    match data.whole(tags::SAMPLES_PER_PIXEL)? {
        Some(1) => {}
        Some(n) => {
            let expected =
                "1: a picture in colour has no Hounsfield units; export the original series";
            return Err(data.unexpected(tags::SAMPLES_PER_PIXEL, &n.to_string(), expected));
        }
        None => return Err(data.missing(tags::SAMPLES_PER_PIXEL, "export the original series")),
    }
    equals(
        tags::PHOTOMETRIC_INTERPRETATION,
        "MONOCHROME2",
        "anything else is a picture to look at, not the scanner's values; export the original series",
    )
}

fn size(data: &DataSet, tag: Tag) -> Result<usize, VolumeFileError> {
    match data.whole(tag)? {
        Some(n @ 2..=65535) => Ok(n as usize),
        Some(n) => Err(data.unexpected(tag, &n.to_string(), "2 to 65535 pixels")),
        None => Err(data.missing(tag, "export the original series")),
    }
}

fn pixel_format(data: &DataSet) -> Result<PixelFormat, VolumeFileError> {
    let whole = |tag| {
        data.whole(tag)?
            .ok_or_else(|| data.missing(tag, "its numbers cannot be read: export it again"))
    };
    let allocated = whole(tags::BITS_ALLOCATED)?;
    if ![8, 16, 32].contains(&allocated) {
        let expected = "8, 16 or 32 bits";
        return Err(data.unexpected(tags::BITS_ALLOCATED, &allocated.to_string(), expected));
    }
    if allocated == 8 && data.syntax == Syntax::ExplicitBig {
        let expected = "16 or 32 in big endian, where the order of single bytes is a guess; \
                        convert it to little endian, for instance with 'dcmconv +te IN OUT' of DCMTK";
        return Err(data.unexpected(tags::BITS_ALLOCATED, "8", expected));
    }
    let stored = whole(tags::BITS_STORED)?;
    if !(1..=allocated).contains(&stored) {
        let expected = format!("1 to BitsAllocated, which is {allocated}");
        return Err(data.unexpected(tags::BITS_STORED, &stored.to_string(), &expected));
    }
    let high = whole(tags::HIGH_BIT)?;
    if high != stored - 1 {
        let expected = format!(
            "{}, one less than BitsStored: programs differ in how they read anything else; export \
             it again",
            stored - 1
        );
        return Err(data.unexpected(tags::HIGH_BIT, &high.to_string(), &expected));
    }
    let signed = match whole(tags::PIXEL_REPRESENTATION)? {
        0 => false,
        1 => true,
        n => {
            let expected = "0 (unsigned) or 1 (signed)";
            return Err(data.unexpected(tags::PIXEL_REPRESENTATION, &n.to_string(), expected));
        }
    };
    let (slope, intercept) = rescale(data)?;
    let mut format = PixelFormat {
        bytes: allocated as usize / 8,
        bits_stored: stored as u32,
        signed,
        slope,
        intercept,
        padding: None,
    };
    if let Some(value) = data.whole(tags::PIXEL_PADDING_VALUE)? {
        // Its own type, signed or not, is written by some as the other one: the bits are meant.
        let value = format.number(value as u32);
        let limit = data.whole(tags::PIXEL_PADDING_RANGE_LIMIT)?;
        let limit = limit.map_or(value, |limit| format.number(limit as u32));
        format.padding = Some((value.min(limit), value.max(limit)));
    }
    Ok(format)
}

impl PixelFormat {
    /// The number that the stored bits mean, whatever lies above them.
    #[inline]
    pub fn number(&self, bits: u32) -> i64 {
        let unused = 32 - self.bits_stored;
        if self.signed {
            i64::from((bits << unused) as i32 >> unused)
        } else {
            i64::from(bits << unused >> unused)
        }
    }
}

/// (slope, intercept): stored value times slope plus intercept is the value in Hounsfield units.
fn rescale(data: &DataSet) -> Result<(f64, f64), VolumeFileError> {
    let number = |tag| {
        data.numbers::<1>(tag)?.ok_or_else(|| {
            let advice = if data.has(tags::MODALITY_LUT_SEQUENCE) {
                "it has a ModalityLUTSequence instead, which is not read: convert it with another program"
            } else {
                "without it Hounsfield units would be a guess: export the original series"
            };
            data.missing(tag, advice)
        })
    };
    let [slope] = number(tags::RESCALE_SLOPE)?;
    let [intercept] = number(tags::RESCALE_INTERCEPT)?;
    if slope == 0.0 {
        return Err(data.unexpected(tags::RESCALE_SLOPE, "0", "another number than 0"));
    }
    match data.text(tags::RESCALE_TYPE) {
        Some(unit) if unit != "HU" => Err(data.unexpected(
            tags::RESCALE_TYPE,
            &unit,
            "HU, or none: its values are no Hounsfield units",
        )),
        _ => Ok((slope, intercept)),
    }
}

/// Says so when the file has not the bytes that its header promises. Nothing of an image's size is
/// allocated before.
fn check_bytes(
    data: &DataSet,
    rows: usize,
    columns: usize,
    format: &PixelFormat,
) -> Result<(), VolumeFileError> {
    let expected = rows as u64 * columns as u64 * format.bytes as u64;
    let left = data.bytes.saturating_sub(data.pixels.offset);
    let truncated = |found, expected| VolumeFileError::Truncated {
        path: data.path.clone(),
        found,
        expected,
    };
    match (data.pixels.length, data.syntax.is_encapsulated()) {
        (None, true) => {
            let most = data.syntax.most_pixel_bytes(left, format.bytes as u64);
            if most < expected {
                return Err(truncated(most, expected));
            }
        }
        (Some(length), false) => {
            if left < length {
                return Err(truncated(left, length));
            }
            if length < expected {
                return Err(truncated(length, expected));
            }
            // An odd number of bytes is padded to an even one.
            if length > expected + 1 {
                let expected = format!("{expected} bytes, as Rows, Columns and BitsAllocated say");
                let found = format!("{length} bytes");
                return Err(data.unexpected(tags::PIXEL_DATA, &found, &expected));
            }
        }
        (length, _) => {
            return Err(DicomProblem::WrongTransferSyntax {
                claimed: data.syntax.name(),
                found: match length {
                    Some(_) => "its pixels are not encapsulated",
                    None => "its pixels are encapsulated",
                },
            }
            .at(&data.path));
        }
    }
    Ok(())
}

/// Unit vectors along a row and along a column.
fn directions(data: &DataSet) -> Result<[Vector; 2], VolumeFileError> {
    let tag = tags::IMAGE_ORIENTATION_PATIENT;
    let Some(cosines) = data.numbers::<6>(tag)? else {
        return Err(data.missing(
            tag,
            "where its slices lie would be a guess: export the original series",
        ));
    };
    let row = Vector::new(cosines[0], cosines[1], cosines[2]);
    let column = Vector::new(cosines[3], cosines[4], cosines[5]);
    let unit = [row, column]
        .iter()
        .all(|v| (v.norm() - 1.0).abs() <= MAX_COSINE_ERROR);
    if !unit || row.dot(&column).abs() > MAX_COSINE_ERROR {
        let found = data.text(tag).unwrap_or_default();
        return Err(data.unexpected(tag, &found, "two unit vectors at a right angle"));
    }
    Ok([row.normalize(), column.normalize()])
}

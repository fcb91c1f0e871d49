//! Going through a data set, element by element.

use super::data_set::{PixelData, Source, attribute};
use super::problem::DicomProblem;
use super::syntax::Syntax;
use dicom_core::header::{DataElementHeader, Header};
use dicom_core::{PrimitiveValue, Tag};
use dicom_dictionary_std::tags;
use dicom_parser::StatefulDecode;
use dicom_parser::dataset::LazyDataToken;
use dicom_parser::dataset::lazy_read::LazyDataSetReader;
use std::collections::BTreeMap;
use std::io::{Read, Seek, SeekFrom};

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

/// What was found.
pub(super) struct Walked {
    pub values: BTreeMap<Tag, PrimitiveValue>,
    /// `None` for an object without an image.
    pub pixels: Option<PixelData>,
}

/// Goes through a data set, from its first byte, up to its pixels.
///
/// # Errors
/// When it is not in the syntax that it is said to be in, or broken.
pub(super) fn walk(
    source: &mut Box<dyn Source>,
    syntax: Syntax,
    bytes: u64,
) -> Result<Walked, DicomProblem> {
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

//! Reading a volume.

use super::FORMAT;
use super::axes::grid_of;
use super::header::Header;
use crate::volume::header_fields::HeaderFields;
use crate::volume::samples::{ByteOrder, SampleType, volume_of_samples};
use crate::volume::source;
use crate::volume::{Volume, VolumeFileError, Voxel};
use flate2::bufread::MultiGzDecoder;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

/// Reads the volume of a `.nrrd` file, or of a `.nhdr` header and the file it names (relative to the
/// header's folder), with values of any integer or float type, raw, compressed by gzip or as text.
/// Its world is LPS in mm whichever the header has; oblique, mirrored and permuted axes are kept as
/// they are. Axes outside space are passed over when they have one value.
///
/// A segmentation by Slicer (`.seg.nrrd`) is read as the label map it holds, where no segments
/// overlap; [`super::nrrd_segment_names`] gives its labels' names. Slicer may have cropped it to what its
/// segments need, so its grid is a part of its CT's.
///
/// # Errors
/// When the file is no NRRD file, has not three dimensions in space, does not say where it lies in
/// LPS, RAS or LAS mm, holds more than one value a voxel, is encoded otherwise or in several files,
/// ends too early, or holds a value that `T` cannot.
pub fn read_nrrd<T: Voxel>(path: &Path) -> Result<Volume<T>, VolumeFileError> {
    let mut attached = source::open(path)?;
    let header = Header::read(&mut attached, path)?;
    let grid = grid_of(&header)?;
    let kind = header.sample_type()?;
    let expected = source::raw_bytes(grid.dims, kind, path)?;
    let (values, path) = open_values(&header, attached, expected)?;
    let path = path.as_path();
    let raw = match values {
        Values::Bytes(mut stream) => source::read_raw(&mut stream, expected, path)?,
        Values::Text(mut stream) => return source::read_text(grid, &mut stream, (path, FORMAT)),
    };
    let order = byte_order(&header.fields, kind)?;
    volume_of_samples(grid, &raw, (kind, order), (1.0, 0.0), path)
}

/// The stream of a file's values, from the first.
pub(super) enum Values {
    Bytes(Box<dyn Read>),
    Text(Box<dyn Read>),
}

/// Opens the values of a file, `expected` bytes unless they are text, and gives the path of the file that
/// holds them. `attached` is what follows the header.
///
/// # Errors
/// When they lie in several files or are encoded otherwise than raw, by gzip or as text.
pub(super) fn open_values(
    header: &Header,
    attached: BufReader<File>,
    expected: u64,
) -> Result<(Values, PathBuf), VolumeFileError> {
    let (mut file, path) = match data_file(&header.fields)? {
        Some(path) => (source::open(&path)?, path),
        None => (attached, header.fields.path().to_owned()),
    };
    source::skip_lines(&mut file, not_negative(&header.fields, "line skip")?, &path)?;
    let encoding = header.fields.needed("encoding")?.to_ascii_lowercase();
    let bytes = || not_negative(&header.fields, "byte skip");
    let values = match encoding.as_str() {
        // -1: the voxels are the file's last bytes, whatever precedes them.
        "raw" if header.fields.whole("byte skip", 0)? == -1 => {
            source::skip_to_last(&mut file, expected, &path)?;
            Values::Bytes(Box::new(file))
        }
        "raw" => {
            source::skip_bytes(&mut file, bytes()?, &path)?;
            Values::Bytes(Box::new(file))
        }
        "gz" | "gzip" => {
            let mut stream = MultiGzDecoder::new(file);
            source::skip_bytes(&mut stream, bytes()?, &path)?;
            Values::Bytes(Box::new(stream))
        }
        "txt" | "text" | "ascii" => {
            source::skip_bytes(&mut file, bytes()?, &path)?;
            Values::Text(Box::new(file))
        }
        other => {
            return Err(header.fields.wrong(format!(
                "its encoding is '{other}'; write it anew as raw or gzip (Slicer, pynrrd and teem's \
                 unu save do so)"
            )));
        }
    };
    Ok((values, path))
}

/// The file that holds the voxels, where it is not the header's own.
fn data_file(fields: &HeaderFields) -> Result<Option<PathBuf>, VolumeFileError> {
    let Some(name) = fields.get("data file") else {
        return Ok(None);
    };
    fields.data_file("data file", name).map(Some)
}

fn not_negative(fields: &HeaderFields, field: &'static str) -> Result<u64, VolumeFileError> {
    let number = fields.whole(field, 0)?;
    u64::try_from(number)
        .map_err(|_| fields.wrong(format!("its '{field}' is {number}; expected 0 or more")))
}

fn byte_order(fields: &HeaderFields, kind: SampleType) -> Result<ByteOrder, VolumeFileError> {
    match fields.get("endian").map(str::to_ascii_lowercase).as_deref() {
        Some("little") => Ok(ByteOrder::Little),
        Some("big") => Ok(ByteOrder::Big),
        None if kind.size() == 1 => Ok(ByteOrder::Little),
        other => Err(fields.wrong(format!(
            "its 'endian' is '{}'; expected little or big",
            other.unwrap_or_default()
        ))),
    }
}

//! Reading a volume.

use super::FORMAT;
use super::header::{Header, is_header_line};
use super::place::grid_of;
use crate::volume::header_fields::HeaderFields;
use crate::volume::samples::{ByteOrder, volume_of_samples};
use crate::volume::source;
use crate::volume::{Volume, VolumeFileError, Voxel};
use flate2::bufread::{MultiGzDecoder, ZlibDecoder};
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};

/// Reads the volume of a `.mha` file, or of a `.mhd` header and the file it names (relative to the
/// header's folder), with values of any integer or float type, raw, compressed by zlib or as text.
/// Its world is LPS in mm; oblique, mirrored and permuted axes are kept as they are. Where the byte order is
/// not said, it is little endian, as it is on today's machines, whose order ITK takes then.
///
/// # Errors
/// When the file is no MetaImage file, has not three dimensions, does not say where it lies, is not in mm,
/// holds more than one value a voxel, has its voxels in several files, asks for its values to be
/// scaled (ITK does not do it), ends too early, or holds a value that `T` cannot.
pub fn read_metaimage<T: Voxel>(path: &Path) -> Result<Volume<T>, VolumeFileError> {
    let mut local = source::open(path)?;
    let header = Header::read(&mut local, path)?;
    check_content(&header.fields)?;
    let grid = grid_of(&header)?;
    let kind = header.sample_type()?;
    let expected = source::raw_bytes(grid.dims, kind, path)?;
    let binary = header.flag("BinaryData", true)?;
    let compressed = header.flag("CompressedData", false)?;
    if compressed && !binary {
        return Err(header
            .fields
            .wrong("its voxels are compressed text; write it anew as binary".into()));
    }
    let (mut file, path) = data_file(&header, local)?;
    let path = path.as_path();
    match header.fields.whole("HeaderSize", 0)? {
        0 => {}
        // The voxels are the file's last bytes.
        -1 if binary && !compressed => source::skip_to_last(&mut file, expected, path)?,
        size @ 1.. => source::skip_to(&mut file, size as u64, path)?,
        size => {
            return Err(header.fields.wrong(format!(
                "its 'HeaderSize' is {size}; expected 0 or more (or -1 for raw voxels)"
            )));
        }
    }
    if !binary {
        return source::read_text(grid, &mut file, (path, FORMAT));
    }
    let mut stream: Box<dyn Read> = match compressed {
        false => Box::new(file),
        true if source::is_gzip(&mut file, path)? => Box::new(MultiGzDecoder::new(file)),
        true => Box::new(ZlibDecoder::new(file)),
    };
    let raw = source::read_raw(&mut stream, expected, path)?;
    let order = match header.flag("BinaryDataByteOrderMSB", false)? {
        true => ByteOrder::Big,
        false => ByteOrder::Little,
    };
    volume_of_samples(grid, &raw, (kind, order), (1.0, 0.0), path)
}

/// True when a file's first bytes are lines of a MetaImage header.
pub(in crate::volume) fn is_metaimage(start: &[u8]) -> bool {
    let text = String::from_utf8_lossy(start);
    let first = text.lines().find(|line| !line.trim().is_empty());
    first.is_some_and(is_header_line)
}

/// Refuses what is no image of one value a voxel.
fn check_content(fields: &HeaderFields) -> Result<(), VolumeFileError> {
    match fields.get("ObjectType") {
        None | Some("Image") => {}
        Some(other) => {
            return Err(fields.wrong(format!("it holds a '{other}', not an Image")));
        }
    }
    let channels = fields.whole("ElementNumberOfChannels", 1)?;
    if channels != 1 {
        return Err(fields.wrong(format!(
            "it has {channels} values a voxel (ElementNumberOfChannels); expected one"
        )));
    }
    let slope = fields.number("ElementToIntensityFunctionSlope", 1.0)?;
    let offset = fields.number("ElementToIntensityFunctionOffset", 0.0)?;
    if (slope, offset) != (1.0, 0.0) {
        return Err(fields.wrong(format!(
            "its ElementToIntensityFunction is value * {slope} + {offset}, which some programs apply and \
             others do not; write the values themselves and leave it out"
        )));
    }
    Ok(())
}

/// The file that holds the voxels, at their start if nothing precedes them, and its path.
fn data_file(
    header: &Header,
    local: BufReader<File>,
) -> Result<(BufReader<File>, PathBuf), VolumeFileError> {
    let name = header.fields.needed("ElementDataFile")?;
    if name.eq_ignore_ascii_case("LOCAL") {
        return Ok((local, header.fields.path().into()));
    }
    let path = header.fields.data_file("ElementDataFile", name)?;
    Ok((source::open(&path)?, path))
}

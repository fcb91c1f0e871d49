//! Reading a volume.

use super::affine::grid_of;
use crate::volume::samples::{ByteOrder, SampleType, volume_of_samples};
use crate::volume::source;
use crate::volume::{Volume, VolumeFileError, Voxel};
use ::nifti::{Endianness, NiftiError, NiftiHeader, NiftiType};
use flate2::bufread::MultiGzDecoder;
use std::io::{ErrorKind, Read};
use std::path::Path;

const FORMAT: &str = "NIfTI-1 file (.nii or .nii.gz)";

/// Bytes of a NIfTI-1 header; a single file's voxels start after it and 4 more.
pub(super) const HEADER_BYTES: u64 = 348;

/// Reads the volume of a `.nii` or `.nii.gz` file, of any integer or float datatype, with the
/// header's scaling applied. Its world is LPS in mm; oblique and mirrored axes are kept as they
/// are.
///
/// # Errors
/// When the file is no NIfTI-1 file, has not three dimensions, does not say where it lies (or
/// says it twice, differently), is not in mm, ends too early, or holds a value that `T` cannot.
pub fn read_nifti<T: Voxel>(path: &Path) -> Result<Volume<T>, VolumeFileError> {
    let mut stream = open(path)?;
    let header = read_header(&mut stream, path)?;
    let dims = dimensions(&header, path)?;
    check_unit(&header, path)?;
    let grid = grid_of(&header, dims).map_err(|reason| VolumeFileError::Place {
        path: path.into(),
        reason: format!("{reason}; set a valid sform or qform in RAS mm"),
    })?;
    let kind = sample_type(&header, path)?;
    let expected = source::raw_bytes(dims, kind, path)?;
    skip_to_voxels(&mut stream, &header, path)?;
    let raw = source::read_raw(&mut stream, expected, path)?;
    let order = match header.endianness {
        Endianness::Little => ByteOrder::Little,
        Endianness::Big => ByteOrder::Big,
    };
    volume_of_samples(grid, &raw, (kind, order), scaling(&header), path)
}

/// True when a file's first bytes, or what they decompress to, are a NIfTI-1 header.
pub(in crate::volume) fn is_nifti(start: &[u8]) -> bool {
    let mut header = Vec::new();
    let found = if start.starts_with(&[0x1f, 0x8b]) {
        MultiGzDecoder::new(start)
            .take(HEADER_BYTES)
            .read_to_end(&mut header)
    } else {
        start.take(HEADER_BYTES).read_to_end(&mut header)
    };
    // The bytes may be cut off after the header.
    let _ = found;
    matches!(header.get(344..348), Some(b"n+1\0" | b"ni1\0"))
}

/// The file's bytes, decompressed where it starts as gzip does, whatever its name.
pub(super) fn open(path: &Path) -> Result<Box<dyn Read>, VolumeFileError> {
    let mut whole = source::open(path)?;
    Ok(if source::is_gzip(&mut whole, path)? {
        Box::new(MultiGzDecoder::new(whole))
    } else {
        Box::new(whole)
    })
}

pub(super) fn read_header(
    stream: &mut dyn Read,
    path: &Path,
) -> Result<NiftiHeader, VolumeFileError> {
    let not_nifti = |reason: String| VolumeFileError::Format {
        path: path.into(),
        format: FORMAT,
        reason,
    };
    let header = NiftiHeader::from_reader(stream).map_err(|error| match error {
        NiftiError::Io(e) if e.kind() == ErrorKind::UnexpectedEof => {
            not_nifti("it is shorter than a header".into())
        }
        NiftiError::Io(source) if source.kind() == ErrorKind::InvalidInput => {
            not_nifti(format!("it does not decompress ({source})"))
        }
        NiftiError::Io(source) => VolumeFileError::Io {
            doing: "read",
            path: path.into(),
            source,
        },
        other => not_nifti(other.to_string()),
    })?;
    if header.sizeof_hdr != HEADER_BYTES as i32 {
        return Err(not_nifti(format!(
            "its header says it has {} bytes, expected {HEADER_BYTES}",
            header.sizeof_hdr
        )));
    }
    if &header.magic != ::nifti::header::MAGIC_CODE_NIP1 {
        return Err(not_nifti(
            "it is the header of a .hdr/.img pair; convert it to one file".into(),
        ));
    }
    Ok(header)
}

fn dimensions(header: &NiftiHeader, path: &Path) -> Result<[usize; 3], VolumeFileError> {
    // The standard's type is i16; the crate reads u16.
    let dim = header.dim.map(|d| d as i16);
    let used = (dim[0].clamp(0, 7)) as usize;
    let dims = &dim[1..=used];
    let three = used >= 3 && dims[..3].iter().all(|&d| d > 1) && dims[3..].iter().all(|&d| d == 1);
    if !three {
        return Err(VolumeFileError::Dimensions {
            path: path.into(),
            dims: dims.iter().map(|&d| d.into()).collect(),
        });
    }
    Ok([dims[0] as usize, dims[1] as usize, dims[2] as usize])
}

fn check_unit(header: &NiftiHeader, path: &Path) -> Result<(), VolumeFileError> {
    match header.xyzt_units & 0x07 {
        // 0: not stated; every tool that leaves it out means mm.
        0 | 2 => Ok(()),
        code => Err(VolumeFileError::Unit {
            path: path.into(),
            found: format!("NIfTI unit code {code}"),
        }),
    }
}

/// (slope, intercept): a slope of 0 means that there is no scaling.
fn scaling(header: &NiftiHeader) -> (f64, f64) {
    match header.scl_slope {
        0.0 => (1.0, 0.0),
        slope => (slope.into(), header.scl_inter.into()),
    }
}

fn sample_type(header: &NiftiHeader, path: &Path) -> Result<SampleType, VolumeFileError> {
    Ok(match header.data_type() {
        Ok(NiftiType::Uint8) => SampleType::U8,
        Ok(NiftiType::Int8) => SampleType::I8,
        Ok(NiftiType::Uint16) => SampleType::U16,
        Ok(NiftiType::Int16) => SampleType::I16,
        Ok(NiftiType::Uint32) => SampleType::U32,
        Ok(NiftiType::Int32) => SampleType::I32,
        Ok(NiftiType::Uint64) => SampleType::U64,
        Ok(NiftiType::Int64) => SampleType::I64,
        Ok(NiftiType::Float32) => SampleType::F32,
        Ok(NiftiType::Float64) => SampleType::F64,
        _ => {
            return Err(VolumeFileError::DataType {
                path: path.into(),
                found: format!("NIfTI datatype {}", header.datatype),
            });
        }
    })
}

/// Moves on from the header's end to where its voxels start.
fn skip_to_voxels(
    stream: &mut dyn Read,
    header: &NiftiHeader,
    path: &Path,
) -> Result<(), VolumeFileError> {
    let start = f64::from(header.vox_offset);
    if !(start >= HEADER_BYTES as f64 && start.fract() == 0.0) {
        return Err(VolumeFileError::Format {
            path: path.into(),
            format: FORMAT,
            reason: format!("its voxels start at byte {start}, inside the header"),
        });
    }
    source::skip_bytes(stream, start as u64 - HEADER_BYTES, path)
}

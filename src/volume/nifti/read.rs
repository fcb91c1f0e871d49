//! Reading a volume.

use super::affine::grid_of;
use super::error::NiftiFileError;
use super::voxel::NiftiVoxel;
use crate::volume::Volume;
use ::nifti::{Endianness, NiftiError, NiftiHeader, NiftiType};
use flate2::read::MultiGzDecoder;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

/// Bytes of a NIfTI-1 header; a single file's voxels start after it and 4 more.
const HEADER_BYTES: u64 = 348;

/// Reads the volume of a `.nii` or `.nii.gz` file, of any integer or float datatype, with the
/// header's scaling applied. Its world is LPS in mm; oblique and mirrored axes are kept as they
/// are.
///
/// # Errors
/// When the file is no NIfTI-1 file, has not three dimensions, does not say where it lies (or
/// says it twice, differently), is not in mm, ends too early, or holds a value that `T` cannot.
pub fn read_nifti<T: NiftiVoxel>(path: &Path) -> Result<Volume<T>, NiftiFileError> {
    let mut stream = open(path)?;
    let header = read_header(&mut stream, path)?;
    let dims = dimensions(&header, path)?;
    check_unit(&header, path)?;
    let grid = grid_of(&header, dims).map_err(|reason| NiftiFileError::Affine {
        path: path.into(),
        reason,
    })?;
    let decode = decoder(&header, path)?;
    let raw = read_raw(&mut stream, &header, grid.len(), path)?;
    let mut data = Vec::with_capacity(grid.len());
    let size = raw.len() / grid.len();
    let scale = scaling(&header);
    for (offset, bytes) in raw.chunks_exact(size).enumerate() {
        let value = decode(bytes) * scale.0 + scale.1;
        data.push(
            T::from_file_value(value).map_err(|problem| NiftiFileError::Value {
                path: path.into(),
                voxel: grid.voxel(offset),
                value,
                problem,
            })?,
        );
    }
    Ok(Volume::new(grid, data))
}

/// The file's bytes, decompressed where it starts as gzip does, whatever its name.
fn open(path: &Path) -> Result<Box<dyn Read>, NiftiFileError> {
    let io = |source| NiftiFileError::Io {
        doing: "read",
        path: path.into(),
        source,
    };
    let mut file = File::open(path).map_err(io)?;
    let mut start = Vec::new();
    file.by_ref().take(2).read_to_end(&mut start).map_err(io)?;
    let gzip = start == [0x1f, 0x8b];
    let whole = BufReader::new(std::io::Cursor::new(start).chain(file));
    Ok(if gzip {
        Box::new(MultiGzDecoder::new(whole))
    } else {
        Box::new(whole)
    })
}

fn read_header(stream: &mut dyn Read, path: &Path) -> Result<NiftiHeader, NiftiFileError> {
    let not_nifti = |reason: String| NiftiFileError::NotNifti {
        path: path.into(),
        reason,
    };
    let header = NiftiHeader::from_reader(stream).map_err(|error| match error {
        NiftiError::Io(e) if e.kind() == ErrorKind::UnexpectedEof => {
            not_nifti("it is shorter than a header".into())
        }
        NiftiError::Io(source) if source.kind() == ErrorKind::InvalidInput => {
            not_nifti(format!("it does not decompress ({source})"))
        }
        NiftiError::Io(source) => NiftiFileError::Io {
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

fn dimensions(header: &NiftiHeader, path: &Path) -> Result<[usize; 3], NiftiFileError> {
    // The standard's type is i16; the crate reads u16.
    let dim = header.dim.map(|d| d as i16);
    let used = (dim[0].clamp(0, 7)) as usize;
    let dims = &dim[1..=used];
    let three = used >= 3 && dims[..3].iter().all(|&d| d > 1) && dims[3..].iter().all(|&d| d == 1);
    if !three {
        return Err(NiftiFileError::Dimensions {
            path: path.into(),
            dims: dims.to_vec(),
        });
    }
    Ok([dims[0] as usize, dims[1] as usize, dims[2] as usize])
}

fn check_unit(header: &NiftiHeader, path: &Path) -> Result<(), NiftiFileError> {
    match header.xyzt_units & 0x07 {
        // 0: not stated; every tool that leaves it out means mm.
        0 | 2 => Ok(()),
        code => Err(NiftiFileError::Unit {
            path: path.into(),
            code,
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

fn data_type(header: &NiftiHeader, path: &Path) -> Result<NiftiType, NiftiFileError> {
    header.data_type().map_err(|_| NiftiFileError::DataType {
        path: path.into(),
        code: header.datatype,
    })
}

fn read_raw(
    stream: &mut dyn Read,
    header: &NiftiHeader,
    voxels: usize,
    path: &Path,
) -> Result<Vec<u8>, NiftiFileError> {
    let io = |source: std::io::Error| NiftiFileError::Io {
        doing: "read",
        path: path.into(),
        source,
    };
    let start = f64::from(header.vox_offset);
    if !(start >= HEADER_BYTES as f64 && start.fract() == 0.0) {
        return Err(NiftiFileError::NotNifti {
            path: path.into(),
            reason: format!("its voxels start at byte {start}, inside the header"),
        });
    }
    let expected = (voxels * data_type(header, path)?.size_of()) as u64;
    let skip = start as u64 - HEADER_BYTES;
    let mut raw = Vec::new();
    let mut read = || -> std::io::Result<()> {
        std::io::copy(&mut stream.take(skip), &mut std::io::sink())?;
        stream.take(expected).read_to_end(&mut raw)?;
        Ok(())
    };
    // A gzip stream that was cut off ends with an error rather than quietly.
    if let Err(error) = read()
        && error.kind() != ErrorKind::UnexpectedEof
    {
        return Err(io(error));
    }
    if raw.len() as u64 != expected {
        return Err(NiftiFileError::Truncated {
            path: path.into(),
            found: raw.len() as u64,
            expected,
        });
    }
    Ok(raw)
}

/// The function that turns a voxel's bytes into its unscaled value.
fn decoder(header: &NiftiHeader, path: &Path) -> Result<fn(&[u8]) -> f64, NiftiFileError> {
    macro_rules! number {
        ($type:ty, $bytes:ident) => {
            |raw: &[u8]| {
                <$type>::$bytes(raw.try_into().expect("chunks have the datatype's size")) as f64
            }
        };
    }
    let little = header.endianness == Endianness::Little;
    macro_rules! either {
        ($type:ty) => {
            if little {
                number!($type, from_le_bytes)
            } else {
                number!($type, from_be_bytes)
            }
        };
    }
    Ok(match data_type(header, path)? {
        NiftiType::Uint8 => |raw: &[u8]| f64::from(raw[0]),
        NiftiType::Int8 => |raw: &[u8]| f64::from(raw[0] as i8),
        NiftiType::Uint16 => either!(u16),
        NiftiType::Int16 => either!(i16),
        NiftiType::Uint32 => either!(u32),
        NiftiType::Int32 => either!(i32),
        NiftiType::Uint64 => either!(u64),
        NiftiType::Int64 => either!(i64),
        NiftiType::Float32 => either!(f32),
        NiftiType::Float64 => either!(f64),
        _ => {
            return Err(NiftiFileError::DataType {
                path: path.into(),
                code: header.datatype,
            });
        }
    })
}

//! Voxel values as files hold them: numbers of several types in either byte order.

use super::{Grid, Volume, VolumeFileError, Voxel};
use std::path::Path;

/// The type of a file's numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SampleType {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

/// The order of a number's bytes in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

impl SampleType {
    /// Bytes of one number.
    pub fn size(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }

    /// The function that turns the bytes of one number into it.
    fn decoder(self, order: ByteOrder) -> fn(&[u8]) -> f64 {
        macro_rules! number {
            ($type:ty) => {
                match order {
                    ByteOrder::Little => |raw: &[u8]| {
                        <$type>::from_le_bytes(raw.try_into().expect("chunks have this size"))
                            as f64
                    },
                    ByteOrder::Big => |raw: &[u8]| {
                        <$type>::from_be_bytes(raw.try_into().expect("chunks have this size"))
                            as f64
                    },
                }
            };
        }
        match self {
            Self::U8 => number!(u8),
            Self::I8 => number!(i8),
            Self::U16 => number!(u16),
            Self::I16 => number!(i16),
            Self::U32 => number!(u32),
            Self::I32 => number!(i32),
            Self::U64 => number!(u64),
            Self::I64 => number!(i64),
            Self::F32 => number!(f32),
            Self::F64 => number!(f64),
        }
    }
}

/// The voxel of a file's value at a position in memory.
///
/// # Errors
/// When `T` cannot hold it.
pub(super) fn voxel_of<T: Voxel>(
    value: f64,
    grid: &Grid,
    offset: usize,
    path: &Path,
) -> Result<T, VolumeFileError> {
    T::from_file_value(value).map_err(|problem| VolumeFileError::Value {
        path: path.into(),
        voxel: grid.voxel(offset),
        value,
        problem,
    })
}

/// The volume of a file's raw numbers, i fastest; each becomes `number * slope + intercept`.
///
/// # Errors
/// When a value is none that `T` can hold.
///
/// # Panics
/// When `raw` has not as many bytes as the grid's voxels need.
pub(super) fn volume_of_samples<T: Voxel>(
    grid: Grid,
    raw: &[u8],
    (kind, order): (SampleType, ByteOrder),
    (slope, intercept): (f64, f64),
    path: &Path,
) -> Result<Volume<T>, VolumeFileError> {
    assert_eq!(raw.len(), grid.len() * kind.size(), "one number per voxel");
    let decode = kind.decoder(order);
    let mut data = Vec::with_capacity(grid.len());
    for (offset, bytes) in raw.chunks_exact(kind.size()).enumerate() {
        let value = decode(bytes) * slope + intercept;
        data.push(voxel_of(value, &grid, offset, path)?);
    }
    Ok(Volume::new(grid, data))
}

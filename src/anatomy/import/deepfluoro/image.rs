//! A group that holds an image.

use super::contents::{Named, Source};
use crate::anatomy::import::CtImportError;
use crate::volume::{Volume, VolumeFileError, Voxel, grid_from_affine};
use hdf5_pure::{DType, Dataset};
use nalgebra::Matrix3x4;

/// gzip, the data set's compression, cannot make a byte of more than 1032.
const MOST_BYTES_PER_BYTE: u64 = 1032;

/// Reads an image of three dimensions.
pub(super) fn read_image<T: Voxel>(
    source: &Source,
    (name, group): Named,
) -> Result<Volume<T>, CtImportError> {
    let dataset = |part: &str| {
        let name = format!("{name}/{part}");
        source.parts(group.dataset(part), &name).map(|d| (name, d))
    };
    let (pixels_name, pixels) = dataset("pixels")?;
    let dims = dims(source, &pixels_name, &pixels)?;
    let numbers = |part: &str, count: usize| {
        let (name, data) = dataset(part)?;
        read_numbers(source, &name, &data, count)
    };
    let (spacing, origin) = (numbers("spacing", 3)?, numbers("origin", 3)?);
    let directions = numbers("dir-mat", 9)?;
    let affine = Matrix3x4::from_fn(|row, column| match column {
        3 => origin[row],
        axis => directions[3 * row + axis] * spacing[axis],
    });
    let grid = grid_from_affine(&affine, dims)
        .map_err(|reason| source.problem(format!("{name}: {reason}")))?;
    let kind = source.parts(pixels.dtype(), &pixels_name)?;
    let narrow = matches!(
        kind,
        DType::F32 | DType::I8 | DType::U8 | DType::I16 | DType::U16
    );
    let wide = matches!(
        kind,
        DType::F64 | DType::I32 | DType::U32 | DType::I64 | DType::U64
    );
    // A float of 32 bits holds every number of the narrow types, in half the memory.
    let voxels: Result<Vec<T>, (usize, f64, _)> = if narrow {
        let values = source.parts(pixels.read_f32(), &pixels_name)?;
        collect(values.into_iter().map(f64::from))
    } else if wide {
        collect(source.parts(pixels.read_f64(), &pixels_name)?.into_iter())
    } else {
        return Err(source.problem(format!("{pixels_name} holds {kind}; expected numbers")));
    };
    let voxels = voxels.map_err(|(offset, value, problem)| VolumeFileError::Value {
        path: source.path.into(),
        voxel: grid.voxel(offset),
        value,
        problem,
    })?;
    if voxels.len() != grid.len() {
        return Err(source.problem(format!(
            "{pixels_name} has {} values; expected {}",
            voxels.len(),
            grid.len()
        )));
    }
    Ok(Volume::new(grid, voxels))
}

fn collect<T: Voxel>(
    values: impl Iterator<Item = f64>,
) -> Result<Vec<T>, (usize, f64, crate::volume::VoxelProblem)> {
    let voxel = |(offset, value): (usize, f64)| {
        T::from_file_value(value).map_err(|problem| (offset, value, problem))
    };
    values.enumerate().map(voxel).collect()
}

/// (columns, rows, slices): the fastest index is the last dimension's. What the file claims must be
/// possible for its size, so that no broken number asks for all memory.
fn dims(source: &Source, name: &str, pixels: &Dataset) -> Result<[usize; 3], CtImportError> {
    let shape = source.parts(pixels.shape(), name)?;
    let bad = || {
        source.problem(format!(
            "{name} has the dimensions {shape:?}; expected slices, rows and columns, more than one each, \
             and no more than the file's {} bytes can hold",
            source.bytes()
        ))
    };
    let [slices, rows, columns] = shape[..] else {
        return Err(bad());
    };
    let element = source.parts(pixels.element_size(), name)?;
    let bytes = slices
        .checked_mul(rows)
        .and_then(|n| n.checked_mul(columns))
        .and_then(|n| n.checked_mul(element));
    let most = source.bytes().saturating_mul(MOST_BYTES_PER_BYTE);
    let possible = bytes.is_some_and(|bytes| bytes <= most) && element <= 8;
    if shape.iter().any(|&n| n < 2) || !possible {
        return Err(bad());
    }
    check_storage(source, name, pixels, &shape, element)?;
    Ok([columns as usize, rows as usize, slices as usize])
}

/// Chunks are read and decompressed as a whole, and values of those that are not stored are made up: so all
/// must be stored, in the file, and none be larger than the dataset or than its bytes can hold.
fn check_storage(
    source: &Source,
    name: &str,
    data: &Dataset,
    shape: &[u64],
    element: u64,
) -> Result<(), CtImportError> {
    let bytes_of = |shape: &[u64]| {
        let count = shape.iter().try_fold(element, |n, &d| n.checked_mul(d));
        count.unwrap_or(u64::MAX)
    };
    let fits = |stored: u64, bytes: u64| stored.saturating_mul(MOST_BYTES_PER_BYTE) >= bytes;
    let possible = match source.parts(data.chunk_shape(), name)? {
        None => bytes_of(shape) <= source.bytes(),
        Some(chunk) => {
            let within = chunk.len() == shape.len() && chunk.iter().zip(shape).all(|(c, n)| c <= n);
            let bytes = bytes_of(&chunk);
            let chunks = match within {
                true => source.parts(data.chunks(), name)?,
                false => Vec::new(),
            };
            let stored = |c: &hdf5_pure::Chunk| {
                let end = c.address.saturating_add(c.storage_size);
                end <= source.bytes() && fits(c.storage_size, bytes)
            };
            let enough = bytes.saturating_mul(chunks.len() as u64) >= bytes_of(shape);
            within && enough && chunks.iter().all(stored)
        }
    };
    match possible {
        true => Ok(()),
        false => Err(source.problem(format!(
            "{name} claims {shape:?} values that the file does not hold; copy it again"
        ))),
    }
}

/// A dataset of `count` numbers in whatever shape: vectors are columns of a matrix here.
pub(super) fn read_numbers(
    source: &Source,
    name: &str,
    data: &Dataset,
    count: usize,
) -> Result<Vec<f64>, CtImportError> {
    let shape = source.parts(data.shape(), name)?;
    let found = shape.iter().try_fold(1u64, |n, &d| n.checked_mul(d));
    let element = source.parts(data.element_size(), name)?;
    let numbers = match found == Some(count as u64) && element <= 8 {
        true => {
            check_storage(source, name, data, &shape, element)?;
            source.parts(data.read_f64(), name)?
        }
        false => Vec::new(),
    };
    if numbers.len() != count || !numbers.iter().all(|v| v.is_finite()) {
        return Err(source.problem(format!(
            "{name} has the dimensions {shape:?}; expected {count} finite numbers"
        )));
    }
    Ok(numbers)
}

//! The voxel types that are read and written.

/// Why a file's value has no place in a voxel type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VoxelProblem {
    NotFinite,
    OutOfRange { min: i64, max: i64 },
    NotWhole,
}

impl std::fmt::Display for VoxelProblem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotFinite => write!(f, "expected a finite number"),
            Self::OutOfRange { min, max } => write!(f, "expected a number from {min} to {max}"),
            Self::NotWhole => write!(f, "expected a whole number, as a label is"),
        }
    }
}

/// A voxel type of a specimen's volumes: `i16` for Hounsfield units, `u8` for labels.
pub trait Voxel: Copy {
    /// The voxel of a file's value after the header's scaling. Hounsfield units are rounded to the
    /// nearest whole number, labels must be whole.
    ///
    /// # Errors
    /// When the value is not finite, out of the type's range, or (labels) not whole.
    fn from_file_value(value: f64) -> Result<Self, VoxelProblem>;
}

fn in_range(value: f64, min: i64, max: i64) -> Result<f64, VoxelProblem> {
    if !value.is_finite() {
        return Err(VoxelProblem::NotFinite);
    }
    let rounded = value.round();
    if rounded < min as f64 || rounded > max as f64 {
        return Err(VoxelProblem::OutOfRange { min, max });
    }
    Ok(rounded)
}

impl Voxel for i16 {
    fn from_file_value(value: f64) -> Result<Self, VoxelProblem> {
        in_range(value, i16::MIN.into(), i16::MAX.into()).map(|v| v as i16)
    }
}

impl Voxel for u8 {
    fn from_file_value(value: f64) -> Result<Self, VoxelProblem> {
        let rounded = in_range(value, 0, u8::MAX.into())?;
        if rounded != value {
            return Err(VoxelProblem::NotWhole);
        }
        Ok(rounded as u8)
    }
}

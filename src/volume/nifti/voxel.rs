//! The voxel types that are written.

use crate::volume::Voxel;
use ::nifti::writer::WriterOptions;
use ndarray::ArrayView3;

/// A voxel type that NIfTI files can hold.
pub trait NiftiVoxel: Voxel {
    /// Has the options write `values`, indexed [i, j, k].
    #[doc(hidden)]
    fn write(values: ArrayView3<Self>, options: &WriterOptions) -> ::nifti::Result<()>;
}

macro_rules! nifti_voxel {
    ($type:ty) => {
        impl NiftiVoxel for $type {
            fn write(values: ArrayView3<Self>, options: &WriterOptions) -> ::nifti::Result<()> {
                options.write_nifti(&values)
            }
        }
    };
}

nifti_voxel!(i16);
nifti_voxel!(u8);

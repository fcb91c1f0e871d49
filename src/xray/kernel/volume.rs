//! A bone's voxels as the kernels read them.

use super::occupancy::Occupancy;
use crate::volume::Volume;

/// Voxels of 15 bits with one scale, and where they are not zero.
#[derive(Clone, Debug)]
pub(crate) struct KernelVolume {
    /// Number of voxels along each axis.
    pub dims: [usize; 3],
    /// Each voxel with its neighbour along j, so that one load of 64 bits gives the four corners
    /// of a sample that lie on one slice; i fastest. Past the last voxel lie as many zeros as a
    /// sample on the uppermost slice reads.
    pub pairs: Vec<[i16; 2]>,
    /// Attenuation per mm of one unit of the voxels.
    pub unit: f32,
    pub occupancy: Occupancy,
}

/// The largest voxel: all that a signed 16-bit number holds.
const FULL_SCALE: f32 = 32767.0;

impl KernelVolume {
    /// The greatest number of voxels along an axis, so that fixed-point positions do not overflow.
    pub const LARGEST: usize = 960;

    /// Prepares a volume that has a zero border and a voxel above zero.
    ///
    /// # Panics
    /// When an axis has more than [`Self::LARGEST`] voxels.
    pub fn new(volume: &Volume<f32>) -> Self {
        let dims = volume.grid.dims;
        assert!(
            dims.iter().all(|&n| n <= Self::LARGEST),
            "a bone of {dims:?} voxels cannot be projected; expected at most {} along an axis: \
             resample the CT to larger voxels",
            Self::LARGEST
        );
        let [nx, ny, nz] = dims;
        let largest = volume.data.iter().fold(0.0f32, |a, &b| a.max(b));
        let per_unit = FULL_SCALE / largest;
        let mut pairs = vec![[0i16; 2]; nx * ny * (nz + 1) + 2];
        for k in 0..nz {
            for j in 0..ny {
                let row = volume.grid.offset(0, j, k);
                for i in 0..nx {
                    let value = (volume.data[row + i] * per_unit).round() as i16;
                    pairs[row + i][0] = value;
                    if j > 0 {
                        pairs[row + i - nx][1] = value;
                    }
                }
            }
        }
        Self {
            occupancy: Occupancy::new(dims, &pairs),
            dims,
            pairs,
            unit: largest / FULL_SCALE,
        }
    }
}

//! A bone's voxels as the kernels read them.

use super::occupancy::Occupancy;
use crate::geometry::Vector;
use crate::volume::Volume;

/// Voxels of 15 bits with one scale, and where they are not zero.
#[derive(Clone, Debug)]
pub(crate) struct KernelVolume {
    /// Number of voxels stored along each axis: those of the volume, and one more zero layer at
    /// each upper end, so that a sample exactly on the last voxel may read its upper neighbour.
    pub dims: [usize; 3],
    /// `dims` values from 0 to [`FULL_SCALE`], i fastest.
    pub voxels: Vec<i16>,
    /// Attenuation per mm of one unit of `voxels`.
    pub unit: f32,
    /// Box of indices outside which the interpolated volume is zero.
    pub min: Vector,
    pub max: Vector,
    pub occupancy: Occupancy,
}

/// The largest voxel: all that a signed 16-bit number holds.
const FULL_SCALE: f32 = 32767.0;

impl KernelVolume {
    /// Prepares a volume that has a zero border and a voxel above zero.
    pub fn new(volume: &Volume<f32>) -> Self {
        let [nx, ny, nz] = volume.grid.dims;
        let largest = volume.data.iter().fold(0.0f32, |a, &b| a.max(b));
        let dims = [nx + 1, ny + 1, nz + 1];
        let mut voxels = vec![0i16; dims.iter().product()];
        let per_unit = FULL_SCALE / largest;
        for k in 0..nz {
            for j in 0..ny {
                let source = &volume.data[volume.grid.offset(0, j, k)..][..nx];
                let target = &mut voxels[(k * dims[1] + j) * dims[0]..][..nx];
                for (t, &s) in target.iter_mut().zip(source) {
                    *t = (s * per_unit).round() as i16;
                }
            }
        }
        Self {
            occupancy: Occupancy::new(dims, &voxels),
            dims,
            voxels,
            unit: largest / FULL_SCALE,
            min: Vector::zeros(),
            max: Vector::new(nx as f64 - 1.0, ny as f64 - 1.0, nz as f64 - 1.0),
        }
    }
}

//! A volume's voxels as the kernels read them.

use super::occupancy::Occupancy;
use crate::volume::{Grid, Volume};
use rayon::prelude::*;
use std::ops::Range;

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

/// Who prepares a volume.
#[derive(Clone, Copy)]
enum Work {
    /// The calling thread. A volume that is made when it is first needed must not wait for a pool of
    /// threads of which one may be waiting for the same volume.
    OneThread,
    /// The pool's threads.
    AllThreads,
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
        let largest = volume.data.iter().fold(0.0f32, |a, &b| a.max(b));
        let row = |j, k| &volume.data[volume.grid.offset(0, j, k)..][..dims[0]];
        Self::of_rows(dims, row, |value| value, largest, Work::OneThread)
    }

    /// Prepares `part` of the values of the voxels `block` of a volume, none above `largest`, with a
    /// border of one zero voxel around them. The grid returned is that of the block with its border.
    ///
    /// # Panics
    /// When an axis has more than [`Self::LARGEST`] voxels, border included.
    pub fn bordered(
        volume: &Volume<f32>,
        block: &[Range<usize>; 3],
        part: impl Fn(f32) -> f32 + Sync,
        largest: f32,
    ) -> (Grid, Self) {
        let [along_i, along_j, along_k] = block;
        let first = block.each_ref().map(|range| range.start as f64 - 1.0);
        let grid = Grid {
            dims: block.each_ref().map(|range| range.len() + 2),
            origin: volume.grid.point(first[0], first[1], first[2]),
            ..volume.grid.clone()
        };
        let inside = |n: usize, range: &Range<usize>| (1..=range.len()).contains(&n);
        let row = |j: usize, k: usize| {
            if !inside(j, along_j) || !inside(k, along_k) {
                return &[][..];
            }
            let (j, k) = (along_j.start + j - 1, along_k.start + k - 1);
            &volume.data[volume.grid.offset(along_i.start, j, k)..][..along_i.len()]
        };
        let kernel = Self::of_rows(grid.dims, row, part, largest, Work::AllThreads);
        (grid, kernel)
    }

    /// Of rows along i, of which a zero border may be left out, or everything.
    fn of_rows<'a>(
        dims: [usize; 3],
        row: impl Fn(usize, usize) -> &'a [f32] + Sync,
        part: impl Fn(f32) -> f32 + Sync,
        largest: f32,
        work: Work,
    ) -> Self {
        assert!(
            dims.iter().all(|&n| n <= Self::LARGEST),
            "a bone of {dims:?} voxels cannot be projected; expected at most {} along an axis: \
             resample the CT to larger voxels",
            Self::LARGEST
        );
        let [nx, ny, nz] = dims;
        let per_unit = FULL_SCALE / largest;
        let mut pairs = vec![[0i16; 2]; nx * ny * (nz + 1) + 2];
        let fill = |k: usize, slice: &mut [[i16; 2]]| {
            for j in 0..ny {
                let values = row(j, k);
                let at = j * nx + (nx - values.len()) / 2;
                for (i, &value) in values.iter().enumerate() {
                    let value = (part(value) * per_unit).round() as i16;
                    slice[at + i][0] = value;
                    if j > 0 {
                        slice[at + i - nx][1] = value;
                    }
                }
            }
        };
        let slices = pairs[..nx * ny * nz].chunks_exact_mut(nx * ny);
        match work {
            Work::OneThread => slices.enumerate().for_each(|(k, slice)| fill(k, slice)),
            Work::AllThreads => (slices.collect::<Vec<_>>().into_par_iter())
                .enumerate()
                .for_each(|(k, slice)| fill(k, slice)),
        }
        Self {
            occupancy: Occupancy::new(dims, &pairs),
            dims,
            pairs,
            unit: largest / FULL_SCALE,
        }
    }
}

//! The sums over slices on a lattice's points.

use super::tables::{BLOCK, GROUP, Tables};
use super::{Lattice, SliceStack};
use crate::simd::SimdLevel;

/// Points to each side of those that hold sums, which are zero: the warp reads them.
pub(super) const MARGIN: usize = 16;

/// Sixteen points' sums in one cache line.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct BlockSums(pub [f32; BLOCK as usize]);

/// The sums on one lattice, with a border of zeros: a block to the left and to the right,
/// [`MARGIN`] rows above and below. In units of the voxels over the weights' 2^13.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sums {
    /// Blocks of a row, borders included.
    pub(super) stride: usize,
    pub(super) blocks: Vec<BlockSums>,
}

impl Sums {
    /// Zeros for all points of a lattice. Allocates only when none was as large before.
    pub fn reset(&mut self, lattice: &Lattice) {
        let blocks = (lattice.blocks.1 - lattice.blocks.0) as usize;
        let rows = (lattice.rows.1 - lattice.rows.0) as usize;
        self.stride = blocks + 2;
        self.blocks.clear();
        self.blocks
            .resize(self.stride * (rows + 2 * MARGIN), BlockSums::default());
    }

    /// The blocks of a row of the lattice, without borders.
    #[inline(always)]
    pub(super) fn row(&mut self, lattice: &Lattice, row: i32) -> &mut [BlockSums] {
        let row = (row - lattice.rows.0) as usize + MARGIN;
        &mut self.blocks[row * self.stride + 1..(row + 1) * self.stride - 1]
    }
}

/// How many groups of slices a stack has.
pub(crate) fn groups(stack: &SliceStack) -> usize {
    stack.dims[2].div_ceil(GROUP)
}

/// Adds the slices of one group to the sums. `tables` is memory to work in.
pub(crate) fn add_group(
    level: SimdLevel,
    lattice: &Lattice,
    stack: &SliceStack,
    group: usize,
    tables: &mut Tables,
    sums: &mut Sums,
) {
    match level {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: a level above portable is only given where the processor has it.
        SimdLevel::Avx512 => unsafe {
            super::avx512::add_group(lattice, stack, group * GROUP, tables, sums);
        },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above.
        SimdLevel::Avx2 => unsafe {
            super::avx2::add_group(lattice, stack, group * GROUP, tables, sums);
        },
        _ => super::portable::add_group(lattice, stack, group * GROUP, tables, sums),
    }
}

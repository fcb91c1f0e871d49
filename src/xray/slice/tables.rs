//! What all rows of a group of slices share: where each point of the lattice lies in its row of
//! voxels.

use super::stack::{CELL, WINDOW};
use super::{Lattice, SliceStack};

/// Points of the lattice that are done at once, side by side along x. Blocks begin at multiples.
pub(super) const BLOCK: i32 = 16;
/// Slices that are summed in 32 bits before the sum goes on in floating point: eight samples of 15
/// bits with weights of 13 bits are less than 2^31.
pub(super) const GROUP: usize = 8;
/// Bits of the weights along columns of voxels.
pub(super) const COLUMN_BITS: u32 = 13;
/// Bits of the weights along rows of voxels.
pub(super) const ROW_BITS: u32 = 15;
/// Fractional bits of positions in a slice.
const WIDE_BITS: u32 = 32;
/// Fractional bits of positions within a block.
const BITS: u32 = 25;

/// A group of slices with its tables for one lattice. Kept from group to group for its memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tables {
    /// Number of slices, at most [`GROUP`].
    pub slices: usize,
    /// Rows of the lattice, first and behind the last, that can meet something.
    pub rows: (i32, i32),
    pub(super) slice: [GroupSlice; GROUP],
    /// For each block, and in it for each slice, what its points need.
    pub(super) blocks: Vec<BlockTables>,
}

/// One slice of a group.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct GroupSlice {
    pub number: usize,
    /// Row of voxels of the lattice's row 0, and what a row adds, in `WIDE_BITS`, half a weight
    /// included.
    row: i64,
    row_step: i64,
}

/// What the points of one block need in each slice of a group.
#[derive(Clone, Debug, Default)]
#[repr(align(64))]
pub(super) struct BlockTables {
    /// The cells of a row that the points read; none for a slice that the group does not have.
    pub cells: [u64; GROUP],
    /// The first point's left voxel, from the row's first; negative beside the row.
    pub window: [i32; GROUP],
    pub columns: [Columns; GROUP],
}

/// The points of a block in one slice.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct Columns {
    /// For each point the places of its two voxels in the window.
    pub places: [[u16; 2]; BLOCK as usize],
    /// Their weights, which sum to 2^[`COLUMN_BITS`].
    pub weights: [[i16; 2]; BLOCK as usize],
}

impl Tables {
    /// Makes the tables of the group that begins with slice `first`. False if nothing of it can be
    /// seen; the tables are then of no use.
    #[inline(always)]
    pub fn prepare(&mut self, lattice: &Lattice, stack: &SliceStack, first: usize) -> bool {
        self.slices = GROUP.min(stack.dims[2] - first);
        self.rows = (i32::MAX, i32::MIN);
        let mut seen = [false; GROUP];
        for n in 0..self.slices {
            let number = first + n;
            let (row, step) = lattice.positions(number, 1);
            let (above, below) = stack.occupied_rows(number);
            if above < below {
                // Rows of the lattice between those of voxels, one more to either side for rounding.
                let from = ((f64::from(above) - row) / step).floor() - 1.0;
                let to = ((f64::from(below) - row) / step).ceil() + 2.0;
                let (from, to) = (
                    lattice.rows.0.max(from as i32),
                    lattice.rows.1.min(to as i32),
                );
                seen[n] = from < to;
                if seen[n] {
                    self.rows = (self.rows.0.min(from), self.rows.1.max(to));
                }
            }
            self.slice[n] = GroupSlice {
                number,
                row: wide(row) + (1 << (WIDE_BITS - ROW_BITS - 1)),
                row_step: wide(step),
            };
        }
        if self.rows.0 >= self.rows.1 {
            return false;
        }
        let blocks = (lattice.blocks.1 - lattice.blocks.0) as usize;
        if self.blocks.len() < blocks {
            self.blocks.resize_with(blocks, BlockTables::default);
        }
        for n in 0..GROUP {
            if !seen[n] {
                for tables in &mut self.blocks[..blocks] {
                    tables.cells[n] = 0;
                }
                continue;
            }
            let (column, step) = lattice.positions(self.slice[n].number, 0);
            let (column, step) = (wide(column), wide(step));
            for (b, tables) in self.blocks[..blocks].iter_mut().enumerate() {
                let point = i64::from((lattice.blocks.0 + b as i32) * BLOCK);
                tables.prepare(n, column + step * point, step, stack.dims[0]);
            }
        }
        true
    }
}

impl GroupSlice {
    /// The row of voxels above a row of the lattice and the weight of the one below it, in
    /// [`ROW_BITS`]. Both rows lie in the slice, or the result is `None`.
    #[inline(always)]
    pub fn row(&self, point: i32, rows: usize) -> Option<(usize, i16)> {
        let at = self.row + self.row_step * i64::from(point);
        let row = at >> WIDE_BITS;
        let weight = (at >> (WIDE_BITS - ROW_BITS)) & ((1 << ROW_BITS) - 1);
        // Read without sign, a negative row is large.
        ((row as u64) < rows as u64 - 1).then_some((row as usize, weight as i16))
    }
}

impl BlockTables {
    /// Fills in slice `n`, in whose rows of `voxels` voxels the first point is at `start`.
    #[inline(always)]
    fn prepare(&mut self, n: usize, start: i64, step: i64, voxels: usize) {
        const HALF_WEIGHT: i32 = 1 << (BITS - COLUMN_BITS - 1);
        let window = (start >> WIDE_BITS) as i32;
        let fraction = ((start & ((1 << WIDE_BITS) - 1)) >> (WIDE_BITS - BITS)) as i32;
        let step = (step >> (WIDE_BITS - BITS)) as i32;
        let last = (fraction + step * (BLOCK - 1)) >> BITS;
        self.window[n] = window;
        self.cells[n] = cells(window, window + last + 2, voxels);
        if self.cells[n] == 0 {
            return;
        }
        let columns = &mut self.columns[n];
        for i in 0..BLOCK {
            let at = fraction + HALF_WEIGHT + step * i;
            let place = (at >> BITS) as u16;
            let weight = ((at >> (BITS - COLUMN_BITS)) & ((1 << COLUMN_BITS) - 1)) as i16;
            columns.places[i as usize] = [place, place + 1];
            columns.weights[i as usize] = [(1 << COLUMN_BITS) - weight, weight];
        }
        debug_assert!((columns.places[BLOCK as usize - 1][1] as usize) < WINDOW);
    }
}

/// The mask of the cells that hold the voxels `first..=last`, of which some may lie beside the row.
#[inline(always)]
fn cells(first: i32, last: i32, voxels: usize) -> u64 {
    let (first, last) = (first.max(0), last.min(voxels as i32 - 1));
    if first > last {
        return 0;
    }
    let (first, last) = (first as u32 / CELL as u32, last as u32 / CELL as u32);
    (u64::MAX << first) & (u64::MAX >> (63 - last))
}

/// A position in fixed point.
#[inline(always)]
fn wide(position: f64) -> i64 {
    (position * (1u64 << WIDE_BITS) as f64).round() as i64
}

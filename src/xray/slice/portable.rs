//! Sums over slices in plain Rust.

use super::stack::WINDOW;
use super::sums::Sums;
use super::tables::{GROUP, ROW_BITS, Tables};
use super::{Lattice, SliceStack};

/// Adds the slices of the group that begins with `first` to the sums.
pub(super) fn add_group(
    lattice: &Lattice,
    stack: &SliceStack,
    first: usize,
    tables: &mut Tables,
    sums: &mut Sums,
) {
    if !tables.prepare(lattice, stack, first) {
        return;
    }
    let voxels = stack.voxels();
    for point in tables.rows.0..tables.rows.1 {
        let row = Row::new(tables, stack, point);
        if row.cells == [0; GROUP] {
            continue;
        }
        for (sums, block) in sums.row(lattice, point).iter_mut().zip(&tables.blocks) {
            let mut group = [0i32; 16];
            for n in 0..tables.slices {
                if row.cells[n] & block.cells[n] == 0 {
                    continue;
                }
                let upper = row.start[n].wrapping_add_signed(block.window[n] as isize);
                let upper = &voxels[upper..];
                let lower = &upper[stack.stride..][..WINDOW];
                let columns = &block.columns[n];
                for (i, sum) in group.iter_mut().enumerate() {
                    for (place, weight) in columns.places[i].into_iter().zip(columns.weights[i]) {
                        let (a, b) = (upper[usize::from(place)], lower[usize::from(place)]);
                        let part = (i32::from(b) - i32::from(a)) * i32::from(row.weight[n]);
                        let voxel = i32::from(a) + ((part + (1 << (ROW_BITS - 1))) >> ROW_BITS);
                        *sum += voxel * i32::from(weight);
                    }
                }
            }
            for (sum, group) in sums.0.iter_mut().zip(group) {
                *sum += group as f32;
            }
        }
    }
}

/// Where a row of the lattice lies in each slice of a group.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct Row {
    /// The cells of the two rows of voxels that hold something; none where there are not two.
    pub cells: [u64; GROUP],
    /// Where the upper row begins.
    pub start: [usize; GROUP],
    /// Weight of the lower row.
    pub weight: [i16; GROUP],
}

impl Row {
    #[inline(always)]
    pub fn new(tables: &Tables, stack: &SliceStack, point: i32) -> Self {
        let mut row = Self::default();
        for (n, slice) in tables.slice[..tables.slices].iter().enumerate() {
            if let Some((upper, weight)) = slice.row(point, stack.dims[1]) {
                row.cells[n] = stack.cells(slice.number)[upper];
                row.start[n] = stack.row_start(slice.number, upper);
                row.weight[n] = weight;
            }
        }
        row
    }
}

//! A bone's voxels as slices across one axis.

use crate::volume::Volume;

/// Voxels that a kernel reads at once, so zeros that lie between rows.
pub(super) const WINDOW: usize = 32;
/// Columns of voxels that share a bit of a row's mask.
pub(super) const CELL: usize = 16;
/// The largest voxel: all that a signed 16-bit number holds.
pub(super) const FULL_SCALE: f32 = 32767.0;

/// Voxels of 15 bits with one scale, slice after slice across one axis of the volume.
#[derive(Clone, Debug)]
pub(crate) struct SliceStack {
    /// Which axes of the volume are columns, rows and slices.
    pub axes: [usize; 3],
    /// Number of columns, rows and slices.
    pub dims: [usize; 3],
    /// Distance of rows in `voxels`.
    pub stride: usize,
    /// [`WINDOW`] zeros, then all rows, each with as many zeros after it: a window that overlaps a
    /// row by one voxel lies in memory, and reads zeros beside the row.
    voxels: Vec<i16>,
    /// For each row (slice after slice) which of its cells, or of those of the next row, hold a
    /// voxel other than zero; none for a slice's last row.
    cells: Vec<u64>,
    /// For each slice the rows, first and behind the last, whose cells are not all empty.
    rows: Vec<(u32, u32)>,
    /// Attenuation per mm of one unit of the voxels.
    pub unit: f32,
}

impl SliceStack {
    /// The greatest number of voxels along an axis, so that a row's cells fit one mask.
    pub const LARGEST: usize = 64 * CELL;

    /// The slices of a volume across axis `across` (0 to 2). The volume has a zero border and a voxel
    /// above zero.
    ///
    /// # Panics
    /// When an axis has more than [`Self::LARGEST`] voxels.
    pub fn new(volume: &Volume<f32>, across: usize) -> Self {
        // Rows lie along i where they can, since voxels do.
        let axes = [[1, 2, 0], [0, 2, 1], [0, 1, 2]][across];
        let grid = &volume.grid;
        assert!(
            grid.dims.iter().all(|&n| n <= Self::LARGEST),
            "a bone of {:?} voxels cannot be projected in slices; expected at most {} along an \
             axis: resample the CT to larger voxels",
            grid.dims,
            Self::LARGEST
        );
        let dims = axes.map(|axis| grid.dims[axis]);
        let [columns, rows, slices] = dims;
        let steps = [1, grid.dims[0], grid.dims[0] * grid.dims[1]];
        let steps = axes.map(|axis| steps[axis]);
        let largest = volume.data.iter().fold(0.0f32, |a, &b| a.max(b));
        let per_unit = FULL_SCALE / largest;
        let stride = columns + WINDOW;
        let mut voxels = vec![0i16; WINDOW + slices * rows * stride];
        let mut own = vec![0u64; slices * rows];
        // Slices within rows: where voxels of a row are far apart, those of its neighbours across
        // slices are near.
        for row in 0..rows {
            for slice in 0..slices {
                let number = slice * rows + row;
                let from = &volume.data[slice * steps[2] + row * steps[1]..];
                let to = &mut voxels[WINDOW + number * stride..][..columns];
                for (column, (to, value)) in
                    to.iter_mut().zip(from.iter().step_by(steps[0])).enumerate()
                {
                    if *value != 0.0 {
                        *to = (value * per_unit).round() as i16;
                        own[number] |= u64::from(*to != 0) << (column / CELL);
                    }
                }
            }
        }
        let mut cells = own.clone();
        let mut occupied = Vec::with_capacity(slices);
        for (cells, own) in cells.chunks_exact_mut(rows).zip(own.chunks_exact(rows)) {
            for row in 0..rows - 1 {
                cells[row] |= own[row + 1];
            }
            cells[rows - 1] = 0;
            let first = cells.iter().position(|&c| c != 0).unwrap_or(0);
            let end = cells.iter().rposition(|&c| c != 0).map_or(0, |row| row + 1);
            occupied.push((first as u32, end as u32));
        }
        Self {
            axes,
            dims,
            stride,
            voxels,
            cells,
            rows: occupied,
            unit: largest / FULL_SCALE,
        }
    }

    /// Where a row begins in [`Self::voxels`].
    #[inline(always)]
    pub fn row_start(&self, slice: usize, row: usize) -> usize {
        WINDOW + (slice * self.dims[1] + row) * self.stride
    }

    /// All voxels with the zeros between them.
    #[inline(always)]
    pub fn voxels(&self) -> &[i16] {
        &self.voxels
    }

    /// The masks of a slice's rows, each with the next row's.
    #[inline(always)]
    pub fn cells(&self, slice: usize) -> &[u64] {
        &self.cells[slice * self.dims[1]..][..self.dims[1]]
    }

    /// The rows of a slice, first and behind the last, between which and the next something is.
    #[inline(always)]
    pub fn occupied_rows(&self, slice: usize) -> (u32, u32) {
        self.rows[slice]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::volume::Grid;

    #[test]
    fn slices_across_every_axis_hold_the_same_voxels() {
        let grid = Grid::axis_aligned([37, 6, 5], 1.0, Point::origin());
        let mut volume = Volume::filled(grid.clone(), 0.0f32);
        let places = [[1, 1, 1], [35, 4, 3], [17, 2, 3]];
        for (n, [i, j, k]) in places.into_iter().enumerate() {
            volume.data[grid.offset(i, j, k)] = (n + 1) as f32;
        }
        for across in 0..3 {
            let stack = SliceStack::new(&volume, across);
            assert_eq!(stack.axes[2], across);
            let total: i64 = stack.voxels().iter().map(|&v| i64::from(v)).sum();
            assert_eq!(total, 10922 + 21845 + 32767);
            for (n, place) in places.into_iter().enumerate() {
                let [column, row, slice] = stack.axes.map(|axis| place[axis]);
                let voxel = stack.voxels()[stack.row_start(slice, row) + column];
                let expected = (n + 1) as f32 / 3.0 * FULL_SCALE;
                assert_eq!(voxel, expected.round() as i16);
                // The row and the one before it know of the voxel.
                for row in [row - 1, row] {
                    assert_ne!(stack.cells(slice)[row] >> (column / CELL) & 1, 0);
                }
                let (first, end) = stack.occupied_rows(slice);
                assert!((first as usize) < row && row < end as usize);
            }
            let bits: u32 = stack.cells.iter().map(|c| c.count_ones()).sum();
            assert_eq!(bits, 6, "each voxel marks two rows");
        }
    }
}

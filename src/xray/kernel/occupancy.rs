//! Where a volume is empty, so that rays can leap.

/// How far each cell of 4 x 4 x 4 voxels is from everything that is not zero.
#[derive(Clone, Debug)]
pub(crate) struct Occupancy {
    /// Number of cells along each axis.
    pub dims: [usize; 3],
    /// Clearance of each cell, i fastest, and after the last cell [`PADDING`] bytes.
    clearance: Vec<u8>,
}

/// Bytes after the table, so that 32 bits can be loaded from the place of any cell.
const PADDING: usize = 3;

impl Occupancy {
    /// Edge of a cell in voxels is two to this power.
    pub const SHIFT: u32 = 2;
    /// Edge of a cell in voxels.
    pub const EDGE: usize = 1 << Self::SHIFT;

    /// Of voxels stored i fastest, each with a neighbour that does not matter here.
    pub fn new(dims: [usize; 3], voxels: &[[i16; 2]]) -> Self {
        let cells = dims.map(|n| n.div_ceil(Self::EDGE));
        let mut occupancy = Self {
            dims: cells,
            clearance: vec![u8::MAX; cells.iter().product::<usize>() + PADDING],
        };
        let rows = BitRows::new(dims, voxels);
        // From wide to narrow, so that the smallest clearance stays.
        for clearance in (0..Self::EDGE).rev() {
            occupancy.mark(&rows, clearance);
        }
        occupancy.spread();
        occupancy
    }

    /// The clearances of all cells and at least three bytes after them.
    #[cfg(target_arch = "x86_64")]
    pub fn padded(&self) -> &[u8] {
        &self.clearance
    }

    /// The clearance of a cell: how many voxels it can grow on all sides before it touches a place
    /// where interpolation may be other than zero. 0 where there is such a place in the cell
    /// itself; at most 255.
    #[inline(always)]
    pub fn clearance(&self, cell: [usize; 3]) -> u8 {
        self.clearance[(cell[2] * self.dims[1] + cell[1]) * self.dims[0] + cell[0]]
    }

    /// Gives the cells their clearance that have this one or a smaller one. A voxel is felt up to
    /// the next voxel on either side, so those that matter to a cell grown by n voxels are its own,
    /// n more below and n + 1 above.
    fn mark(&mut self, rows: &BitRows, clearance: usize) {
        let [nx, ny, nz] = self.dims;
        let range = |cell: usize, size: usize| {
            let first = (cell * Self::EDGE).saturating_sub(clearance);
            first..((cell + 1) * Self::EDGE + clearance + 1).min(size)
        };
        let mut merged = vec![0u64; rows.words];
        for z in 0..nz {
            for y in 0..ny {
                merged.fill(0);
                for k in range(z, rows.dims[2]) {
                    for j in range(y, rows.dims[1]) {
                        for (m, r) in merged.iter_mut().zip(rows.row(j, k)) {
                            *m |= r;
                        }
                    }
                }
                for x in 0..nx {
                    if any_bit(&merged, range(x, rows.dims[0])) {
                        self.clearance[(z * ny + y) * nx + x] = clearance as u8;
                    }
                }
            }
        }
    }

    /// Larger clearances follow from those of the 26 neighbours: a cell grown by n voxels is the
    /// union of the neighbours grown by n less a cell's edge. Two sweeps are exact.
    fn spread(&mut self) {
        let [nx, ny, nz] = self.dims.map(|n| n as isize);
        // The 13 neighbours that precede a cell in memory; the other 13 are their opposites.
        let before: Vec<[isize; 3]> = (0..13)
            .map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1])
            .collect();
        let mut sweep = |sign: isize| {
            for at in 0..nx * ny * nz {
                let at = if sign > 0 { at } else { nx * ny * nz - 1 - at };
                let cell = [at % nx, at / nx % ny, at / (nx * ny)];
                let mut clearance = self.clearance[at as usize];
                for step in &before {
                    let [x, y, z]: [isize; 3] = std::array::from_fn(|a| cell[a] + sign * step[a]);
                    if (0..nx).contains(&x) && (0..ny).contains(&y) && (0..nz).contains(&z) {
                        let neighbour = self.clearance[((z * ny + y) * nx + x) as usize];
                        clearance = clearance.min(neighbour.saturating_add(Self::EDGE as u8));
                    }
                }
                self.clearance[at as usize] = clearance;
            }
        };
        sweep(1);
        sweep(-1);
    }
}

/// One bit for each voxel: set where it is not zero.
struct BitRows {
    dims: [usize; 3],
    /// Words of a row.
    words: usize,
    bits: Vec<u64>,
}

impl BitRows {
    fn new(dims: [usize; 3], voxels: &[[i16; 2]]) -> Self {
        let words = dims[0].div_ceil(64);
        let mut bits = vec![0u64; words * dims[1] * dims[2]];
        for (row, target) in voxels
            .chunks_exact(dims[0])
            .zip(bits.chunks_exact_mut(words))
        {
            for (i, _) in row.iter().enumerate().filter(|(_, v)| v[0] != 0) {
                target[i / 64] |= 1 << (i % 64);
            }
        }
        Self { dims, words, bits }
    }

    fn row(&self, j: usize, k: usize) -> &[u64] {
        &self.bits[(k * self.dims[1] + j) * self.words..][..self.words]
    }
}

/// Whether any bit of a range is set.
fn any_bit(bits: &[u64], range: std::ops::Range<usize>) -> bool {
    let last = range.end - 1;
    (range.start / 64..=last / 64).any(|word| {
        let mut mask = u64::MAX;
        if word == range.start / 64 {
            mask &= u64::MAX << (range.start % 64);
        }
        if word == last / 64 {
            mask &= u64::MAX >> (63 - last % 64);
        }
        bits[word] & mask != 0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clearances_are_the_distances_of_cells_from_what_interpolation_reads() {
        let dims = [121, 17, 26];
        let mut voxels = vec![[0i16; 2]; dims.iter().product()];
        let places = [[4, 5, 6], [119, 0, 25], [7, 8, 8], [66, 9, 17]];
        for [i, j, k] in places {
            voxels[(k * dims[1] + j) * dims[0] + i][0] = 3;
        }
        let o = Occupancy::new(dims, &voxels);
        assert_eq!(o.dims, [31, 5, 7]);
        for z in 0..7 {
            for y in 0..5 {
                for x in 0..31 {
                    let cell = [x, y, z];
                    // Grown by n voxels the cell reaches from low - n to low + 4 + n, and a voxel
                    // is felt less than one voxel from its centre.
                    let expected = places
                        .iter()
                        .map(|place: &[usize; 3]| {
                            (0..3)
                                .map(|a| {
                                    let (low, v) = (4 * cell[a] as i32, place[a] as i32);
                                    (v - low - 4).max(low - v).max(0)
                                })
                                .max()
                                .unwrap()
                        })
                        .min()
                        .unwrap();
                    assert_eq!(i32::from(o.clearance(cell)), expected, "cell {cell:?}");
                }
            }
        }
    }
}

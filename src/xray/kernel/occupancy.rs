//! Where a volume is empty, so that rays can leap.

/// Bytes after the table, so that 32 bits can be loaded from the place of any cell.
const PADDING: usize = 3;

/// The distance of each cell of 4 x 4 x 4 voxels from the nearest cell that holds something.
#[derive(Clone, Debug)]
pub(crate) struct Occupancy {
    /// Number of cells along each axis.
    pub dims: [usize; 3],
    /// Chebyshev distance in cells, i fastest: 0 where interpolation inside the cell can be other
    /// than zero. After the last cell come [`PADDING`] bytes.
    distance: Vec<u8>,
}

impl Occupancy {
    /// Edge of a cell in voxels is two to this power.
    pub const SHIFT: usize = 2;
    /// Edge of a cell in voxels.
    pub const EDGE: usize = 1 << Self::SHIFT;

    /// Of voxels stored i fastest. A cell holds the positions from its first voxel up to (and
    /// without) the first of the next, so its interpolation reads one layer of the next cells too.
    pub fn new(dims: [usize; 3], voxels: &[[i16; 2]]) -> Self {
        let cells = dims.map(|n| n.div_ceil(Self::EDGE));
        let index = |c: [usize; 3]| (c[2] * cells[1] + c[1]) * cells[0] + c[0];
        let mut distance = vec![u8::MAX; cells.iter().product::<usize>() + PADDING];
        for k in 0..dims[2] {
            for j in 0..dims[1] {
                let row = &voxels[(k * dims[1] + j) * dims[0]..][..dims[0]];
                for (i, _) in row.iter().enumerate().filter(|&(_, v)| v[0] != 0) {
                    // A voxel is read from its own cell and, when first in it, from the one below.
                    for z in k.saturating_sub(1) >> Self::SHIFT..=k >> Self::SHIFT {
                        for y in j.saturating_sub(1) >> Self::SHIFT..=j >> Self::SHIFT {
                            for x in i.saturating_sub(1) >> Self::SHIFT..=i >> Self::SHIFT {
                                distance[index([x, y, z])] = 0;
                            }
                        }
                    }
                }
            }
        }
        let mut occupancy = Self {
            dims: cells,
            distance,
        };
        occupancy.fill_distances();
        occupancy
    }

    /// The distances of all cells and at least three bytes after them.
    pub fn padded(&self) -> &[u8] {
        &self.distance
    }

    /// The distance of a cell.
    #[inline(always)]
    pub fn at(&self, cell: [usize; 3]) -> u8 {
        self.distance[(cell[2] * self.dims[1] + cell[1]) * self.dims[0] + cell[0]]
    }

    /// Two sweeps in which each cell is at most one further than its neighbours that came before:
    /// exact for the Chebyshev distance, where all 26 neighbours are at distance one.
    fn fill_distances(&mut self) {
        let [nx, ny, nz] = self.dims.map(|n| n as isize);
        // The 13 neighbours that precede a cell in memory; the other 13 are their opposites.
        let before: Vec<[isize; 3]> = (0..13)
            .map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1])
            .collect();
        let mut sweep = |sign: isize| {
            for at in 0..nx * ny * nz {
                let at = if sign > 0 { at } else { nx * ny * nz - 1 - at };
                let cell = [at % nx, at / nx % ny, at / (nx * ny)];
                let mut distance = self.distance[at as usize];
                for step in &before {
                    let [x, y, z]: [isize; 3] = std::array::from_fn(|a| cell[a] + sign * step[a]);
                    if (0..nx).contains(&x) && (0..ny).contains(&y) && (0..nz).contains(&z) {
                        let neighbour = self.distance[((z * ny + y) * nx + x) as usize];
                        distance = distance.min(neighbour.saturating_add(1));
                    }
                }
                self.distance[at as usize] = distance;
            }
        };
        sweep(1);
        sweep(-1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_chebyshev_distances_to_what_interpolation_reads() {
        let dims = [21, 17, 26];
        let mut voxels = vec![[0i16; 2]; dims.iter().product()];
        for [i, j, k] in [[4, 5, 6], [19, 0, 25], [7, 8, 8]] {
            voxels[(k * dims[1] + j) * dims[0] + i][0] = 3;
        }
        let o = Occupancy::new(dims, &voxels);
        assert_eq!(o.dims, [6, 5, 7]);
        // Cells that read the three voxels, by hand: [4, 5, 6] begins cell 1 along i, and so is
        // read from cell 0 too; [7, 8, 8] begins cell 2 along j and k.
        let mut sources = vec![[0, 1, 1], [1, 1, 1], [4, 0, 6]];
        for j in 1..=2 {
            for k in 1..=2 {
                sources.push([1, j, k]);
            }
        }
        for (at, &d) in o.distance[..6 * 5 * 7].iter().enumerate() {
            let c = [at % 6, at / 6 % 5, at / 30];
            let expected = sources
                .iter()
                .map(|s| (0..3).map(|a| c[a].abs_diff(s[a])).max().unwrap())
                .min()
                .unwrap();
            assert_eq!(usize::from(d), expected, "cell {c:?}");
        }
    }
}

//! Where a volume is empty, so that rays can leap.

/// The distance of each cell of 4 x 4 x 4 voxels from the nearest cell that holds something.
#[derive(Clone, Debug)]
pub(crate) struct Occupancy {
    /// Number of cells along each axis.
    pub dims: [usize; 3],
    /// Chebyshev distance in cells, i fastest: 0 where interpolation inside the cell can be other
    /// than zero.
    pub distance: Vec<u8>,
}

impl Occupancy {
    /// Edge of a cell in voxels is two to this power.
    pub const SHIFT: usize = 2;
    /// Edge of a cell in voxels.
    pub const EDGE: usize = 1 << Self::SHIFT;

    /// Of voxels stored i fastest. A cell holds the positions from its first voxel up to (and
    /// without) the first of the next, so its interpolation reads one layer of the next cells too.
    pub fn new(dims: [usize; 3], voxels: &[i16]) -> Self {
        let cells = dims.map(|n| n.div_ceil(Self::EDGE));
        let index = |c: [usize; 3]| (c[2] * cells[1] + c[1]) * cells[0] + c[0];
        let mut distance = vec![u8::MAX; cells.iter().product()];
        for k in 0..dims[2] {
            for j in 0..dims[1] {
                let row = &voxels[(k * dims[1] + j) * dims[0]..][..dims[0]];
                for (i, _) in row.iter().enumerate().filter(|&(_, &v)| v != 0) {
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
        // The Chebyshev distance is the largest over the axes, so it can be found one axis after
        // the other by two sweeps of "at most one more than the neighbour" only if diagonals count
        // as one: repeated dilation by a cube is exact and separable.
        occupancy.fill_distances();
        occupancy
    }

    fn fill_distances(&mut self) {
        let [nx, ny, nz] = self.dims;
        let mut reached: Vec<bool> = self.distance.iter().map(|&d| d == 0).collect();
        let mut next = reached.clone();
        for step in 1..u8::MAX {
            for (axis, stride) in [(0, 1), (1, nx), (2, nx * ny)] {
                for (at, flag) in next.iter_mut().enumerate() {
                    let along = match axis {
                        0 => at % nx,
                        1 => at / nx % ny,
                        _ => at / (nx * ny),
                    };
                    let last = [nx, ny, nz][axis] - 1;
                    *flag = reached[at]
                        || along > 0 && reached[at - stride]
                        || along < last && reached[at + stride];
                }
                std::mem::swap(&mut reached, &mut next);
            }
            let mut changed = false;
            for (d, &r) in self.distance.iter_mut().zip(&reached) {
                if r && *d == u8::MAX {
                    *d = step;
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_chebyshev_distances_to_what_interpolation_reads() {
        let dims = [21, 17, 26];
        let mut voxels = vec![0i16; dims.iter().product()];
        for [i, j, k] in [[4, 5, 6], [19, 0, 25], [7, 8, 8]] {
            voxels[(k * dims[1] + j) * dims[0] + i] = 3;
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
        for (at, &d) in o.distance.iter().enumerate() {
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

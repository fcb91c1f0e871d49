//! Connected components of a mask.

use super::Volume;

/// The 6-connected components of a mask: voxels that share a face belong together.
#[derive(Clone, Debug)]
pub struct Components {
    /// 0 outside the mask, else the component's number, counted from 1 in the order of the
    /// components' lowest memory offsets.
    pub labels: Volume<u32>,
    /// Number of voxels of component `n` at `n - 1`.
    pub sizes: Vec<usize>,
}

impl Components {
    /// The number of the component with most voxels, or `None` for an empty mask. Of two equal
    /// ones the one with the lowest memory offset wins.
    pub fn largest(&self) -> Option<u32> {
        let mut best: Option<usize> = None;
        for (n, &size) in self.sizes.iter().enumerate() {
            if best.is_none_or(|b| size > self.sizes[b]) {
                best = Some(n);
            }
        }
        best.map(|n| n as u32 + 1)
    }

    /// The mask of one component.
    pub fn mask(&self, number: u32) -> Volume<bool> {
        self.labels.map(|label| label == number)
    }
}

/// Finds the 6-connected components of `mask` by flood fill, in time linear in its voxels.
pub fn components(mask: &Volume<bool>) -> Components {
    let [ni, nj, nk] = mask.grid.dims;
    let mut labels = Volume::filled(mask.grid.clone(), 0_u32);
    let mut sizes = Vec::new();
    let mut stack = Vec::new();
    for seed in 0..mask.data.len() {
        if !mask.data[seed] || labels.data[seed] != 0 {
            continue;
        }
        let number = sizes.len() as u32 + 1;
        let mut size = 0;
        labels.data[seed] = number;
        stack.push(seed);
        while let Some(offset) = stack.pop() {
            size += 1;
            let [i, j, k] = mask.grid.voxel(offset);
            let mut visit = |inside: bool, neighbour: usize| {
                if inside && mask.data[neighbour] && labels.data[neighbour] == 0 {
                    labels.data[neighbour] = number;
                    stack.push(neighbour);
                }
            };
            visit(i > 0, offset.wrapping_sub(1));
            visit(i + 1 < ni, offset + 1);
            visit(j > 0, offset.wrapping_sub(ni));
            visit(j + 1 < nj, offset + ni);
            visit(k > 0, offset.wrapping_sub(ni * nj));
            visit(k + 1 < nk, offset + ni * nj);
        }
        sizes.push(size);
    }
    Components { labels, sizes }
}

/// The largest 6-connected component of `mask`, or `None` for an empty one. Of two equal ones the
/// one with the lowest memory offset wins.
pub fn largest_component(mask: &Volume<bool>) -> Option<Volume<bool>> {
    let all = components(mask);
    all.largest().map(|number| all.mask(number))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::volume::Grid;

    fn mask(dims: [usize; 3], set: &[[usize; 3]]) -> Volume<bool> {
        let grid = Grid::axis_aligned(dims, 1.0, Point::origin());
        let mut mask = Volume::filled(grid, false);
        for &[i, j, k] in set {
            let offset = mask.grid.offset(i, j, k);
            mask.data[offset] = true;
        }
        mask
    }

    #[test]
    fn faces_connect_but_edges_and_row_ends_do_not() {
        // (2,0,0) and (0,1,0) are neighbours in memory only; (0,1,0) and (1,0,0) share an edge.
        let found = components(&mask(
            [3, 3, 2],
            &[[1, 0, 0], [2, 0, 0], [0, 1, 0], [0, 1, 1], [0, 2, 1]],
        ));
        assert_eq!(found.sizes, vec![2, 3]);
        assert_eq!(found.labels.at(2, 0, 0), 1);
        assert_eq!(found.labels.at(0, 2, 1), 2);
        assert_eq!(found.largest(), Some(2));
    }

    #[test]
    fn a_tie_goes_to_the_lowest_offset() {
        let mask = mask([5, 1, 1], &[[1, 0, 0], [3, 0, 0]]);
        let largest = largest_component(&mask).unwrap();
        assert_eq!(largest.data, vec![false, true, false, false, false]);
    }

    #[test]
    fn an_empty_mask_has_none() {
        assert!(largest_component(&mask([2, 2, 2], &[])).is_none());
    }

    #[test]
    fn a_winding_body_is_one_component() {
        // A spiral that needs many steps back and forth.
        let grid = Grid::axis_aligned([9, 9, 1], 1.0, Point::origin());
        let rows = [
            "#########",
            "........#",
            "#######.#",
            "#.....#.#",
            "#.###.#.#",
            "#.#...#.#",
            "#.#####.#",
            "#.......#",
            "#########",
        ];
        let data: Vec<bool> = rows.concat().bytes().map(|b| b == b'#').collect();
        let count = data.iter().filter(|&&v| v).count();
        assert_eq!(components(&Volume::new(grid, data)).sizes, vec![count]);
    }
}

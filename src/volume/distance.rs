//! The exact Euclidean distance transform.

use super::Volume;
use rayon::prelude::*;

/// The squared distance in mm^2 from each voxel's centre to the nearest centre of a voxel of
/// `mask`; 0 inside the mask and infinity everywhere if the mask is empty.
///
/// Exact up to the rounding of `f32`, for any spacing (Felzenszwalb and Huttenlocher, "Distance
/// Transforms of Sampled Functions", Theory of Computing 8, 2012): the lower envelope of parabolas
/// along each axis in turn. Lines are independent, so the result does not depend on threads.
pub fn squared_distance(mask: &Volume<bool>) -> Volume<f32> {
    let [ni, nj, nk] = mask.grid.dims;
    let [si, sj, sk] = mask.grid.spacing;
    let mut data: Vec<f32> = mask
        .data
        .par_iter()
        .map(|&inside| if inside { 0.0 } else { f32::INFINITY })
        .collect();
    if data.is_empty() {
        return Volume::new(mask.grid.clone(), data);
    }
    data.par_chunks_mut(ni * nj).for_each(|slice| {
        let mut line = Line::new(ni.max(nj));
        for row in slice.chunks_mut(ni) {
            line.transform(row, 1, ni, si);
        }
        for i in 0..ni {
            line.transform(&mut slice[i..], ni, nj, sj);
        }
    });
    // The last axis is the slowest in memory: each j-plane is gathered so that threads own whole
    // pieces of memory.
    let mut planes = vec![0.0_f32; data.len()];
    planes
        .par_chunks_mut(ni * nk)
        .enumerate()
        .for_each(|(j, plane)| {
            let mut line = Line::new(nk);
            for (k, row) in plane.chunks_mut(ni).enumerate() {
                let from = (k * nj + j) * ni;
                row.copy_from_slice(&data[from..from + ni]);
            }
            for i in 0..ni {
                line.transform(&mut plane[i..], ni, nk, sk);
            }
        });
    data.par_chunks_mut(ni * nj)
        .enumerate()
        .for_each(|(k, slice)| {
            for (j, row) in slice.chunks_mut(ni).enumerate() {
                let from = (j * nk + k) * ni;
                row.copy_from_slice(&planes[from..from + ni]);
            }
        });
    Volume::new(mask.grid.clone(), data)
}

/// Working memory of the one-dimensional transform.
struct Line {
    /// Values of the line before the transform.
    values: Vec<f64>,
    /// Index of the parabola of each piece of the lower envelope.
    apex: Vec<usize>,
    /// Where each piece starts, in index units.
    start: Vec<f64>,
}

impl Line {
    fn new(longest: usize) -> Self {
        Self {
            values: vec![0.0; longest],
            apex: vec![0; longest],
            start: vec![0.0; longest],
        }
    }

    /// Replaces `data[q * stride]` for q below `count` by min over p of
    /// `data[p * stride] + (spacing (q - p))^2`.
    fn transform(&mut self, data: &mut [f32], stride: usize, count: usize, spacing: f64) {
        let weight = spacing * spacing;
        let mut pieces = 0;
        for q in 0..count {
            let value = f64::from(data[q * stride]);
            self.values[q] = value;
            if value == f64::INFINITY {
                continue;
            }
            let mut from = f64::NEG_INFINITY;
            while pieces > 0 {
                let p = self.apex[pieces - 1];
                // Where the parabolas about p and q meet, relative to their middle: no large
                // squares are subtracted.
                let middle = 0.5 * (p + q) as f64;
                from = middle + (value - self.values[p]) / (2.0 * weight * (q - p) as f64);
                if from > self.start[pieces - 1] {
                    break;
                }
                pieces -= 1;
                from = f64::NEG_INFINITY;
            }
            self.apex[pieces] = q;
            self.start[pieces] = from;
            pieces += 1;
        }
        if pieces == 0 {
            return;
        }
        let mut piece = 0;
        for q in 0..count {
            while piece + 1 < pieces && self.start[piece + 1] < q as f64 {
                piece += 1;
            }
            let p = self.apex[piece];
            let steps = q.abs_diff(p) as f64;
            data[q * stride] = (self.values[p] + weight * steps * steps) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::volume::Grid;
    use proptest::prelude::*;

    fn grid(dims: [usize; 3], spacing: [f64; 3]) -> Grid {
        Grid {
            spacing,
            ..Grid::axis_aligned(dims, 1.0, Point::origin())
        }
    }

    fn brute_force(mask: &Volume<bool>) -> Vec<f64> {
        let set: Vec<_> = (0..mask.data.len()).filter(|&o| mask.data[o]).collect();
        let center = |o| mask.grid.center(mask.grid.voxel(o));
        (0..mask.data.len())
            .map(|o| {
                set.iter()
                    .map(|&s| (center(o) - center(s)).norm_squared())
                    .fold(f64::INFINITY, f64::min)
            })
            .collect()
    }

    proptest! {
        #[test]
        fn equals_the_nearest_of_all_voxels(
            dims in prop::array::uniform3(1usize..8),
            spacing in prop::array::uniform3(0.3..3.0f64),
            seeds in prop::collection::vec(any::<u16>(), 0..12),
        ) {
            let grid = grid(dims, spacing);
            let mut mask = Volume::filled(grid, false);
            let n = mask.data.len();
            for s in seeds {
                mask.data[s as usize % n] = true;
            }
            let found = squared_distance(&mask);
            for (f, e) in found.data.iter().zip(brute_force(&mask)) {
                let f = f64::from(*f);
                prop_assert!(f == e || (f - e).abs() <= 1e-6 * e, "{f} instead of {e}");
            }
        }
    }

    #[test]
    fn unit_spacing_gives_exact_integers() {
        let mut mask = Volume::filled(grid([60, 50, 40], [1.0; 3]), false);
        for voxel in [[3, 4, 5], [50, 11, 30], [20, 49, 0]] {
            let [i, j, k] = voxel;
            let offset = mask.grid.offset(i, j, k);
            mask.data[offset] = true;
        }
        let found = squared_distance(&mask);
        for (f, e) in found.data.iter().zip(brute_force(&mask)) {
            assert_eq!(f64::from(*f), e);
        }
    }
}

//! Volumes on another grid: intensities and labels, each by its own rule.
//!
//! A voxel is the box around its centre, so a volume reaches half a voxel beyond its outermost
//! centres. Within that margin the outermost voxel's value holds; beyond it is outside.
//!
//! A target voxel takes its value from the trilinear interpolation of the source at its centre.
//! Where the source is finer than the target along a target axis, the interpolation is averaged
//! over equal steps of the target voxel's box instead, at least as many as source voxels are
//! crossed, so that no source voxel between two target centres is lost (no aliasing). A linear
//! ramp comes out unchanged either way.

use super::{Grid, Volume};
use crate::geometry::Vector;
use rayon::prelude::*;

/// Air (HU): what lies outside a CT.
pub const AIR_HU: i16 = -1000;

/// At most so many steps along an axis of a target voxel.
const MAX_STEPS: usize = 16;

/// Hounsfield units on another grid, rounded to whole numbers; [`AIR_HU`] outside.
pub fn resample_intensities(source: &Volume<i16>, target: &Grid) -> Volume<i16> {
    let steps = Steps::new(&source.grid, target);
    let share = 1.0 / steps.offsets.len() as f64;
    collect(
        target,
        |index| {
            let mut sum = 0.0;
            for offset in &steps.offsets {
                sum += match Corners::new(&source.grid, &(index + offset)) {
                    Some(corners) => corners
                        .iter()
                        .map(|(at, weight)| f64::from(source.data[at]) * weight)
                        .sum(),
                    None => f64::from(AIR_HU),
                };
            }
            (sum * share).round() as i16
        },
        &steps,
    )
}

/// Labels on another grid. Each label's share of the target voxel is interpolated as an intensity
/// would be, and the label with the largest share has the voxel, the lower one of equals. No label
/// comes out that was not there; 0 outside.
pub fn resample_labels(source: &Volume<u8>, target: &Grid) -> Volume<u8> {
    let steps = Steps::new(&source.grid, target);
    collect(
        target,
        |index| {
            let mut votes = Votes::default();
            for offset in &steps.offsets {
                match Corners::new(&source.grid, &(index + offset)) {
                    Some(corners) => {
                        for (at, weight) in corners.iter() {
                            votes.add(source.data[at], weight);
                        }
                    }
                    None => votes.add(0, 1.0),
                }
            }
            votes.winner()
        },
        &steps,
    )
}

/// Fills the target slice by slice; `value` gets the source's continuous index of a centre.
fn collect<T: Copy + Default + Send + Sync>(
    target: &Grid,
    value: impl Fn(Vector) -> T + Sync,
    steps: &Steps,
) -> Volume<T> {
    let [ni, nj, _] = target.dims;
    let mut data = vec![T::default(); target.len()];
    data.par_chunks_mut((ni * nj).max(1))
        .enumerate()
        .for_each(|(k, slice)| {
            for (n, out) in slice.iter_mut().enumerate() {
                *out = value(steps.index(n % ni, n / ni, k));
            }
        });
    Volume::new(target.clone(), data)
}

/// The way from target voxels to source indices, and the places within a target voxel that are
/// sampled.
struct Steps {
    start: Vector,
    /// Source index per target voxel along i, j, k.
    per_voxel: [Vector; 3],
    /// Source indices of the samples, from the voxel's centre.
    offsets: Vec<Vector>,
}

impl Steps {
    fn new(source: &Grid, target: &Grid) -> Self {
        let start = source.index(&target.origin);
        let per_voxel: [Vector; 3] = std::array::from_fn(|axis| {
            let mut one = [0.0; 3];
            one[axis] = 1.0;
            source.index(&target.point(one[0], one[1], one[2])) - start
        });
        let counts = per_voxel.map(|step| {
            let crossed = step.amax();
            ((crossed - 1e-3).ceil().max(1.0) as usize).min(MAX_STEPS)
        });
        let part = |axis: usize, n: usize| {
            per_voxel[axis] * ((n as f64 + 0.5) / counts[axis] as f64 - 0.5)
        };
        let mut offsets = Vec::new();
        for k in 0..counts[2] {
            for j in 0..counts[1] {
                for i in 0..counts[0] {
                    offsets.push(part(0, i) + part(1, j) + part(2, k));
                }
            }
        }
        Self {
            start,
            per_voxel,
            offsets,
        }
    }

    fn index(&self, i: usize, j: usize, k: usize) -> Vector {
        self.start
            + self.per_voxel[0] * i as f64
            + self.per_voxel[1] * j as f64
            + self.per_voxel[2] * k as f64
    }
}

/// The eight voxels around a place, with their trilinear weights.
struct Corners {
    low: usize,
    /// Memory offset to the upper neighbour along each axis; 0 at the border.
    up: [usize; 3],
    fraction: [f64; 3],
}

impl Corners {
    /// `None` outside the grid's voxels.
    fn new(grid: &Grid, index: &Vector) -> Option<Self> {
        let strides = [1, grid.dims[0], grid.dims[0] * grid.dims[1]];
        let (mut low, mut up, mut fraction) = (0, [0; 3], [0.0; 3]);
        for axis in 0..3 {
            let last = grid.dims[axis] as f64 - 1.0;
            let at = index[axis];
            if !(at >= -0.5 && at <= last + 0.5) {
                return None;
            }
            let at = at.clamp(0.0, last);
            let floor = at.floor();
            low += floor as usize * strides[axis];
            if floor < last {
                up[axis] = strides[axis];
                fraction[axis] = at - floor;
            }
        }
        Some(Self { low, up, fraction })
    }

    /// (memory offset, weight) of each corner; the weights sum to 1.
    fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        (0..8).filter_map(|corner| {
            let (mut at, mut weight) = (self.low, 1.0);
            for axis in 0..3 {
                if corner >> axis & 1 == 1 {
                    at += self.up[axis];
                    weight *= self.fraction[axis];
                } else {
                    weight *= 1.0 - self.fraction[axis];
                }
            }
            (weight > 0.0).then_some((at, weight))
        })
    }
}

/// The labels met around one voxel and their shares: few, so they are searched one by one.
#[derive(Default)]
struct Votes {
    entries: [(u8, f64); 16],
    used: usize,
}

impl Votes {
    fn add(&mut self, label: u8, weight: f64) {
        match self.entries[..self.used].iter().position(|e| e.0 == label) {
            Some(at) => self.entries[at].1 += weight,
            // More labels than entries meet in no anatomy; the last ones then have no vote.
            None if self.used < self.entries.len() => {
                self.entries[self.used] = (label, weight);
                self.used += 1;
            }
            None => {}
        }
    }

    fn winner(&self) -> u8 {
        let mut best = (0, 0.0);
        for &(label, weight) in &self.entries[..self.used] {
            // Shares that differ by rounding only are equal.
            let close = (weight - best.1).abs() <= 1e-9 * weight.max(best.1);
            if best.1 == 0.0 || (weight > best.1 && !close) || (close && label < best.0) {
                best = (label, weight);
            }
        }
        best.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    fn oblique(dims: [usize; 3], spacing: [f64; 3]) -> Grid {
        let mut direction = *nalgebra::Rotation3::from_euler_angles(0.3, -0.4, 0.6).matrix();
        direction.column_mut(1).neg_mut();
        Grid {
            dims,
            spacing,
            origin: Point::new(-31.5, 12.25, 700.0),
            direction,
        }
    }

    /// A plane wave without curvature: HU rise linearly along a world direction.
    fn ramp(p: &Point) -> f64 {
        40.0 * p.x - 25.0 * p.y + 15.0 * (p.z - 700.0) - 200.0
    }

    fn ramped(grid: Grid) -> Volume<i16> {
        let data = (0..grid.len())
            .map(|o| ramp(&grid.center(grid.voxel(o))).round() as i16)
            .collect();
        Volume::new(grid, data)
    }

    /// Half a voxel of shift would show as tens of HU. Coarser, finer and mixed sources.
    #[test]
    fn a_linear_ramp_keeps_its_place() {
        for spacing in [[2.0, 2.5, 3.0], [0.4, 0.3, 0.45], [0.6, 0.7, 3.0]] {
            let dims = spacing.map(|s: f64| (24.0 / s) as usize);
            let source = ramped(oblique(dims, spacing));
            let middle = source.grid.center(dims.map(|n| n / 2));
            let origin = middle - Vector::new(4.0, 4.0, 4.0);
            let target = Grid::axis_aligned([9, 8, 7], 1.0, origin);
            let out = resample_intensities(&source, &target);
            let mut checked = 0;
            for (offset, &hu) in out.data.iter().enumerate() {
                let p = target.center(target.voxel(offset));
                // Where the clamped margin takes no part.
                let index = source.grid.index(&p);
                let inner = (0..3).all(|a| {
                    let reach = 1.5 / spacing[a] + 1.0;
                    index[a] > reach && index[a] < dims[a] as f64 - 1.0 - reach
                });
                if inner {
                    checked += 1;
                    let off = f64::from(hu) - ramp(&p);
                    assert!(off.abs() <= 1.0, "{spacing:?}: {off} HU off at {p}");
                }
            }
            assert!(checked > 50, "{spacing:?}: {checked}");
        }
    }

    #[test]
    fn the_same_grid_gives_the_same_values_and_outside_is_air() {
        let source = ramped(oblique([6, 5, 4], [0.7, 0.8, 2.0]));
        assert_eq!(resample_intensities(&source, &source.grid), source);
        let far = Grid::axis_aligned([2, 2, 2], 1.0, Point::new(900.0, 0.0, 0.0));
        assert_eq!(resample_intensities(&source, &far).data, [AIR_HU; 8]);
        // The outermost voxels reach half a voxel beyond their centres, and no farther.
        let line = Volume::new(
            Grid::axis_aligned([2, 2, 2], 2.0, Point::origin()),
            vec![7i16; 8],
        );
        let beside = |x: f64| {
            let one = Grid::axis_aligned([1, 1, 1], 1.0, Point::new(x, 0.0, 0.0));
            resample_intensities(&line, &one).data[0]
        };
        assert_eq!(
            [beside(-0.9), beside(-1.1), beside(2.9), beside(3.1)],
            [7, AIR_HU, 7, AIR_HU]
        );
    }

    #[test]
    fn a_finer_source_is_averaged() {
        // A comb of 0.25 mm that point samples would see as all teeth.
        let fine = Grid::axis_aligned([40, 8, 8], 0.25, Point::origin());
        let data = (0..fine.len()).map(|o| if fine.voxel(o)[0] % 4 == 2 { 400 } else { 0 });
        let comb = Volume::new(fine.clone(), data.collect());
        let target = Grid::axis_aligned([8, 1, 1], 1.0, Point::new(0.5, 0.5, 0.5));
        let out = resample_intensities(&comb, &target);
        for &hu in &out.data[1..7] {
            assert!((90..=110).contains(&hu), "{:?}", out.data);
        }
    }

    #[test]
    fn labels_meet_halfway_and_none_is_invented() {
        // 1 below, 7 above: an average of values would pass through 2 to 6.
        let coarse = Grid {
            spacing: [1.0, 1.0, 3.0],
            ..Grid::axis_aligned([3, 3, 4], 1.0, Point::origin())
        };
        let data = (0..coarse.len()).map(|o| if coarse.voxel(o)[2] < 2 { 1 } else { 7 });
        let labels = Volume::new(coarse.clone(), data.collect());
        let target = Grid::axis_aligned([1, 1, 9], 1.0, Point::new(1.0, 1.0, 0.5));
        // The border lies at z = 4.5, midway between the centres at 3 and 6: exactly there the
        // lower label wins.
        assert_eq!(
            resample_labels(&labels, &target).data,
            [1, 1, 1, 1, 1, 7, 7, 7, 7]
        );
        assert_eq!(resample_labels(&labels, &coarse), labels);
    }

    /// Three labels at a corner: the largest share wins although it is below one half.
    #[test]
    fn the_largest_share_wins() {
        let grid = Grid::axis_aligned([2, 2, 2], 1.0, Point::origin());
        let labels = Volume::new(grid, vec![3, 2, 2, 0, 3, 2, 5, 0]);
        let at = |x: f64, y: f64, z: f64| {
            let one = Grid::axis_aligned([1, 1, 1], 1.0, Point::new(x, y, z));
            resample_labels(&labels, &one).data[0]
        };
        assert_eq!(at(0.5, 0.5, 0.5), 2);
        assert_eq!(at(0.05, 0.05, 0.5), 3);
        assert_eq!(at(0.9, 0.9, 0.5), 0);
    }

    #[test]
    fn a_ball_keeps_its_place_from_thick_slices() {
        let grid = Grid {
            spacing: [0.8, 0.8, 3.0],
            ..oblique([70, 70, 20], [1.0; 3])
        };
        let center = grid.point(34.3, 35.1, 9.4);
        let data = (0..grid.len())
            .map(|o| u8::from((grid.center(grid.voxel(o)) - center).norm() < 20.0) * 4);
        let ball = Volume::new(grid.clone(), data.collect());
        let target = Grid::axis_aligned([60, 60, 60], 1.0, center - Vector::new(29.7, 30.2, 30.4));
        let out = resample_labels(&ball, &target);
        let (mut sum, mut count) = (Vector::zeros(), 0.0);
        for (o, &v) in out.data.iter().enumerate() {
            if v == 4 {
                sum += target.center(target.voxel(o)) - center;
                count += 1.0;
            }
        }
        // The coarse ball's own centroid.
        let (mut own, mut n) = (Vector::zeros(), 0.0);
        for (o, &v) in ball.data.iter().enumerate() {
            if v == 4 {
                own += grid.center(grid.voxel(o)) - center;
                n += 1.0;
            }
        }
        assert!((sum / count - own / n).norm() < 0.05);
        let volume = 4.0 / 3.0 * std::f64::consts::PI * 8000.0;
        assert!((count / volume - 1.0).abs() < 0.02, "{count} of {volume}");
    }
}

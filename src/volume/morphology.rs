//! Erosion, dilation, opening and closing with a ball, by distance transforms.
//!
//! A mask is taken as a set in an endless grid that is empty outside the volume. The ball of
//! radius r holds the voxels whose centres lie at most r mm away. Only the box around the mask's
//! voxels is worked on.

use super::distance::squared_distance;
use super::{Grid, Volume};
use crate::geometry::Vector;

/// Voxels whose centres lie within `radius_mm` of the mask.
pub fn dilate(mask: &Volume<bool>, radius_mm: f64) -> Volume<bool> {
    in_padded_box(mask, radius_mm, |body| grow(body, radius_mm))
}

/// Voxels of the mask that are farther than `radius_mm` from every voxel outside it.
pub fn erode(mask: &Volume<bool>, radius_mm: f64) -> Volume<bool> {
    in_padded_box(mask, radius_mm, |body| shrink(body, radius_mm))
}

/// Erosion, then dilation: the union of all balls that fit into the mask.
pub fn open(mask: &Volume<bool>, radius_mm: f64) -> Volume<bool> {
    in_padded_box(mask, radius_mm, |body| {
        grow(&shrink(body, radius_mm), radius_mm)
    })
}

/// Dilation, then erosion: fills what no ball outside the mask can reach.
pub fn close(mask: &Volume<bool>, radius_mm: f64) -> Volume<bool> {
    in_padded_box(mask, radius_mm, |body| {
        shrink(&grow(body, radius_mm), radius_mm)
    })
}

/// Squared radii are compared in `f32`, with room for their rounding: a voxel at exactly the
/// radius belongs to the ball.
fn squared(radius_mm: f64) -> f32 {
    (radius_mm * radius_mm * (1.0 + 1e-6)) as f32
}

fn grow(mask: &Volume<bool>, radius_mm: f64) -> Volume<bool> {
    let limit = squared(radius_mm);
    squared_distance(mask).map(|d| d <= limit)
}

fn shrink(mask: &Volume<bool>, radius_mm: f64) -> Volume<bool> {
    let limit = squared(radius_mm);
    squared_distance(&mask.map(|inside| !inside)).map(|d| d > limit)
}

/// Applies `work` to the mask's bounding box with a border that a ball does not cross, and puts the
/// result back on the mask's own grid.
fn in_padded_box(
    mask: &Volume<bool>,
    radius_mm: f64,
    work: impl FnOnce(&Volume<bool>) -> Volume<bool>,
) -> Volume<bool> {
    let mut result = Volume::filled(mask.grid.clone(), false);
    let Some((min, max)) = mask.bounds(|inside| inside) else {
        return result;
    };
    let spacing = mask.grid.spacing;
    let border: [usize; 3] =
        std::array::from_fn(|a| (radius_mm / spacing[a] * (1.0 + 1e-6)).floor() as usize + 1);
    let dims: [usize; 3] = std::array::from_fn(|a| max[a] - min[a] + 1 + 2 * border[a]);
    let start = mask.grid.center(min)
        - mask.grid.direction * Vector::from_fn(|a, _| border[a] as f64 * spacing[a]);
    let mut body = Volume::filled(
        Grid {
            dims,
            origin: start,
            ..mask.grid.clone()
        },
        false,
    );
    let inner = body.grid.clone();
    for k in min[2]..=max[2] {
        for j in min[1]..=max[1] {
            let from = mask.grid.offset(min[0], j, k);
            let to = inner.offset(border[0], j - min[1] + border[1], k - min[2] + border[2]);
            let n = max[0] - min[0] + 1;
            body.data[to..to + n].copy_from_slice(&mask.data[from..from + n]);
        }
    }
    let worked = work(&body);
    for (offset, &inside) in worked.data.iter().enumerate() {
        if !inside {
            continue;
        }
        let voxel = inner.voxel(offset);
        let on_mask: [Option<usize>; 3] = std::array::from_fn(|a| {
            (voxel[a] + min[a])
                .checked_sub(border[a])
                .filter(|&v| v < mask.grid.dims[a])
        });
        if let [Some(i), Some(j), Some(k)] = on_mask {
            let offset = result.grid.offset(i, j, k);
            result.data[offset] = true;
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    type Set = BTreeSet<[i64; 3]>;

    /// Offsets of a ball's voxels, by definition.
    fn ball(radius: f64, spacing: [f64; 3]) -> Vec<[i64; 3]> {
        let mut offsets = Vec::new();
        for k in -9i64..=9 {
            for j in -9i64..=9 {
                for i in -9i64..=9 {
                    let r2: f64 = [i, j, k]
                        .iter()
                        .zip(spacing)
                        .map(|(&n, s)| (n as f64 * s).powi(2))
                        .sum();
                    if r2 <= radius * radius * (1.0 + 1e-9) {
                        offsets.push([i, j, k]);
                    }
                }
            }
        }
        offsets
    }

    fn shifted(v: &[i64; 3], d: &[i64; 3]) -> [i64; 3] {
        [v[0] + d[0], v[1] + d[1], v[2] + d[2]]
    }

    fn dilated(set: &Set, ball: &[[i64; 3]]) -> Set {
        set.iter()
            .flat_map(|v| ball.iter().map(|d| shifted(v, d)))
            .collect()
    }

    fn eroded(set: &Set, ball: &[[i64; 3]]) -> Set {
        set.iter()
            .filter(|v| ball.iter().all(|d| set.contains(&shifted(v, d))))
            .copied()
            .collect()
    }

    fn as_set(mask: &Volume<bool>) -> Set {
        (0..mask.data.len())
            .filter(|&o| mask.data[o])
            .map(|o| mask.grid.voxel(o).map(|v| v as i64))
            .collect()
    }

    fn inside(set: Set, dims: [usize; 3]) -> Set {
        set.into_iter()
            .filter(|v| (0..3).all(|a| v[a] >= 0 && v[a] < dims[a] as i64))
            .collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn all_four_follow_their_definitions(
            dims in prop::array::uniform3(1usize..8),
            wide in any::<bool>(),
            radius in 0.0..2.6f64,
            holes in prop::collection::vec(any::<u16>(), 0..30),
            sparse in any::<bool>(),
        ) {
            let spacing = if wide { [0.7, 1.0, 1.9] } else { [1.0; 3] };
            let grid = Grid { spacing, ..Grid::axis_aligned(dims, 1.0, Point::origin()) };
            let mut mask = Volume::filled(grid, !sparse);
            let n = mask.data.len();
            for h in holes {
                mask.data[h as usize % n] = sparse;
            }
            let ball = ball(radius, spacing);
            let set = as_set(&mask);
            prop_assert_eq!(as_set(&dilate(&mask, radius)), inside(dilated(&set, &ball), dims));
            prop_assert_eq!(as_set(&erode(&mask, radius)), eroded(&set, &ball));
            prop_assert_eq!(as_set(&open(&mask, radius)), dilated(&eroded(&set, &ball), &ball));
            prop_assert_eq!(
                as_set(&close(&mask, radius)),
                inside(eroded(&dilated(&set, &ball), &ball), dims)
            );
        }
    }

    #[test]
    fn opening_removes_a_thin_plate_and_keeps_a_ball() {
        let grid = Grid::axis_aligned([31, 31, 31], 1.0, Point::origin());
        let mut mask = Volume::filled(grid, false);
        let mut kept = mask.clone();
        for offset in 0..mask.data.len() {
            let [i, j, k] = mask.grid.voxel(offset).map(|v| v as f64 - 15.0);
            let in_ball = i * i + j * j + k * k <= 25.0;
            mask.data[offset] = in_ball || j.abs() <= 1.0;
            kept.data[offset] = in_ball;
        }
        assert_eq!(open(&mask, 5.0), kept);
    }
}

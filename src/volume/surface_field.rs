//! From a mask to the smooth field whose middle level is the mask's surface.

use super::{Grid, SurfaceParameters, Volume};

/// The share of each cell that lies inside the mask, coarsened and smoothed, on a grid around the
/// mask wide enough to be zero at its border. `None` without a voxel inside.
pub(super) fn mask_field<T: Copy>(
    volume: &Volume<T>,
    inside: impl Fn(T) -> bool,
    parameters: &SurfaceParameters,
) -> Option<Volume<f32>> {
    let (min, max) = volume.bounds(&inside)?;
    let block = parameters.coarsening.max(1);
    let kernel = half_kernel(parameters.smoothing_voxels);
    let pad = kernel.len();
    let grid = &volume.grid;
    // New cell c covers the voxels min + (c - pad) * block + (0..block); its centre is theirs.
    let dims: [usize; 3] = std::array::from_fn(|a| (max[a] - min[a]) / block + 1 + 2 * pad);
    let first = |a: usize| min[a] as f64 - (pad * block) as f64 + (block as f64 - 1.0) / 2.0;
    let mut field = Volume::filled(
        Grid {
            dims,
            spacing: grid.spacing.map(|s| s * block as f64),
            origin: grid.point(first(0), first(1), first(2)),
            direction: grid.direction,
        },
        0.0f32,
    );
    let share = 1.0 / (block * block * block) as f32;
    for k in min[2]..=max[2] {
        for j in min[1]..=max[1] {
            for i in min[0]..=max[0] {
                if inside(volume.at(i, j, k)) {
                    let cell = |v: usize, a: usize| (v - min[a]) / block + pad;
                    let offset = field.grid.offset(cell(i, 0), cell(j, 1), cell(k, 2));
                    field.data[offset] += share;
                }
            }
        }
    }
    for axis in 0..3 {
        smooth(&mut field, axis, &kernel);
    }
    Some(field)
}

/// Weights of a Gaussian at 0, 1, 2, ... voxels, up to three standard deviations, summing to one
/// over both sides.
fn half_kernel(sigma: f64) -> Vec<f32> {
    let radius = (3.0 * sigma).ceil() as usize;
    let weight = |r: usize| {
        if r == 0 {
            1.0
        } else {
            (-0.5 * (r as f64 / sigma).powi(2)).exp()
        }
    };
    let total = 1.0 + 2.0 * (1..=radius).map(weight).sum::<f64>();
    (0..=radius).map(|r| (weight(r) / total) as f32).collect()
}

/// Convolves along one axis; zero outside. The two sides are added before they are weighted, so a
/// mirrored mask gives the mirrored field to the last bit.
fn smooth(field: &mut Volume<f32>, axis: usize, kernel: &[f32]) {
    let dims = field.grid.dims;
    let source = field.data.clone();
    let stride = [1, dims[0], dims[0] * dims[1]][axis];
    // A block is a run of memory that moves along the axis as a whole: one voxel, row or slice.
    for (line, values) in field.data.chunks_mut(stride * dims[axis]).enumerate() {
        let line = &source[line * stride * dims[axis]..][..stride * dims[axis]];
        for (value, center) in values.iter_mut().zip(line) {
            *value = center * kernel[0];
        }
        for (r, &weight) in kernel.iter().enumerate().skip(1) {
            let shift = (r * stride).min(line.len());
            let inner = line.len().saturating_sub(2 * shift);
            // Near an end only one neighbour exists.
            for at in 0..shift.min(line.len()) {
                let other = at + shift;
                values[at] += if other < line.len() { line[other] } else { 0.0 } * weight;
            }
            for at in shift..shift + inner {
                values[at] += (line[at - shift] + line[at + shift]) * weight;
            }
            for at in (shift + inner).max(shift)..line.len() {
                values[at] += line[at - shift] * weight;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    /// Against the defining sum in all three dimensions.
    #[test]
    fn smoothing_is_a_convolution_with_a_gaussian() {
        let grid = Grid::axis_aligned([3, 4, 5], 1.0, Point::origin());
        let mask = Volume::new(grid.clone(), (0..60).map(|o| o * 7 % 5 < 2).collect());
        let parameters = SurfaceParameters {
            smoothing_voxels: 0.8,
            ..Default::default()
        };
        let field = mask_field(&mask, |v| v, &parameters).unwrap();
        let weight = |d: i64| (-0.5 * (d as f64 / 0.8).powi(2)).exp();
        let total: f64 = (-3..=3).map(weight).sum();
        for (offset, &value) in field.data.iter().enumerate() {
            let at = field.grid.center(field.grid.voxel(offset));
            let mut expected = 0.0;
            for (o, &inside) in mask.data.iter().enumerate() {
                let d = grid.center(grid.voxel(o)) - at;
                if inside && d.iter().all(|c| c.abs() < 3.5) {
                    let product: f64 = d.iter().map(|c| weight(c.round() as i64)).product();
                    expected += product / total.powi(3);
                }
            }
            assert!(
                (f64::from(value) - expected).abs() < 1e-6,
                "{value} {expected} at {at}"
            );
        }
    }
}

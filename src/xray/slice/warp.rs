//! From the lattice to the detector.

use super::Lattice;
use super::four::Four;
use super::sums::{BlockSums, MARGIN, Sums};
use super::tables::{BLOCK, COLUMN_BITS};
use crate::image::PixelRect;
use crate::simd::for_simd_level;
use crate::xray::rays::IndexRays;

/// Pixels of a row that are done together.
const PIXELS: usize = 16;

/// Where the pixels of a row are read.
#[derive(Default)]
#[repr(align(64))]
struct Places {
    /// Of the first of the sixteen sums that are read.
    at: [u32; PIXELS],
    /// Weights of the four points along x and along y.
    weights: [[[f32; PIXELS]; 4]; 2],
    /// Line integral per sum.
    scale: [f32; PIXELS],
}

for_simd_level! {
    /// Adds the line integrals of the pixels `rect` to a row-major image of `width` columns: the sums
    /// at their places on the lattice by cubic convolution (Keys 1981, doi
    /// 10.1109/TASSP.1981.1163711, with a = -1/2), times the length of the ray between slices. `unit`
    /// is the attenuation per mm of one unit of the voxels.
    pub(crate) fn add_pixels(
        sums: &Sums,
        lattice: &Lattice,
        rays: &IndexRays,
        unit: f32,
        rect: PixelRect,
        width: usize,
        out: &mut [f32],
    ) = add_pixels_loops;
}

#[inline(always)]
fn add_pixels_loops(
    sums: &Sums,
    lattice: &Lattice,
    rays: &IndexRays,
    unit: f32,
    rect: PixelRect,
    width: usize,
    out: &mut [f32],
) {
    let sums_of = flat(&sums.blocks);
    let stride = sums.stride * BLOCK as usize;
    let frame = &lattice.warp;
    let unit = unit / (1u32 << COLUMN_BITS) as f32 * frame.length as f32;
    let (perspective, center) = rays.perspective();
    // From the principal point to the pixel of the lattice's point (0, 0).
    let beside = (frame.pixel[0] - center[0]) as f32;
    let first_column = lattice.blocks.0 * BLOCK - BLOCK;
    let first_row = lattice.rows.0 - MARGIN as i32;
    // Points whose window of four lies in the sums with their border; beyond them all is zero.
    let columns = [
        (first_column + 1) as f32,
        ((lattice.blocks.1 + 1) * BLOCK - 3) as f32,
    ];
    let rows = [
        (first_row + 1) as f32,
        (lattice.rows.1 + MARGIN as i32 - 3) as f32,
    ];
    let mut places = Places::default();
    for v in rect.y0..rect.y1 {
        let dv = v as f64 - frame.pixel[1];
        let depth = (frame.depth[0] + frame.depth[2] * dv) as f32;
        let x = (frame.x[1] * dv) as f32;
        let y = (frame.y[1] * dv) as f32;
        let adds = [frame.depth[1], frame.x[0], frame.y[0]].map(|add| add as f32);
        let across = ((v as f64 - center[1]) * perspective) as f32;
        let across = 1.0 + across * across;
        for u in (rect.x0..rect.x1).step_by(PIXELS) {
            let du = (u as f64 - frame.pixel[0]) as f32;
            // A pixel beyond the rectangle, to fill up sixteen, has a place like any other.
            for i in 0..PIXELS {
                let d = du + i as f32;
                let per_depth = 1.0 / (depth + adds[0] * d);
                // A pixel that should have no place would get that of a corner, which is zero.
                let x = ((x + adds[1] * d) * per_depth)
                    .max(columns[0])
                    .min(columns[1]);
                let y = ((y + adds[2] * d) * per_depth).max(rows[0]).min(rows[1]);
                let (left, upper) = (x.floor(), y.floor());
                // SAFETY: both are whole numbers between bounds that came from 32 bits.
                let (column, row) = unsafe {
                    (
                        left.to_int_unchecked::<i32>(),
                        upper.to_int_unchecked::<i32>(),
                    )
                };
                let row = row.wrapping_sub(first_row + 1);
                let column = column.wrapping_sub(first_column + 1);
                places.at[i] = row.wrapping_mul(stride as i32).wrapping_add(column) as u32;
                let weights = [cubic_weights(x - left), cubic_weights(y - upper)];
                for (all, weights) in places.weights.iter_mut().zip(weights) {
                    for (all, weight) in all.iter_mut().zip(weights) {
                        all[i] = weight;
                    }
                }
                let along = (d + beside) * perspective as f32;
                places.scale[i] = unit * (across + along * along).sqrt() * per_depth;
            }
            let mut lines = [0.0; PIXELS];
            let pixels = PIXELS.min(rect.x1 - u);
            for first in (0..pixels).step_by(4) {
                four_pixels(sums_of, stride, &places, first, &mut lines);
            }
            let out = &mut out[v * width + u..][..pixels];
            for (out, line) in out.iter_mut().zip(lines) {
                *out += line;
            }
        }
    }
}

/// Line integrals of the pixels from `first` on.
#[inline(always)]
fn four_pixels(
    sums: &[f32],
    stride: usize,
    places: &Places,
    first: usize,
    lines: &mut [f32; PIXELS],
) {
    let four = |from: &[f32]| Four::load(from.first_chunk().expect("four of sixteen"));
    let [along_x, along_y] = &places.weights;
    let mut columns = [Four::all(0.0); 4];
    for (i, columns) in columns.iter_mut().enumerate() {
        // One check for all four rows.
        let window = &sums[places.at[first + i] as usize..][..3 * stride + 4];
        let row = |n: usize| {
            let weight = Four::all(along_y[n][first + i]);
            four(&window[n * stride..]).times(weight)
        };
        *columns = row(0).plus(row(2)).plus(row(1).plus(row(3)));
    }
    let columns = Four::transposed(columns);
    let column = |n: usize| columns[n].times(four(&along_x[n][first..]));
    let sum = column(0).plus(column(2)).plus(column(1).plus(column(3)));
    let line = sum.times(four(&places.scale[first..]));
    line.store(lines[first..].first_chunk_mut().expect("four of sixteen"));
}

/// The weights of four neighbours for a place this far from the second to the third.
#[inline(always)]
fn cubic_weights(t: f32) -> [f32; 4] {
    const CUBIC: [f32; 4] = [-0.5, 1.5, -1.5, 0.5];
    const SQUARE: [f32; 4] = [1.0, -2.5, 2.0, -0.5];
    const LINEAR: [f32; 4] = [-0.5, 0.0, 0.5, 0.0];
    const CONSTANT: [f32; 4] = [0.0, 1.0, 0.0, 0.0];
    let mut weights = [0.0; 4];
    for i in 0..4 {
        weights[i] = ((CUBIC[i] * t + SQUARE[i]) * t + LINEAR[i]) * t + CONSTANT[i];
    }
    weights
}

/// The sums of blocks as one slice.
#[inline(always)]
fn flat(blocks: &[BlockSums]) -> &[f32] {
    // SAFETY: a block is sixteen f32 without padding (64 bytes, aligned to 64), so the sums of
    // neighbouring blocks follow each other.
    unsafe { std::slice::from_raw_parts(blocks.as_ptr().cast(), BLOCK as usize * blocks.len()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubic_weights_reproduce_points_and_straight_lines() {
        assert_eq!(cubic_weights(0.0), [0.0, 1.0, 0.0, 0.0]);
        for n in 0..=10 {
            let t = n as f32 / 10.0;
            let w = cubic_weights(t);
            let (sum, line) = (w.iter().sum::<f32>(), w[2] - w[0] + 2.0 * w[3]);
            assert!((sum - 1.0).abs() < 1e-6 && (line - t).abs() < 1e-6, "{w:?}");
        }
    }
}

//! Sums over all square patches of an image, at a cost that hardly grows with the patch.

use crate::image::PixelRect;

/// Number of quantities summed: the moving values, their squares, and their products with the
/// fixed values.
const QUANTITIES: usize = 3;

/// Sums of m, m^2 and m f over the square patches around given pixels, in f64.
///
/// Columns are summed by blocks of one patch height that start at multiples of it (a patch is the
/// end of one block and the beginning of the next), rows by doubling. So nothing is ever
/// subtracted: sums over zeros are exactly zero, sums of squares keep their relative accuracy, and
/// a patch's sums depend on its pixels alone, not on which other patches are asked for.
#[derive(Clone, Debug)]
pub(super) struct PatchSums {
    width: usize,
    height: usize,
    radius: usize,
    /// For each row of the current block, sums from that row to the block's end.
    to_block_end: [Vec<f64>; QUANTITIES],
    /// Sums from the next block's beginning to the patch's last row.
    from_block_start: [Vec<f64>; QUANTITIES],
    /// Sums over 1, 2, 4, ... pixels of a row of column sums.
    doubled: Vec<Vec<f64>>,
    /// Sums over the patches of one row of centres.
    sums: [Vec<f64>; QUANTITIES],
}

impl PatchSums {
    /// For images of `width` x `height` pixels and patches of 2 `radius` + 1 pixels a side.
    ///
    /// # Panics
    /// When a patch does not fit into the image.
    pub fn new(width: usize, height: usize, radius: usize) -> Self {
        let diameter = 2 * radius + 1;
        assert!(diameter <= width && diameter <= height);
        let row = || vec![0.0; width];
        Self {
            width,
            height,
            radius,
            to_block_end: std::array::from_fn(|_| vec![0.0; width * diameter]),
            from_block_start: std::array::from_fn(|_| row()),
            doubled: (0..=diameter.ilog2()).map(|_| row()).collect(),
            sums: std::array::from_fn(|_| row()),
        }
    }

    /// Number of pixels of a patch.
    pub fn patch_pixels(&self) -> f64 {
        ((2 * self.radius + 1) * (2 * self.radius + 1)) as f64
    }

    /// The pixels that are centres of patches.
    pub fn all_centers(&self) -> PixelRect {
        PixelRect {
            x0: self.radius,
            y0: self.radius,
            x1: self.width - self.radius,
            y1: self.height - self.radius,
        }
    }

    /// Hands `sink` each row of centres with the three sums over its patches. `centers` must lie
    /// in [`Self::all_centers`]; the images are row-major.
    #[inline(always)]
    pub fn for_each_row(
        &mut self,
        moving: &[f32],
        fixed: &[f32],
        centers: PixelRect,
        mut sink: impl FnMut(usize, [&[f64]; QUANTITIES]),
    ) {
        if centers.is_empty() {
            return;
        }
        let diameter = 2 * self.radius + 1;
        let x0 = centers.x0 - self.radius;
        let columns = centers.width() + 2 * self.radius;
        let row = |y: usize| {
            let start = y * self.width + x0;
            (
                &moving[start..start + columns],
                &fixed[start..start + columns],
            )
        };
        for y in centers.y0..centers.y1 {
            let top = y - self.radius;
            let bottom = top + diameter - 1;
            let in_block = top % diameter;
            let block_end = top - in_block + diameter;
            if y == centers.y0 || in_block == 0 {
                // A row's sums go to its place in the block: rows above `top` are not needed.
                for below in (top..block_end).rev() {
                    let place = (below % diameter) * columns;
                    let (m, f) = row(below);
                    for (q, sums) in self.to_block_end.iter_mut().enumerate() {
                        if below + 1 == block_end {
                            let out = &mut sums[place..place + columns];
                            fill(out, |i| quantity(q, m[i], f[i]));
                        } else {
                            let (out, rest) = sums[place..].split_at_mut(columns);
                            let rest = &rest[..columns];
                            fill(out, |i| quantity(q, m[i], f[i]) + rest[i]);
                        }
                    }
                }
                for sums in &mut self.from_block_start {
                    sums[..columns].fill(0.0);
                }
                for above in block_end..bottom {
                    let (m, f) = row(above);
                    for (q, sums) in self.from_block_start.iter_mut().enumerate() {
                        add(&mut sums[..columns], |i| quantity(q, m[i], f[i]));
                    }
                }
            }
            let (m, f) = row(bottom);
            for q in 0..QUANTITIES {
                let start = &mut self.from_block_start[q][..columns];
                let end = &self.to_block_end[q][in_block * columns..][..columns];
                if in_block != 0 {
                    add(start, |i| quantity(q, m[i], f[i]));
                }
                fill(&mut self.doubled[0][..columns], |i| end[i] + start[i]);
                sum_runs(&mut self.doubled, columns, diameter, &mut self.sums[q]);
            }
            let count = centers.width();
            sink(y, std::array::from_fn(|q| &self.sums[q][..count]));
        }
    }
}

#[inline(always)]
fn quantity(index: usize, moving: f32, fixed: f32) -> f64 {
    let (m, f) = (f64::from(moving), f64::from(fixed));
    match index {
        0 => m,
        1 => m * m,
        _ => m * f,
    }
}

#[inline(always)]
fn fill(out: &mut [f64], value: impl Fn(usize) -> f64) {
    for (i, o) in out.iter_mut().enumerate() {
        *o = value(i);
    }
}

#[inline(always)]
fn add(out: &mut [f64], value: impl Fn(usize) -> f64) {
    for (i, o) in out.iter_mut().enumerate() {
        *o += value(i);
    }
}

/// Sums of `diameter` neighbours of `doubled[0][..columns]`, by the binary digits of `diameter`.
#[inline(always)]
fn sum_runs(doubled: &mut [Vec<f64>], columns: usize, diameter: usize, sums: &mut [f64]) {
    for level in 1..doubled.len() {
        let half = 1 << (level - 1);
        let count = columns + 1 - 2 * half;
        let (shorter, longer) = doubled.split_at_mut(level);
        let left = &shorter[level - 1][..count];
        let right = &shorter[level - 1][half..half + count];
        fill(&mut longer[0][..count], |i| left[i] + right[i]);
    }
    let count = columns + 1 - diameter;
    let top = doubled.len() - 1;
    sums[..count].copy_from_slice(&doubled[top][..count]);
    let mut offset = 1 << top;
    for level in (0..top).rev() {
        if diameter >> level & 1 == 1 {
            let values = &doubled[level][offset..offset + count];
            add(&mut sums[..count], |i| values[i]);
            offset += 1 << level;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_of_small_integers_are_exact_and_do_not_depend_on_the_part() {
        let (width, height) = (29, 26);
        let value = |i: usize, k: u32| ((i as u32).wrapping_mul(k) >> 9) % 201;
        let image = |k| -> Vec<f32> {
            (0..width * height)
                .map(|i| value(i, k) as f32 - 100.0)
                .collect()
        };
        let (m, f) = (image(2_654_435_761), image(2_246_822_519));
        for radius in [0, 1, 2, 5, 10, 12] {
            let mut sums = PatchSums::new(width, height, radius);
            let all = sums.all_centers();
            let part = PixelRect {
                x0: all.x0 + 1,
                y0: all.y0 + 1,
                x1: all.x1,
                y1: all.y1 - usize::from(all.height() > 2),
            };
            for centers in [all, part] {
                let mut rows = 0;
                sums.for_each_row(&m, &f, centers, |y, got| {
                    rows += 1;
                    for x in centers.x0..centers.x1 {
                        let mut expected = [0i64; 3];
                        for v in y - radius..=y + radius {
                            for u in x - radius..=x + radius {
                                let (a, b) = (m[v * width + u] as i64, f[v * width + u] as i64);
                                expected[0] += a;
                                expected[1] += a * a;
                                expected[2] += a * b;
                            }
                        }
                        for q in 0..3 {
                            assert_eq!(got[q][x - centers.x0], expected[q] as f64);
                        }
                    }
                });
                assert_eq!(rows, centers.height());
            }
        }
    }
}

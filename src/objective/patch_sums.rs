//! Sums over all square patches of an image, at a cost that hardly grows with the patch.

use super::lanes::{Chunk, Lanes, values};
use super::run_sums::{AnyRuns, RunSums, Runs11, Runs21};
use crate::image::PixelRect;

/// Number of quantities summed: the moving values, their squares, and their products with the
/// fixed values.
const QUANTITIES: usize = 3;

/// A chunk of each quantity.
type Chunks = [Chunk; QUANTITIES];

/// Values that an image must hold beyond its last pixel, since rows are read eight at a time.
pub(super) const PADDING: usize = 7;

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
    /// Chunks of a row of column sums, enough for the longest row and the runs' delay.
    stride: usize,
    /// For each row of the current block, sums from that row to the block's end.
    to_block_end: Vec<Chunks>,
    /// Sums from the next block's beginning to the patch's last row.
    from_block_start: Vec<Chunks>,
    any_runs: AnyRuns,
    /// For each quantity, sums over the patches of one row of centres.
    sums: [Vec<Chunk>; QUANTITIES],
}

impl PatchSums {
    /// For images of `width` x `height` pixels and patches of 2 `radius` + 1 pixels a side.
    ///
    /// # Panics
    /// When a patch does not fit into the image.
    pub fn new(width: usize, height: usize, radius: usize) -> Self {
        let diameter = 2 * radius + 1;
        assert!(diameter <= width && diameter <= height);
        const LONGEST_DELAY: usize = 4;
        let stride = width.div_ceil(8) + LONGEST_DELAY;
        let no_chunks = [Chunk::default(); QUANTITIES];
        Self {
            width,
            height,
            radius,
            stride,
            to_block_end: vec![no_chunks; diameter * stride],
            from_block_start: vec![no_chunks; stride],
            any_runs: AnyRuns::new(diameter, stride),
            sums: std::array::from_fn(|_| vec![Chunk::default(); stride]),
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

    /// Sums over the patches around one row of centres. The rows of `centers`, which must lie in
    /// [`Self::all_centers`], are to be asked for one after the other from the first; the images
    /// are row-major, with [`PADDING`] finite values after the last pixel.
    #[inline(always)]
    pub fn sum_row<L: Lanes>(
        &mut self,
        moving: &[f32],
        fixed: &[f32],
        centers: PixelRect,
        y: usize,
    ) -> [&[f64]; QUANTITIES] {
        let diameter = 2 * self.radius + 1;
        let part = Part {
            moving,
            fixed,
            width: self.width,
            x0: centers.x0 - self.radius,
            columns: centers.width() + 2 * self.radius,
        };
        let top = y - self.radius;
        let bottom = top + diameter - 1;
        let in_block = top % diameter;
        if y == centers.y0 || in_block == 0 {
            self.begin_block::<L>(&part, top, bottom);
        }
        let new_row = (in_block != 0).then_some(bottom);
        let delay = match diameter {
            11 => self.stream_row::<L, Runs11<L>>(&part, in_block, new_row),
            21 => self.stream_row::<L, Runs21<L>>(&part, in_block, new_row),
            _ => self.double_row::<L>(&part, in_block, new_row),
        };
        self.sums
            .each_ref()
            .map(|sums| &values(&sums[delay..])[..centers.width()])
    }

    /// Sums the block of `top` from each of its rows, `top` and below, to its end, and the next
    /// block from its beginning to the row above `bottom`.
    #[inline(always)]
    fn begin_block<L: Lanes>(&mut self, part: &Part, top: usize, bottom: usize) {
        let diameter = 2 * self.radius + 1;
        let block_start = top - top % diameter;
        let block_end = block_start + diameter;
        for (chunk, start) in self.from_block_start[..part.chunks()]
            .iter_mut()
            .enumerate()
        {
            let mut sums = [L::zero(); QUANTITIES];
            for row in (top..block_end).rev() {
                let new = part.quantities::<L>(row, chunk);
                let end = &mut self.to_block_end[(row - block_start) * self.stride + chunk];
                for q in 0..QUANTITIES {
                    sums[q] = sums[q].plus(new[q]);
                    sums[q].store(&mut end[q]);
                }
            }
            let mut sums = [L::zero(); QUANTITIES];
            for row in block_end..bottom {
                let new = part.quantities::<L>(row, chunk);
                for q in 0..QUANTITIES {
                    sums[q] = sums[q].plus(new[q]);
                }
            }
            for q in 0..QUANTITIES {
                sums[q].store(&mut start[q]);
            }
        }
    }

    /// Sums rows of patches that begin at row `in_block` of the block: columns first (`new_row`,
    /// if given, is added to the next block's part of them), then runs of columns in registers.
    /// Gives the chunk at which the sums begin.
    #[inline(always)]
    fn stream_row<L: Lanes, R: RunSums<L>>(
        &mut self,
        part: &Part,
        in_block: usize,
        new_row: Option<usize>,
    ) -> usize {
        let chunks = part.chunks();
        let end = &self.to_block_end[in_block * self.stride..][..chunks];
        let start = &mut self.from_block_start[..chunks];
        let [a, b, c] = &mut self.sums;
        let (a, a_rest) = a.split_at_mut(chunks);
        let (b, b_rest) = b.split_at_mut(chunks);
        let (c, c_rest) = c.split_at_mut(chunks);
        let mut runs = [R::new(), R::new(), R::new()];
        for chunk in 0..chunks {
            let sums = column_sums::<L>(part, &end[chunk], &mut start[chunk], new_row, chunk);
            runs[0].push(sums[0]).store(&mut a[chunk]);
            runs[1].push(sums[1]).store(&mut b[chunk]);
            runs[2].push(sums[2]).store(&mut c[chunk]);
        }
        for ((a, b), c) in a_rest.iter_mut().zip(b_rest).zip(c_rest).take(R::DELAY) {
            runs[0].push(L::zero()).store(a);
            runs[1].push(L::zero()).store(b);
            runs[2].push(L::zero()).store(c);
        }
        R::DELAY
    }

    /// The same for runs of columns of any length. The sums begin at chunk 0.
    #[inline(always)]
    fn double_row<L: Lanes>(
        &mut self,
        part: &Part,
        in_block: usize,
        new_row: Option<usize>,
    ) -> usize {
        for chunk in 0..part.chunks() {
            let end = &self.to_block_end[in_block * self.stride + chunk];
            let start = &mut self.from_block_start[chunk];
            let sums = column_sums::<L>(part, end, start, new_row, chunk);
            for q in 0..QUANTITIES {
                sums[q].store(&mut self.sums[q][chunk]);
            }
        }
        for sums in &mut self.sums {
            self.any_runs.row_mut().copy_from_slice(sums);
            self.any_runs.sum(part.columns, sums);
        }
        0
    }
}

/// Sums of columns: the end of one block and the start of the next, to which `new_row` is first
/// added if it is given.
#[inline(always)]
fn column_sums<L: Lanes>(
    part: &Part,
    end: &Chunks,
    start: &mut Chunks,
    new_row: Option<usize>,
    chunk: usize,
) -> [L; QUANTITIES] {
    // Loops, not `array::from_fn`: its closure is not always inlined, and outside of this
    // function it is compiled without vector instructions.
    let mut sums = [L::zero(); QUANTITIES];
    for q in 0..QUANTITIES {
        sums[q] = L::load(&start[q]);
    }
    if let Some(row) = new_row {
        let new = part.quantities::<L>(row, chunk);
        for q in 0..QUANTITIES {
            sums[q] = sums[q].plus(new[q]);
            sums[q].store(&mut start[q]);
        }
    }
    for q in 0..QUANTITIES {
        sums[q] = L::load(&end[q]).plus(sums[q]);
    }
    sums
}

/// The columns of two images from which the patches of a row of centres are made.
struct Part<'a> {
    moving: &'a [f32],
    fixed: &'a [f32],
    width: usize,
    x0: usize,
    columns: usize,
}

impl Part<'_> {
    /// Chunks that hold the columns.
    #[inline(always)]
    fn chunks(&self) -> usize {
        self.columns.div_ceil(8)
    }

    /// The quantities of eight pixels of a row; beyond the part's last column they are those of
    /// any pixels.
    #[inline(always)]
    fn quantities<L: Lanes>(&self, row: usize, chunk: usize) -> [L; QUANTITIES] {
        let start = row * self.width + self.x0 + 8 * chunk;
        let (m, f) = (
            L::widen(eight(self.moving, start)),
            L::widen(eight(self.fixed, start)),
        );
        [m, m.times(m), m.times(f)]
    }
}

#[inline(always)]
fn eight(image: &[f32], start: usize) -> &[f32; 8] {
    image[start..]
        .first_chunk()
        .expect("images are padded for reading beyond the last pixel")
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{LanesWork, with_lanes};
    use super::*;
    use crate::simd::SimdLevel;

    /// Sums of every row of centres, one row after the other.
    struct AllRows<'a> {
        sums: &'a mut PatchSums,
        images: [&'a [f32]; 2],
        centers: PixelRect,
    }

    impl LanesWork for AllRows<'_> {
        type Output = Vec<[Vec<f64>; QUANTITIES]>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let [m, f] = self.images;
            (self.centers.y0..self.centers.y1)
                .map(|y| {
                    let sums = self.sums.sum_row::<L>(m, f, self.centers, y);
                    sums.map(|sums| sums.to_vec())
                })
                .collect()
        }
    }

    #[test]
    fn sums_of_small_integers_are_exact_and_do_not_depend_on_the_part() {
        let (width, height) = (29, 26);
        let value = |i: usize, k: u32| ((i as u32).wrapping_mul(k) >> 9) % 201;
        let image = |k| -> Vec<f32> {
            (0..width * height + PADDING)
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
            for (centers, level) in [all, part]
                .into_iter()
                .flat_map(|centers| SimdLevel::available().map(move |level| (centers, level)))
            {
                let rows = with_lanes(
                    level,
                    AllRows {
                        sums: &mut sums,
                        images: [&m, &f],
                        centers,
                    },
                );
                assert_eq!(rows.len(), centers.height());
                for (got, y) in rows.iter().zip(centers.y0..) {
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
                }
            }
        }
    }
}

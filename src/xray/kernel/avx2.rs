//! Tiles of 4 x 4 rays in two registers of AVX2, one sample of each ray at a time.

use super::Projection;
use super::fixed::{BITS, CHUNK, WEIGHT_BITS, WEIGHT_ONE};
use super::occupancy::Occupancy;
use super::tile::{LANES, Tiles};
use std::arch::x86_64::*;

/// Adds the line integrals of a projection's pixels to `out`: see `portable::project_add`, of
/// which this gives the same bits.
#[target_feature(enable = "avx2")]
pub(crate) fn project_add(job: &Projection, out: &mut [f32]) {
    let tiles = Tiles::new(job);
    let [nx, ny, _] = job.volume.dims;
    let kernel = Kernel {
        job,
        last: job.last.map(|p| _mm256_set1_epi32(p)),
        row_voxels: _mm256_set1_epi32(nx as i32),
        slice_voxels: _mm256_set1_epi32((nx * ny) as i32),
    };
    let near = |start, step, radius| clearances(job, start, step, radius);
    for (u, v) in tiles.first_pixels() {
        let Some(span) = tiles.span(u, v) else {
            continue;
        };
        let mut sums = [_mm256_setzero_si256(); 2];
        let step = lanes(span.rays.step(), tiles.step_offsets);
        tiles.for_each_chunk(&span, near, |chunk| {
            let start = lanes(chunk.start, chunk.offsets);
            for (first, count) in chunk.runs() {
                let begin = [0, 1].map(|half| ahead(start[half], step[half], first));
                let mut places = [[[0; 8]; 2]; CHUNK as usize];
                let mut at = begin;
                for places in &mut places[..count as usize] {
                    for half in 0..2 {
                        places[half] = kernel.voxels(at[half]);
                        at[half] = sum(at[half], step[half]);
                    }
                    kernel.ask(places);
                }
                let mut at = begin;
                for places in &places[..count as usize] {
                    for half in 0..2 {
                        let negative = kernel.negative_samples(&places[half], at[half]);
                        sums[half] = _mm256_sub_epi32(sums[half], negative);
                        at[half] = sum(at[half], step[half]);
                    }
                }
            }
        });
        let mut all = [0; LANES];
        for (lanes, half) in all.chunks_exact_mut(8).zip(sums) {
            // SAFETY: the slice has the 32 bytes that are stored.
            unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), half) };
        }
        job.add_tile_sums(u, v, &all, out);
    }
}

/// Indices of 8 positions in fixed point, along i, j and k.
type Positions = [__m256i; 3];

/// What is the same for all samples.
struct Kernel<'a> {
    job: &'a Projection<'a>,
    /// The last index along each axis.
    last: Positions,
    /// Voxels of a row and of a slice.
    row_voxels: __m256i,
    slice_voxels: __m256i,
}

impl Kernel<'_> {
    /// Asks for the voxels of a tile's corners, on both slices, ahead of time: the other rays' mostly
    /// lie between.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn ask(&self, [upper, lower]: &[[u32; 8]; 2]) {
        let pairs = self.job.volume.pairs.as_ptr();
        let slice = pairs.wrapping_add(self.job.volume.dims[0] * self.job.volume.dims[1]);
        for at in [
            upper[0], upper[3], upper[4], upper[7], lower[0], lower[3], lower[4], lower[7],
        ] {
            _mm_prefetch::<_MM_HINT_T0>(pairs.wrapping_add(at as usize).cast());
        }
        for at in [upper[0], lower[7]] {
            _mm_prefetch::<_MM_HINT_T0>(slice.wrapping_add(at as usize).cast());
        }
    }

    /// The interpolated volume at 8 positions, negative and shifted as the sums want it.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn negative_samples(&self, places: &[u32; 8], at: Positions) -> __m256i {
        let pairs = self.job.volume.pairs.as_ptr();
        let slice = self.job.volume.dims[0] * self.job.volume.dims[1];
        // SAFETY: places are those of voxels, and `pairs` has the slice and the two pairs beyond
        // its last voxel that samples there read.
        let (low, high) = unsafe { (corners(pairs, places), corners(pairs.add(slice), places)) };
        const CUT: i32 = (BITS - WEIGHT_BITS) as i32;
        const PART: i32 = WEIGHT_ONE - 1;
        // A weight in both halves of a lane.
        let low_half = _mm256_broadcastsi128_si256(_mm_setr_epi8(
            0, 1, 0, 1, 4, 5, 4, 5, 8, 9, 8, 9, 12, 13, 12, 13,
        ));
        let twice = |p| {
            let both = _mm256_shuffle_epi8(_mm256_srli_epi32::<CUT>(p), low_half);
            _mm256_and_si256(both, _mm256_set1_epi32(PART | PART << 16))
        };
        let between = |low, high, weight| {
            _mm256_add_epi16(
                low,
                _mm256_mulhrs_epi16(_mm256_sub_epi16(high, low), weight),
            )
        };
        let along_i = twice(at[0]);
        let lower = between(low[0], low[1], along_i);
        let upper = between(high[0], high[1], along_i);
        let pair = between(lower, upper, twice(at[2]));
        // The weights along j are w - 2^15, which is w with the sign bit set, and -w: the lower
        // neighbour's own weight can be 2^15, which 16 bits hold only as a negative.
        let w = _mm256_and_si256(_mm256_srli_epi32::<CUT>(at[1]), _mm256_set1_epi32(PART));
        let lower = _mm256_or_si256(w, _mm256_set1_epi32(WEIGHT_ONE));
        let sample = _mm256_madd_epi16(pair, _mm256_sub_epi32(lower, _mm256_slli_epi32::<16>(w)));
        _mm256_sra_epi32(sample, _mm_cvtsi32_si128(self.job.shift as i32))
    }

    /// The numbers of the lower corners of 8 positions. Those outside the volume get a corner
    /// whose neighbours are all zero: read as numbers without sign, negative ones are large.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn voxels(&self, at: Positions) -> [u32; 8] {
        let voxel =
            |a: usize| _mm256_srli_epi32::<{ BITS as i32 }>(_mm256_min_epu32(at[a], self.last[a]));
        let voxels = _mm256_add_epi32(
            voxel(0),
            _mm256_add_epi32(
                _mm256_mullo_epi32(voxel(1), self.row_voxels),
                _mm256_mullo_epi32(voxel(2), self.slice_voxels),
            ),
        );
        let mut places = [0; 8];
        // SAFETY: the array has the 32 bytes that are stored.
        unsafe { _mm256_storeu_si256(places.as_mut_ptr().cast(), voxels) };
        places
    }
}

/// Values of the two halves' lanes from that of the first and what columns and rows add.
#[inline]
#[target_feature(enable = "avx2")]
fn lanes(first: [i32; 3], (column, row): ([i32; 3], [i32; 3])) -> [Positions; 2] {
    let columns = _mm256_setr_epi32(0, 1, 2, 3, 0, 1, 2, 3);
    let rows = _mm256_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1);
    std::array::from_fn(|half| {
        std::array::from_fn(|a| {
            let base = first[a].wrapping_add(row[a].wrapping_mul(2 * half as i32));
            let columns = _mm256_mullo_epi32(columns, _mm256_set1_epi32(column[a]));
            let rows = _mm256_mullo_epi32(rows, _mm256_set1_epi32(row[a]));
            _mm256_add_epi32(_mm256_set1_epi32(base), _mm256_add_epi32(columns, rows))
        })
    })
}

#[inline]
#[target_feature(enable = "avx2")]
fn sum(a: Positions, b: Positions) -> Positions {
    std::array::from_fn(|axis| _mm256_add_epi32(a[axis], b[axis]))
}

/// `start + count * step`.
#[inline]
#[target_feature(enable = "avx2")]
fn ahead(start: Positions, step: Positions, count: u32) -> Positions {
    let count = _mm256_set1_epi32(count as i32);
    sum(start, step.map(|s| _mm256_mullo_epi32(s, count)))
}

/// Which of a chunk's 16 samples, on the ray that begins at `start`, lie in cells whose clearance is
/// at most `radius`, and the clearance of the last.
#[inline]
#[target_feature(enable = "avx2")]
fn clearances(job: &Projection, start: [i32; 3], step: [i32; 3], radius: u32) -> (u32, u8) {
    const SHIFT: i32 = (BITS + Occupancy::SHIFT) as i32;
    let table = job.volume.occupancy.padded();
    let cells = job.volume.occupancy.dims;
    let zero = _mm256_setzero_si256();
    let eight = |first: i32| {
        let number = _mm256_add_epi32(
            _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7),
            _mm256_set1_epi32(first),
        );
        let cell = |a: usize| {
            let along = _mm256_mullo_epi32(number, _mm256_set1_epi32(step[a]));
            let position = _mm256_add_epi32(_mm256_set1_epi32(start[a]), along);
            let last = _mm256_set1_epi32(cells[a] as i32 - 1);
            let cell = _mm256_min_epi32(_mm256_srai_epi32::<SHIFT>(position), last);
            _mm256_max_epi32(cell, zero)
        };
        let times = |v, by: usize| _mm256_mullo_epi32(v, _mm256_set1_epi32(by as i32));
        let row = _mm256_add_epi32(times(cell(2), cells[1]), cell(1));
        let at = _mm256_add_epi32(times(row, cells[0]), cell(0));
        // SAFETY: each number is that of a cell of the table, which has three bytes more than its
        // cells for the four that are loaded from each.
        let loaded = unsafe { _mm256_i32gather_epi32::<1>(table.as_ptr().cast(), at) };
        _mm256_and_si256(loaded, _mm256_set1_epi32(0xff))
    };
    let (low, high) = (eight(0), eight(8));
    let near = |clearances| {
        let far = _mm256_cmpgt_epi32(clearances, _mm256_set1_epi32(radius as i32));
        !_mm256_movemask_ps(_mm256_castsi256_ps(far)) as u32 & 0xff
    };
    let last = _mm256_extract_epi32::<7>(high) as u8;
    (near(low) | near(high) << 8, last)
}

/// The pairs at 8 places and those one voxel further.
///
/// # Safety
/// Two pairs can be read from each place.
#[inline]
#[target_feature(enable = "avx2")]
unsafe fn corners(pairs: *const [i16; 2], at: &[u32; 8]) -> [__m256i; 2] {
    // Two places to each half of a register, one load each: faster than the gather instruction,
    // and one load gives both pairs.
    let two = |n: usize| {
        // SAFETY: as this function's.
        unsafe {
            let first = _mm_loadl_epi64(pairs.add(at[n] as usize).cast());
            let second = pairs.add(at[n + 1] as usize).cast();
            _mm_loadh_pd(_mm_castsi128_pd(first), second)
        }
    };
    let four = |n: usize| {
        _mm256_castpd_ps(_mm256_insertf128_pd::<1>(
            _mm256_castpd128_pd256(two(n)),
            two(n + 4),
        ))
    };
    let (even, odd) = (four(0), four(2));
    [
        _mm256_castps_si256(_mm256_shuffle_ps::<0b10_00_10_00>(even, odd)),
        _mm256_castps_si256(_mm256_shuffle_ps::<0b11_01_11_01>(even, odd)),
    ]
}

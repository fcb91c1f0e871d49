//! Tiles of 4 x 4 rays in the lanes of AVX-512, one sample of each ray at a time.

use super::Projection;
use super::fixed::{BITS, CHUNK, TILE, WEIGHT_BITS, WEIGHT_ONE};
use super::occupancy::Occupancy;
use std::arch::x86_64::*;

/// The three indices of 16 positions.
#[derive(Clone, Copy)]
struct Positions {
    i: __m512i,
    j: __m512i,
    k: __m512i,
}

/// Adds the line integrals of a projection's pixels to `out`: see `portable::project_add`, of
/// which this gives the same bits.
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
pub(crate) fn project_add(job: &Projection, out: &mut [f32]) {
    let rect = &job.rect;
    let across = Across::new(job);
    for v in (rect.y0 - rect.y0 % TILE..rect.y1).step_by(TILE) {
        for u in (rect.x0 - rect.x0 % TILE..rect.x1).step_by(TILE) {
            let sums = tile_sums(job, &across, u, v);
            for (lane, &sum) in sums.iter().enumerate() {
                let (x, y) = (u + lane % TILE, v + lane / TILE);
                let inside = (rect.x0..rect.x1).contains(&x) && (rect.y0..rect.y1).contains(&y);
                if sum != 0 && inside {
                    out[y * job.width + x] += sum as f32 * job.scale(x, y);
                }
            }
        }
    }
}

/// What is the same for all tiles.
struct Across {
    /// Column and row of each lane in its tile.
    column: __m512i,
    row: __m512i,
    /// Number of each lane.
    number: __m512i,
    /// The last index along each axis, in fixed point.
    last: Positions,
    /// Voxels of a row and of a slice.
    row_voxels: __m512i,
    slice_voxels: __m512i,
    /// The last cell along each axis, and cells of a row and rows of a slice.
    last_cell: Positions,
    cells: [__m512i; 2],
    /// Cells up to this distance from the tile's centre can hold what one of its rays meets.
    reach: u8,
    /// The volume's box is this many voxels wider for the tile's centre.
    margin: f64,
    step_offsets: ([i32; 3], [i32; 3]),
}

impl Across {
    #[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
    fn new(job: &Projection) -> Self {
        let set = |v: [i32; 3]| Positions {
            i: _mm512_set1_epi32(v[0]),
            j: _mm512_set1_epi32(v[1]),
            k: _mm512_set1_epi32(v[2]),
        };
        let [nx, ny, _] = job.volume.dims;
        let cells = job.volume.occupancy.dims;
        let half = (TILE as f64 - 1.0) / 2.0;
        let radius =
            (job.rays.column.abs() + job.rays.row.abs()).max() * half * job.farthest_mm + 0.01;
        Self {
            column: _mm512_setr_epi32(0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3),
            row: _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3),
            number: _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15),
            last: set(job.last),
            row_voxels: _mm512_set1_epi32(nx as i32),
            slice_voxels: _mm512_set1_epi32((nx * ny) as i32),
            last_cell: set(cells.map(|n| n as i32 - 1)),
            cells: [
                _mm512_set1_epi32(cells[0] as i32),
                _mm512_set1_epi32(cells[1] as i32),
            ],
            reach: (radius / Occupancy::EDGE as f64).ceil().min(255.0) as u8,
            margin: radius,
            step_offsets: job.fixed.step_offsets(),
        }
    }
}

#[inline]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
fn tile_sums(job: &Projection, across: &Across, u: usize, v: usize) -> [i32; 16] {
    let half = (TILE as f64 - 1.0) / 2.0;
    let slope =
        job.rays.axis + job.rays.column * (u as f64 + half) + job.rays.row * (v as f64 + half);
    let Some((first, end)) = job.samples(slope, across.margin) else {
        return [0; 16];
    };
    let tile = job.fixed.tile(u, v);
    let (column, row) = across.step_offsets;
    let step = in_tile(across, tile.step(), column, row);
    let center = |at: [i32; 3], column: [i32; 3], row: [i32; 3]| -> [i32; 3] {
        std::array::from_fn(|a| {
            at[a].wrapping_add(column[a].wrapping_add(row[a]).wrapping_mul(TILE as i32 - 1) / 2)
        })
    };
    let center_step = center(tile.step(), column, row);
    let fastest = center_step
        .iter()
        .map(|s| s.unsigned_abs())
        .max()
        .unwrap_or(1);
    let chunks_per_cell = (Occupancy::EDGE << BITS) as f32 / fastest as f32 / CHUNK as f32;
    let mut sums = _mm512_setzero_si512();
    let shift = _mm_cvtsi32_si128(job.shift as i32);
    let mut chunk = first / CHUNK;
    while chunk * CHUNK < end {
        let (column, row) = job.fixed.offsets(chunk);
        let start = tile.start(chunk);
        let distances = chunk_distances(job, across, center(start, column, row), center_step);
        let mut mask = u32::from(_mm512_cmple_epu32_mask(
            distances,
            _mm512_set1_epi32(i32::from(across.reach)),
        ));
        mask &=
            samples_from(first.saturating_sub(chunk * CHUNK)) & !samples_from(end - chunk * CHUNK);
        if mask == 0 {
            // The last sample's distance tells how many further ones are far from everything.
            let distance = _mm_extract_epi32::<3>(_mm512_extracti32x4_epi32::<3>(distances));
            let cells = distance - i32::from(across.reach) - 1;
            chunk += 1 + (cells.max(0) as f32 * chunks_per_cell) as u32;
            continue;
        }
        let start = in_tile(across, start, column, row);
        while mask != 0 {
            let k = _mm512_set1_epi32(mask.trailing_zeros() as i32);
            mask &= mask - 1;
            let at = Positions {
                i: _mm512_add_epi32(start.i, _mm512_mullo_epi32(step.i, k)),
                j: _mm512_add_epi32(start.j, _mm512_mullo_epi32(step.j, k)),
                k: _mm512_add_epi32(start.k, _mm512_mullo_epi32(step.k, k)),
            };
            let negative = negative_samples(job, across, at);
            sums = _mm512_sub_epi32(sums, _mm512_sra_epi32(negative, shift));
        }
        chunk += 1;
    }
    let mut result = [0; 16];
    // SAFETY: the array has the 64 bytes that are stored.
    unsafe { _mm512_storeu_si512(result.as_mut_ptr().cast(), sums) };
    result
}

/// A mask of the samples of a chunk from number `first` on.
#[inline(always)]
fn samples_from(first: u32) -> u32 {
    if first >= CHUNK {
        0
    } else {
        0xffff << first & 0xffff
    }
}

/// A value of each lane's ray from that of the tile's first and what columns and rows add.
#[inline]
#[target_feature(enable = "avx512f")]
fn in_tile(across: &Across, at: [i32; 3], column: [i32; 3], row: [i32; 3]) -> Positions {
    let one = |a: usize| {
        let columns = _mm512_mullo_epi32(across.column, _mm512_set1_epi32(column[a]));
        let rows = _mm512_mullo_epi32(across.row, _mm512_set1_epi32(row[a]));
        _mm512_add_epi32(_mm512_set1_epi32(at[a]), _mm512_add_epi32(columns, rows))
    };
    Positions {
        i: one(0),
        j: one(1),
        k: one(2),
    }
}

/// How far the cells of a chunk's 16 samples lie from one that holds something, on the ray that
/// begins at `start`.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn chunk_distances(job: &Projection, across: &Across, start: [i32; 3], step: [i32; 3]) -> __m512i {
    const SHIFT: u32 = BITS + Occupancy::SHIFT as u32;
    let cell = |a: usize, last: __m512i| {
        let along = _mm512_mullo_epi32(across.number, _mm512_set1_epi32(step[a]));
        let position = _mm512_add_epi32(_mm512_set1_epi32(start[a]), along);
        let cell = _mm512_srai_epi32::<SHIFT>(position);
        _mm512_max_epi32(_mm512_min_epi32(cell, last), _mm512_setzero_si512())
    };
    let (i, j, k) = (
        cell(0, across.last_cell.i),
        cell(1, across.last_cell.j),
        cell(2, across.last_cell.k),
    );
    let rows = _mm512_add_epi32(_mm512_mullo_epi32(k, across.cells[1]), j);
    let at = _mm512_add_epi32(_mm512_mullo_epi32(rows, across.cells[0]), i);
    let table = job.volume.occupancy.padded();
    // SAFETY: each index lies within the table, which has three bytes more than its cells for the
    // four that are loaded from each.
    let loaded = unsafe { _mm512_i32gather_epi32::<1>(at, table.as_ptr().cast()) };
    _mm512_and_si512(loaded, _mm512_set1_epi32(0xff))
}

/// The interpolated volume at 16 positions, in units of the voxels over [`WEIGHT_ONE`], negative.
#[inline]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
fn negative_samples(job: &Projection, across: &Across, at: Positions) -> __m512i {
    let clamp = |p, last| _mm512_max_epi32(_mm512_min_epi32(p, last), _mm512_setzero_si512());
    let (i, j, k) = (
        clamp(at.i, across.last.i),
        clamp(at.j, across.last.j),
        clamp(at.k, across.last.k),
    );
    let voxel = _mm512_add_epi32(
        _mm512_srli_epi32::<BITS>(i),
        _mm512_add_epi32(
            _mm512_mullo_epi32(_mm512_srli_epi32::<BITS>(j), across.row_voxels),
            _mm512_mullo_epi32(_mm512_srli_epi32::<BITS>(k), across.slice_voxels),
        ),
    );
    let mut at = [0u32; 16];
    // SAFETY: the array has the 64 bytes that are stored.
    unsafe { _mm512_storeu_si512(at.as_mut_ptr().cast(), voxel) };
    let pairs = job.volume.pairs.as_ptr();
    let slice = job.volume.dims[0] * job.volume.dims[1];
    // SAFETY: positions are clamped to the volume, and `pairs` has the slice and the two pairs
    // beyond its last voxel that samples there read.
    let (low, high) = unsafe { (corners(pairs, &at), corners(pairs.add(slice), &at)) };
    const CUT: u32 = BITS - WEIGHT_BITS;
    let part = _mm512_set1_epi32(WEIGHT_ONE - 1);
    let weight = |p| _mm512_and_si512(_mm512_srli_epi32::<CUT>(p), part);
    let twice = |w| _mm512_or_si512(w, _mm512_slli_epi32::<16>(w));
    let between = |low, high, weight| {
        _mm512_add_epi16(
            low,
            _mm512_mulhrs_epi16(_mm512_sub_epi16(high, low), weight),
        )
    };
    let along_i = twice(weight(i));
    let lower = between(low[0], low[1], along_i);
    let upper = between(high[0], high[1], along_i);
    let pair = between(lower, upper, twice(weight(k)));
    // The weight of the lower neighbour along j can be 2^15, which only its negative can stand
    // for in 16 bits: w - 2^15 is w with the sign bit set.
    let w = weight(j);
    let lower = _mm512_or_si512(w, _mm512_set1_epi32(WEIGHT_ONE));
    let upper = _mm512_slli_epi32::<16>(_mm512_sub_epi32(_mm512_setzero_si512(), w));
    _mm512_madd_epi16(pair, _mm512_or_si512(lower, upper))
}

/// The pairs at 16 places and those one voxel further.
///
/// # Safety
/// Two pairs can be read from each place.
#[inline]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
unsafe fn corners(pairs: *const [i16; 2], at: &[u32; 16]) -> [__m512i; 2] {
    // Two places to each quarter of a register, one load each: on most processors faster than the
    // gather instruction, and one load gives both pairs.
    let two = |n: usize| {
        // SAFETY: as this function's.
        unsafe {
            let first = _mm_loadl_epi64(pairs.add(at[n] as usize).cast());
            let second = pairs.add(at[n + 1] as usize).cast();
            _mm_loadh_pd(_mm_castsi128_pd(first), second)
        }
    };
    let eight = |n: usize| {
        let low = _mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(two(n)), two(n + 4));
        let high = _mm256_insertf128_pd::<1>(_mm256_castpd128_pd256(two(n + 8)), two(n + 12));
        _mm512_castpd_ps(_mm512_insertf64x4::<1>(_mm512_castpd256_pd512(low), high))
    };
    let (even, odd) = (eight(0), eight(2));
    [
        _mm512_castps_si512(_mm512_shuffle_ps::<0b10_00_10_00>(even, odd)),
        _mm512_castps_si512(_mm512_shuffle_ps::<0b11_01_11_01>(even, odd)),
    ]
}

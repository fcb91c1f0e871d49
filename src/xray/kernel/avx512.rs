//! Tiles of 4 x 4 rays in the lanes of AVX-512, one sample of each ray at a time.
//!
//! A tile is done in two passes. The first finds the samples that can meet something and where in
//! memory their voxels are, and asks for them; the second interpolates. Between the two passes of
//! a tile comes the second pass of the tile before, so that voxels arrive from the outer caches in
//! the meantime.

use super::Projection;
use super::fixed::{BITS, CHUNK, TileRays, WEIGHT_BITS, WEIGHT_ONE};
use super::occupancy::Occupancy;
use super::tile::Tiles;
use std::arch::x86_64::*;
use std::cell::RefCell;

/// Adds the line integrals of a projection's pixels to `out`: see `portable::project_add`, of
/// which this gives the same bits.
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
pub(crate) fn project_add(job: &Projection, out: &mut [f32]) {
    TILES.with_borrow_mut(|[next, current]| {
        let call = Call::new(job);
        current.runs.clear();
        for (u, v) in call.tiles.first_pixels() {
            call.find_samples(u, v, next);
            if next.runs.is_empty() {
                continue;
            }
            call.add_tile(current, out);
            std::mem::swap(next, current);
        }
        call.add_tile(current, out);
    });
}

thread_local! {
    /// The tile between its passes and the one before it, kept from call to call for the sake of
    /// their memory.
    static TILES: RefCell<[Tile; 2]> = RefCell::default();
}

/// What the first pass over a tile finds.
#[derive(Default)]
struct Tile {
    /// The first pixel.
    u: usize,
    v: usize,
    rays: TileRays,
    runs: Vec<Run>,
    /// The voxels of all samples of all runs. More than that may be stored.
    places: Vec<[u32; 16]>,
}

/// Consecutive samples of a chunk.
struct Run {
    chunk: u32,
    first: u32,
    count: u32,
}

/// Indices of 16 positions in fixed point.
#[derive(Clone, Copy)]
struct Positions {
    i: __m512i,
    j: __m512i,
    k: __m512i,
}

/// One projection with what is the same for all of its tiles.
struct Call<'a> {
    job: &'a Projection<'a>,
    tiles: Tiles<'a>,
    /// Column and row of each lane in its tile.
    column: __m512i,
    row: __m512i,
    /// The last index along each axis.
    last: Positions,
    /// Voxels of a row and of a slice.
    row_voxels: __m512i,
    slice_voxels: __m512i,
    prefetch: Prefetch,
}

/// Which voxels are asked for ahead of time: a few lanes whose cache lines hold most of what all
/// of them need.
struct Prefetch {
    /// Every this many samples of a run.
    every: u32,
    lanes: [u8; 8],
    /// Lanes for which the upper slice is asked for too.
    upper: [u8; 2],
}

impl<'a> Call<'a> {
    #[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
    fn new(job: &'a Projection<'a>) -> Self {
        let [nx, ny, _] = job.volume.dims;
        Self {
            job,
            tiles: Tiles::new(job),
            column: _mm512_setr_epi32(0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3),
            row: _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3),
            last: all(job.last),
            row_voxels: _mm512_set1_epi32(nx as i32),
            slice_voxels: _mm512_set1_epi32((nx * ny) as i32),
            prefetch: Prefetch::new(job),
        }
    }

    /// First pass: fills `tile` with the samples that can meet something.
    #[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
    fn find_samples(&self, u: usize, v: usize, tile: &mut Tile) {
        let job = self.job;
        tile.runs.clear();
        let Some(span) = self.tiles.span(u, v) else {
            return;
        };
        (tile.u, tile.v, tile.rays) = (u, v, span.rays);
        let step = self.step(&tile.rays);
        let mut count = 0;
        let near = |start, step, radius| clearances(job, start, step, radius);
        self.tiles.for_each_chunk(&span, near, |chunk| {
            let start = self.lanes(chunk.start, chunk.offsets);
            if tile.places.len() < count + CHUNK as usize {
                tile.places.resize(2 * count + CHUNK as usize, [0; 16]);
            }
            for (first, run) in chunk.runs() {
                tile.runs.push(Run {
                    chunk: chunk.number,
                    first,
                    count: run,
                });
                let mut at = ahead(start, step, first);
                for (n, places) in (0..run).zip(&mut tile.places[count..]) {
                    let voxels = self.voxels(at);
                    // SAFETY: the array has the 64 bytes that are stored.
                    unsafe { _mm512_storeu_si512(places.as_mut_ptr().cast(), voxels) };
                    if n % self.prefetch.every == 0 {
                        self.prefetch.ask(job, places);
                    }
                    at = sum(at, step);
                }
                count += run as usize;
            }
        });
    }

    /// Second pass: adds the line integrals of a tile's pixels to `out`.
    #[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
    fn add_tile(&self, tile: &Tile, out: &mut [f32]) {
        if tile.runs.is_empty() {
            return;
        }
        let job = self.job;
        let step = self.step(&tile.rays);
        let shift = _mm_cvtsi32_si128(job.shift as i32);
        let mut sums = _mm512_setzero_si512();
        let mut places = tile.places.iter();
        for run in &tile.runs {
            let start = self.lanes(tile.rays.start(run.chunk), job.fixed.offsets(run.chunk));
            let mut at = ahead(start, step, run.first);
            for (_, places) in (0..run.count).zip(&mut places) {
                let negative = negative_samples(job, places, at);
                sums = _mm512_sub_epi32(sums, _mm512_sra_epi32(negative, shift));
                at = sum(at, step);
            }
        }
        let mut lanes = [0; 16];
        // SAFETY: the array has the 64 bytes that are stored.
        unsafe { _mm512_storeu_si512(lanes.as_mut_ptr().cast(), sums) };
        job.add_tile_sums(tile.u, tile.v, &lanes, out);
    }

    /// What each lane's ray moves on from sample to sample.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn step(&self, rays: &TileRays) -> Positions {
        self.lanes(rays.step(), self.tiles.step_offsets)
    }

    /// Values of all lanes from that of the first and what columns and rows add.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn lanes(&self, first: [i32; 3], (column, row): ([i32; 3], [i32; 3])) -> Positions {
        let one = |a: usize| {
            let columns = _mm512_mullo_epi32(self.column, _mm512_set1_epi32(column[a]));
            let rows = _mm512_mullo_epi32(self.row, _mm512_set1_epi32(row[a]));
            _mm512_add_epi32(_mm512_set1_epi32(first[a]), _mm512_add_epi32(columns, rows))
        };
        Positions {
            i: one(0),
            j: one(1),
            k: one(2),
        }
    }

    /// The numbers of the lower corners of 16 positions. Those outside the volume get a corner
    /// whose neighbours are all zero: read as numbers without sign, negative ones are large.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn voxels(&self, at: Positions) -> __m512i {
        let voxel = |p, last| _mm512_srli_epi32::<BITS>(_mm512_min_epu32(p, last));
        _mm512_add_epi32(
            voxel(at.i, self.last.i),
            _mm512_add_epi32(
                _mm512_mullo_epi32(voxel(at.j, self.last.j), self.row_voxels),
                _mm512_mullo_epi32(voxel(at.k, self.last.k), self.slice_voxels),
            ),
        )
    }
}

impl Prefetch {
    fn new(job: &Projection) -> Self {
        let (column, row) = (&job.rays.column, &job.rays.row);
        let along_rays = job.rays.axis.iamax() == 0;
        // Lanes side by side along the voxels' rows share cache lines.
        let lanes = if column.x.abs() >= row.x.abs() {
            [0, 3, 4, 7, 8, 11, 12, 15]
        } else {
            [0, 1, 2, 3, 12, 13, 14, 15]
        };
        // The lanes on the uppermost slice of the tile.
        let upper = if column.z.abs() >= row.z.abs() {
            if column.z > 0.0 { [3, 15] } else { [0, 12] }
        } else if row.z > 0.0 {
            [12, 15]
        } else {
            [0, 3]
        };
        Self {
            // Along the voxels' rows one cache line serves a dozen samples.
            every: if along_rays { 8 } else { 1 },
            lanes,
            upper,
        }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn ask(&self, job: &Projection, places: &[u32; 16]) {
        let pairs = job.volume.pairs.as_ptr();
        for lane in self.lanes {
            let at = places[usize::from(lane) % 16] as usize;
            _mm_prefetch::<_MM_HINT_T0>(pairs.wrapping_add(at).cast());
        }
        let slice = pairs.wrapping_add(job.volume.dims[0] * job.volume.dims[1]);
        for lane in self.upper {
            let at = places[usize::from(lane) % 16] as usize;
            _mm_prefetch::<_MM_HINT_T0>(slice.wrapping_add(at).cast());
        }
    }
}

/// The same in all lanes.
#[inline]
#[target_feature(enable = "avx512f")]
fn all(index: [i32; 3]) -> Positions {
    Positions {
        i: _mm512_set1_epi32(index[0]),
        j: _mm512_set1_epi32(index[1]),
        k: _mm512_set1_epi32(index[2]),
    }
}

#[inline]
#[target_feature(enable = "avx512f")]
fn sum(a: Positions, b: Positions) -> Positions {
    Positions {
        i: _mm512_add_epi32(a.i, b.i),
        j: _mm512_add_epi32(a.j, b.j),
        k: _mm512_add_epi32(a.k, b.k),
    }
}

/// `start + count * step`.
#[inline]
#[target_feature(enable = "avx512f")]
fn ahead(start: Positions, step: Positions, count: u32) -> Positions {
    let count = _mm512_set1_epi32(count as i32);
    let times = |step| _mm512_mullo_epi32(step, count);
    let steps = Positions {
        i: times(step.i),
        j: times(step.j),
        k: times(step.k),
    };
    sum(start, steps)
}

/// Which of a chunk's 16 samples, on the ray that begins at `start`, lie in cells whose clearance is
/// at most `radius`, and the clearance of the last.
#[inline]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl")]
fn clearances(job: &Projection, start: [i32; 3], step: [i32; 3], radius: u32) -> (u32, u8) {
    const SHIFT: u32 = BITS + Occupancy::SHIFT;
    let number = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    let cells = job.volume.occupancy.dims;
    let cell = |a: usize| {
        let along = _mm512_mullo_epi32(number, _mm512_set1_epi32(step[a]));
        let position = _mm512_add_epi32(_mm512_set1_epi32(start[a]), along);
        let cell = _mm512_srai_epi32::<SHIFT>(position);
        let last = _mm512_set1_epi32(cells[a] as i32 - 1);
        _mm512_max_epi32(_mm512_min_epi32(cell, last), _mm512_setzero_si512())
    };
    let times = |v, by: usize| _mm512_mullo_epi32(v, _mm512_set1_epi32(by as i32));
    let row = _mm512_add_epi32(times(cell(2), cells[1]), cell(1));
    let at = _mm512_add_epi32(times(row, cells[0]), cell(0));
    let table = job.volume.occupancy.padded();
    // SAFETY: each number is that of a cell of the table, which has three bytes more than its
    // cells for the four that are loaded from each.
    let loaded = unsafe { _mm512_i32gather_epi32::<1>(at, table.as_ptr().cast()) };
    let clearances = _mm512_and_si512(loaded, _mm512_set1_epi32(0xff));
    let near = _mm512_cmple_epu32_mask(clearances, _mm512_set1_epi32(radius as i32));
    let last = _mm_extract_epi32::<3>(_mm512_extracti32x4_epi32::<3>(clearances));
    (u32::from(near), last as u8)
}

/// The interpolated volume at 16 positions, whose voxels are at `places`, in units of the voxels
/// over [`WEIGHT_ONE`], negative.
#[inline]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
fn negative_samples(job: &Projection, places: &[u32; 16], at: Positions) -> __m512i {
    let pairs = job.volume.pairs.as_ptr();
    let slice = job.volume.dims[0] * job.volume.dims[1];
    // SAFETY: places are those of voxels, and `pairs` has the slice and the two pairs beyond its
    // last voxel that samples there read.
    let (low, high) = unsafe { (corners(pairs, places), corners(pairs.add(slice), places)) };
    const CUT: u32 = BITS - WEIGHT_BITS;
    const PART: i32 = WEIGHT_ONE - 1;
    // A weight in both halves of a lane.
    let low_half = _mm512_broadcast_i32x4(_mm_setr_epi8(
        0, 1, 0, 1, 4, 5, 4, 5, 8, 9, 8, 9, 12, 13, 12, 13,
    ));
    let twice = |p| {
        let both = _mm512_shuffle_epi8(_mm512_srli_epi32::<CUT>(p), low_half);
        _mm512_and_si512(both, _mm512_set1_epi32(PART | PART << 16))
    };
    let between = |low, high, weight| {
        _mm512_add_epi16(
            low,
            _mm512_mulhrs_epi16(_mm512_sub_epi16(high, low), weight),
        )
    };
    let along_i = twice(at.i);
    let lower = between(low[0], low[1], along_i);
    let upper = between(high[0], high[1], along_i);
    let pair = between(lower, upper, twice(at.k));
    // The weights along j are w - 2^15, which is w with the sign bit set, and -w: the lower
    // neighbour's own weight can be 2^15, which 16 bits hold only as a negative.
    let w = _mm512_and_si512(_mm512_srli_epi32::<CUT>(at.j), _mm512_set1_epi32(PART));
    let lower = _mm512_or_si512(w, _mm512_set1_epi32(WEIGHT_ONE));
    _mm512_madd_epi16(pair, _mm512_sub_epi32(lower, _mm512_slli_epi32::<16>(w)))
}

/// The pairs at 16 places and those one voxel further.
///
/// # Safety
/// Two pairs can be read from each place.
#[inline]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl")]
unsafe fn corners(pairs: *const [i16; 2], at: &[u32; 16]) -> [__m512i; 2] {
    // Two places to each quarter of a register, one load each: faster than the gather
    // instruction, and one load gives both pairs.
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

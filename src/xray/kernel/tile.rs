//! Which samples of a tile of rays can meet something: the way of all vector kernels along a tile.

use super::Projection;
use super::fixed::{BITS, CHUNK, TILE, TileRays};

/// Rays of a tile.
pub(super) const LANES: usize = TILE * TILE;

/// More voxels than positions in fixed point can be off.
const ROUNDING: f64 = 0.01;

/// What is the same for all tiles of a projection.
pub(super) struct Tiles<'a> {
    job: &'a Projection<'a>,
    /// The rays of a tile lie at most this many voxels from its centre, per mm of depth, and
    /// anywhere in the volume.
    radius_per_mm: f64,
    radius: f64,
    /// What columns and rows of a tile add to the index per sample.
    pub step_offsets: ([i32; 3], [i32; 3]),
}

/// A tile's rays and the samples `first..end` of them that lie in the volume.
pub(super) struct Span {
    pub rays: TileRays,
    first: u32,
    end: u32,
}

/// Samples of a chunk that can meet something, on any ray of a tile.
pub(super) struct Chunk {
    pub number: u32,
    /// Index of the chunk's first sample on the ray of the tile's first pixel, and what columns and
    /// rows add.
    pub start: [i32; 3],
    pub offsets: ([i32; 3], [i32; 3]),
    /// One bit a sample, the first lowest.
    pub mask: u32,
}

impl<'a> Tiles<'a> {
    pub fn new(job: &'a Projection<'a>) -> Self {
        let half = (TILE as f64 - 1.0) / 2.0;
        let radius_per_mm = (job.rays.column.abs() + job.rays.row.abs()).max() * half;
        Self {
            job,
            radius_per_mm,
            radius: radius_per_mm * job.farthest_mm + ROUNDING,
            step_offsets: job.fixed.step_offsets(),
        }
    }

    /// The first pixels of all tiles that meet the projection's rectangle.
    pub fn first_pixels(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let rect = self.job.rect;
        (rect.y0 - rect.y0 % TILE..rect.y1)
            .step_by(TILE)
            .flat_map(move |v| {
                let columns = (rect.x0 - rect.x0 % TILE..rect.x1).step_by(TILE);
                columns.map(move |u| (u, v))
            })
    }

    /// The part of a tile's rays that lies in the volume, or `None` if there is none.
    #[inline(always)]
    pub fn span(&self, u: usize, v: usize) -> Option<Span> {
        let job = self.job;
        let half = (TILE as f64 - 1.0) / 2.0;
        let slope =
            job.rays.axis + job.rays.column * (u as f64 + half) + job.rays.row * (v as f64 + half);
        let (first, end) = job.samples(slope, self.radius)?;
        let rays = job.fixed.tile(u, v);
        Some(Span { rays, first, end })
    }

    /// Goes through the chunks of a tile in which a sample can meet something.
    ///
    /// `near` gives, for a chunk's 16 samples on a ray (index of the first, index per sample), the
    /// mask of those in cells whose clearance is at most a radius, and the clearance of the last.
    #[inline(always)]
    pub fn for_each_chunk(
        &self,
        span: &Span,
        near: impl Fn([i32; 3], [i32; 3], u32) -> (u32, u8),
        mut each: impl FnMut(&Chunk),
    ) {
        let job = self.job;
        let Span { rays, first, end } = *span;
        let (column, row) = self.step_offsets;
        let step = center(rays.step(), column, row);
        let fastest = step.iter().map(|s| s.unsigned_abs()).max();
        let chunks_per_voxel = (1u32 << BITS) as f32 / (fastest.unwrap_or(1) * CHUNK) as f32;
        let mut number = first / CHUNK;
        while number * CHUNK < end {
            let (column, row) = job.fixed.offsets(number);
            let start = rays.start(number);
            // A ray may meet something where it is farther from the centre than the centre's cell
            // can grow less one voxel.
            let depth = f64::from((number + 1) * CHUNK) * job.step_mm;
            let radius = (self.radius_per_mm * depth + ROUNDING).min(self.radius);
            let (mask, last) = near(center(start, column, row), step, radius.ceil() as u32);
            let mask = mask
                & samples_from(first.saturating_sub(number * CHUNK))
                & !samples_from(end - number * CHUNK);
            if mask == 0 {
                // The last sample's clearance tells how many more are far from everything.
                let free = f32::from(last) - 1.0 - radius as f32;
                number += 1 + (free.max(0.0) * chunks_per_voxel) as u32;
                continue;
            }
            let offsets = (column, row);
            let chunk = Chunk {
                number,
                start,
                offsets,
                mask,
            };
            each(&chunk);
            number += 1;
        }
    }
}

impl Chunk {
    /// Consecutive samples: number of the first, and how many.
    #[inline(always)]
    pub fn runs(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        let mut mask = self.mask;
        std::iter::from_fn(move || {
            (mask != 0).then(|| {
                let first = mask.trailing_zeros();
                let count = (mask >> first).trailing_ones();
                mask &= samples_from(first + count);
                (first, count)
            })
        })
    }
}

/// The value at a tile's centre, of which no lane has a ray.
#[inline(always)]
fn center(first: [i32; 3], column: [i32; 3], row: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|a| {
        let diagonal = column[a].wrapping_add(row[a]);
        first[a].wrapping_add(diagonal.wrapping_mul(TILE as i32 - 1) / 2)
    })
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

//! Positions along rays in whole numbers.
//!
//! All kernels follow the rays in fixed point and interpolate in integers, so that every level of
//! vector instructions, and every way to go through the pixels, gives the same bits.

use crate::geometry::Vector;
use crate::xray::rays::IndexRays;

/// Fractional bits of an index within a chunk: a millionth of a voxel, with room for 1024 voxels.
pub(crate) const BITS: u32 = 21;
/// Fractional bits of an index on the long way from the source.
const WIDE_BITS: u32 = 40;
/// Fractional bits of a sample's weights.
pub(crate) const WEIGHT_BITS: u32 = 15;
/// The weights of two neighbours sum to this.
pub(crate) const WEIGHT_ONE: i32 = 1 << WEIGHT_BITS;

/// The weight of the upper neighbour at a position. Cutting its digits off rounds the position to
/// the nearest weight, since half a weight is added to all positions ([`FixedRays::tile`]).
#[inline(always)]
pub(crate) fn weight(position: i32) -> i32 {
    (position >> (BITS - WEIGHT_BITS)) & (WEIGHT_ONE - 1)
}

/// Samples along a ray are followed in chunks of this many.
pub(crate) const CHUNK: u32 = 16;
/// Pixels are handled in tiles of this many columns and rows, which begin at its multiples.
pub(crate) const TILE: usize = 4;

/// The rays of an image in fixed point. Sample k of chunk c is sample `c * CHUNK + k` of the ray,
/// at depth `(c * CHUNK + k) * step_mm`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FixedRays {
    source: [i64; 3],
    /// Index per chunk along the ray of pixel (0, 0), and what columns and rows add.
    axis: [i64; 3],
    pub column: [i64; 3],
    pub row: [i64; 3],
}

/// The rays of one tile of pixels.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TileRays {
    source: [i64; 3],
    /// Index per chunk along the ray of the tile's first pixel.
    slope: [i64; 3],
}

impl FixedRays {
    pub fn new(rays: &IndexRays, step_mm: f64) -> Self {
        let wide = |v: &Vector, scale: f64| {
            std::array::from_fn(|a| (v[a] * scale * (1u64 << WIDE_BITS) as f64).round() as i64)
        };
        let chunk = f64::from(CHUNK) * step_mm;
        Self {
            source: wide(&rays.source, 1.0),
            axis: wide(&rays.axis, chunk),
            column: wide(&rays.column, chunk),
            row: wide(&rays.row, chunk),
        }
    }

    /// The rays of the tile whose first pixel is (u, v).
    #[inline(always)]
    pub fn tile(&self, u: usize, v: usize) -> TileRays {
        const HALF_WEIGHT: i64 = 1 << (WIDE_BITS - WEIGHT_BITS - 1);
        TileRays {
            source: self.source.map(|x| x + HALF_WEIGHT),
            slope: std::array::from_fn(|a| {
                self.axis[a] + self.column[a] * u as i64 + self.row[a] * v as i64
            }),
        }
    }

    /// What one column and one row of a tile add to the index of a chunk's first sample.
    #[inline(always)]
    pub fn offsets(&self, chunk: u32) -> ([i32; 3], [i32; 3]) {
        let at = |v: &[i64; 3]| v.map(|x| narrow(x * i64::from(chunk)));
        (at(&self.column), at(&self.row))
    }

    /// What one column and one row of a tile add to the index per sample.
    #[inline(always)]
    pub fn step_offsets(&self) -> ([i32; 3], [i32; 3]) {
        (self.column.map(per_sample), self.row.map(per_sample))
    }
}

impl TileRays {
    /// Index of a chunk's first sample on the ray of the tile's first pixel.
    #[inline(always)]
    pub fn start(&self, chunk: u32) -> [i32; 3] {
        std::array::from_fn(|a| narrow(self.source[a] + self.slope[a] * i64::from(chunk)))
    }

    /// Index per sample along the ray of the tile's first pixel.
    #[inline(always)]
    pub fn step(&self) -> [i32; 3] {
        self.slope.map(per_sample)
    }
}

/// A wide index rounded to [`BITS`]. Far outside any volume it wraps around, which does no harm:
/// nothing is read there.
#[inline(always)]
fn narrow(wide: i64) -> i32 {
    const SHIFT: u32 = WIDE_BITS - BITS;
    ((wide + (1 << (SHIFT - 1))) >> SHIFT) as i32
}

/// A wide index per chunk as an index per sample.
#[inline(always)]
fn per_sample(wide: i64) -> i32 {
    const SHIFT: u32 = WIDE_BITS - BITS + CHUNK.ilog2();
    ((wide + (1 << (SHIFT - 1))) >> SHIFT) as i32
}

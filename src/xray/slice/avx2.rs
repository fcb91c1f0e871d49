//! Sums over slices with AVX2: sixteen points of the lattice at a time, in quarters.

use super::portable::Row;
use super::sums::Sums;
use super::tables::{Columns, Tables};
use super::{Lattice, SliceStack};
use std::arch::x86_64::*;

/// Adds the slices of the group that begins with `first` to the sums: see `portable::add_group`, of
/// which this gives the same bits.
#[target_feature(enable = "avx2")]
pub(super) fn add_group(
    lattice: &Lattice,
    stack: &SliceStack,
    first: usize,
    tables: &mut Tables,
    sums: &mut Sums,
) {
    if !tables.prepare(lattice, stack, first) {
        return;
    }
    let voxels = stack.voxels();
    let stride = stack.stride;
    for point in tables.rows.0..tables.rows.1 {
        let row = Row::new(tables, stack, point);
        if row.cells.iter().all(|&cells| cells == 0) {
            continue;
        }
        for (sums, block) in sums.row(lattice, point).iter_mut().zip(&tables.blocks) {
            let mut groups = [_mm256_setzero_si256(); 2];
            let mut any = 0;
            for n in 0..tables.slices {
                let seen = row.cells[n] & block.cells[n];
                any |= seen;
                if seen == 0 {
                    continue;
                }
                let at = row.start[n].wrapping_add_signed(block.window[n] as isize);
                debug_assert!(at + stride + 32 <= voxels.len());
                let weight = _mm256_set1_epi16(row.weight[n]);
                for (half, group) in groups.iter_mut().enumerate() {
                    // SAFETY: the block's window overlaps the row, or it had no cell in common with
                    // it, and windows that overlap a row lie in memory, in this row and in the next
                    // (`SliceStack::voxels`), which `Row` makes sure of being there.
                    let sum = unsafe {
                        let at = voxels.as_ptr().add(at);
                        eight(at, at.add(stride), weight, &block.columns[n], 8 * half)
                    };
                    *group = _mm256_add_epi32(*group, sum);
                }
            }
            if any == 0 {
                continue;
            }
            for (half, group) in groups.into_iter().enumerate() {
                // SAFETY: eight of sixteen sums are 32 bytes, aligned to 32.
                unsafe {
                    let at = sums.0.as_mut_ptr().add(8 * half);
                    let new = _mm256_add_ps(_mm256_load_ps(at), _mm256_cvtepi32_ps(group));
                    _mm256_store_ps(at, new);
                }
            }
        }
    }
}

/// The samples of the eight points from number `first` of a block on, in a window of two rows.
///
/// # Safety
/// A window can be read from both rows' pointers.
#[inline]
#[target_feature(enable = "avx2")]
unsafe fn eight(
    upper: *const i16,
    lower: *const i16,
    weight: __m256i,
    columns: &Columns,
    first: usize,
) -> __m256i {
    // Four points lie within eight voxels (`LARGEST_STEP`), which the one instruction that shuffles
    // voxels freely can reach.
    let starts = [first, first + 4].map(|point| usize::from(columns.places[point][0]));
    let two = |row: *const i16| {
        // SAFETY: as this function's: eight voxels from the fourth point's lie in the window.
        unsafe {
            _mm256_set_m128i(
                _mm_loadu_si128(row.add(starts[1]).cast()),
                _mm_loadu_si128(row.add(starts[0]).cast()),
            )
        }
    };
    let (upper, lower) = (two(upper), two(lower));
    let part = _mm256_mulhrs_epi16(_mm256_sub_epi16(lower, upper), weight);
    let between = _mm256_add_epi16(upper, part);
    // SAFETY: places and weights of eight points are 32 bytes each.
    let (places, weights) = unsafe {
        (
            _mm256_loadu_si256(columns.places.as_ptr().add(first).cast()),
            _mm256_loadu_si256(columns.weights.as_ptr().add(first).cast()),
        )
    };
    // Bytes of a place relative to its quarter's first voxel.
    let starts = _mm256_set_m128i(
        _mm_set1_epi16(starts[1] as i16),
        _mm_set1_epi16(starts[0] as i16),
    );
    let places = _mm256_slli_epi16::<1>(_mm256_sub_epi16(places, starts));
    let bytes = _mm256_or_si256(
        places,
        _mm256_slli_epi16::<8>(_mm256_add_epi16(places, _mm256_set1_epi16(1))),
    );
    let pairs = _mm256_shuffle_epi8(between, bytes);
    _mm256_madd_epi16(pairs, weights)
}

//! Sums over slices with AVX-512: sixteen points of the lattice at a time.

use super::portable::Row;
use super::sums::Sums;
use super::tables::{Columns, GROUP, Tables};
use super::{Lattice, SliceStack};
use std::arch::x86_64::*;

/// Adds the slices of the group that begins with `first` to the sums: see `portable::add_group`, of
/// which this gives the same bits.
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl,avx512vnni")]
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
        // SAFETY: eight masks are 64 bytes.
        let row_cells = unsafe { _mm512_loadu_epi64(row.cells.as_ptr().cast()) };
        if _mm512_test_epi64_mask(row_cells, row_cells) == 0 {
            continue;
        }
        for (sums, block) in sums.row(lattice, point).iter_mut().zip(&tables.blocks) {
            // SAFETY: as above.
            let block_cells = unsafe { _mm512_loadu_epi64(block.cells.as_ptr().cast()) };
            let mut seen = _mm512_test_epi64_mask(row_cells, block_cells);
            if seen == 0 {
                continue;
            }
            // Where the windows of all slices begin; those that are not seen begin with the zeros
            // before the first row, and a row further zeros are too (the volume's border).
            let mut starts = [0usize; GROUP];
            // SAFETY: eight windows are 32 bytes, eight starts 64.
            unsafe {
                let windows = _mm256_loadu_si256(block.window.as_ptr().cast());
                let rows = _mm512_loadu_epi64(row.start.as_ptr().cast());
                let windows = _mm512_cvtepi32_epi64(windows);
                let at = _mm512_maskz_add_epi64(seen, rows, windows);
                _mm512_storeu_epi64(starts.as_mut_ptr().cast(), at);
            }
            // SAFETY: a window overlaps its row, or the block has no cell in common with it; windows
            // that overlap a row lie in memory, in this row and in the next (`SliceStack::voxels`),
            // which `Row` makes sure of being there.
            let sample = |group, n: usize| unsafe {
                debug_assert!(starts[n] + stride + 32 <= voxels.len());
                let at = voxels.as_ptr().add(starts[n]);
                let weight = _mm512_set1_epi16(row.weight[n]);
                add_samples(group, at, at.add(stride), weight, &block.columns[n])
            };
            let mut group = _mm512_setzero_si512();
            if seen.count_ones() > FEW {
                // Without a branch, since which slices are seen is hard to foretell.
                for n in 0..GROUP {
                    group = sample(group, n);
                }
            } else {
                while seen != 0 {
                    group = sample(group, seen.trailing_zeros() as usize % GROUP);
                    seen &= seen - 1;
                }
            }
            // SAFETY: sixteen sums are 64 bytes, aligned to 64.
            unsafe {
                let old = _mm512_load_ps(sums.0.as_ptr());
                let new = _mm512_add_ps(old, _mm512_cvtepi32_ps(group));
                _mm512_store_ps(sums.0.as_mut_ptr(), new);
            }
        }
    }
}

/// Up to so many slices of a group are done one by one.
const FEW: u32 = 3;

/// Adds to the sums of a block the samples of its points in a window of two rows.
///
/// # Safety
/// A window can be read from both rows' pointers.
#[inline]
#[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vl,avx512vnni")]
unsafe fn add_samples(
    group: __m512i,
    upper: *const i16,
    lower: *const i16,
    weight: __m512i,
    columns: &Columns,
) -> __m512i {
    // SAFETY: as this function's; places and weights are 64 bytes each.
    let (upper, lower, places, weights) = unsafe {
        (
            _mm512_loadu_epi16(upper),
            _mm512_loadu_epi16(lower),
            _mm512_loadu_epi16(columns.places.as_ptr().cast()),
            _mm512_loadu_epi16(columns.weights.as_ptr().cast()),
        )
    };
    let part = _mm512_mulhrs_epi16(_mm512_sub_epi16(lower, upper), weight);
    let between = _mm512_add_epi16(upper, part);
    let pairs = _mm512_permutexvar_epi16(places, between);
    _mm512_dpwssd_epi32(group, pairs, weights)
}

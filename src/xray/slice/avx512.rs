//! Sums over slices with AVX-512: sixteen points of the lattice at a time.

use super::portable::Row;
use super::sums::Sums;
use super::tables::{GROUP, Tables};
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
            let mut group = _mm512_setzero_si512();
            while seen != 0 {
                let n = seen.trailing_zeros() as usize % GROUP;
                seen &= seen - 1;
                let at = row.start[n].wrapping_add_signed(block.window[n] as isize);
                debug_assert!(at + stride + 32 <= voxels.len());
                // SAFETY: the block's window overlaps the row, or it had no cell in common with it,
                // and windows that overlap a row lie in memory, in this row and in the next
                // (`SliceStack::voxels`), which `Row` makes sure of being there.
                let (upper, lower) = unsafe {
                    let at = voxels.as_ptr().add(at);
                    (_mm512_loadu_epi16(at), _mm512_loadu_epi16(at.add(stride)))
                };
                let columns = &block.columns[n];
                // SAFETY: places and weights are 64 bytes each.
                let (places, weights) = unsafe {
                    (
                        _mm512_loadu_epi16(columns.places.as_ptr().cast()),
                        _mm512_loadu_epi16(columns.weights.as_ptr().cast()),
                    )
                };
                let weight = _mm512_set1_epi16(row.weight[n]);
                let part = _mm512_mulhrs_epi16(_mm512_sub_epi16(lower, upper), weight);
                let between = _mm512_add_epi16(upper, part);
                let pairs = _mm512_permutexvar_epi16(places, between);
                group = _mm512_dpwssd_epi32(group, pairs, weights);
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

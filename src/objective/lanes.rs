//! Eight `f64` at a time, on each level of vector instructions.

use crate::simd::SimdLevel;

/// Eight `f64` in registers. Every operation rounds as IEEE 754 says, so all implementations give
/// the same bits.
pub(super) trait Lanes: Copy {
    /// Zeros.
    fn zero() -> Self;
    /// Eight stored values.
    fn load(from: &Chunk) -> Self;
    /// Eight `f32`, exactly.
    fn widen(from: &[f32; 8]) -> Self;
    /// Stores the eight values.
    fn store(self, to: &mut Chunk);
    /// Sums.
    fn plus(self, other: Self) -> Self;
    /// Products.
    fn times(self, other: Self) -> Self;
    /// The values from place `COUNT` (1, 2 or 4) on, then the first of `next`.
    fn shifted<const COUNT: usize>(self, next: Self) -> Self;
}

/// Eight `f64` in memory, in one cache line.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct Chunk(pub [f64; 8]);

/// The values of chunks as one slice.
#[inline(always)]
pub(super) fn values(chunks: &[Chunk]) -> &[f64] {
    // SAFETY: a chunk is eight f64 without padding (64 bytes, aligned to 64), so the values of
    // neighbouring chunks follow each other.
    unsafe { std::slice::from_raw_parts(chunks.as_ptr().cast(), 8 * chunks.len()) }
}

/// The values of chunks as one slice that can be written.
#[inline(always)]
pub(super) fn values_mut(chunks: &mut [Chunk]) -> &mut [f64] {
    // SAFETY: as in `values`; the borrow of the chunks is exclusive and passes to the slice.
    unsafe { std::slice::from_raw_parts_mut(chunks.as_mut_ptr().cast(), 8 * chunks.len()) }
}

/// Work that is compiled for each level.
pub(super) trait LanesWork {
    type Output;

    /// Does the work; to be `#[inline(always)]`, as all that it calls in its loops.
    fn run<L: Lanes>(self) -> Self::Output;
}

/// Does the work with the vector instructions of `level`.
///
/// # Panics
/// When the processor lacks the level.
pub(super) fn with_lanes<W: LanesWork>(level: SimdLevel, work: W) -> W::Output {
    assert!(
        level <= SimdLevel::detect(),
        "this processor lacks the vector level {}",
        level.name()
    );
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma")]
        fn avx2<W: LanesWork>(work: W) -> W::Output {
            work.run::<x86::Avx2Lanes>()
        }
        #[target_feature(enable = "avx2,fma,avx512f,avx512bw,avx512dq,avx512vl")]
        fn avx512<W: LanesWork>(work: W) -> W::Output {
            work.run::<x86::Avx512Lanes>()
        }
        match level {
            SimdLevel::Portable => {}
            // SAFETY: the processor has the level, as asserted above.
            SimdLevel::Avx2 => return unsafe { avx2(work) },
            // SAFETY: the processor has the level, as asserted above.
            SimdLevel::Avx512 => return unsafe { avx512(work) },
        }
    }
    work.run::<PlainLanes>()
}

/// Plain Rust.
#[derive(Clone, Copy)]
struct PlainLanes([f64; 8]);

impl Lanes for PlainLanes {
    #[inline(always)]
    fn zero() -> Self {
        Self([0.0; 8])
    }

    #[inline(always)]
    fn load(from: &Chunk) -> Self {
        Self(from.0)
    }

    #[inline(always)]
    fn widen(from: &[f32; 8]) -> Self {
        Self(from.map(f64::from))
    }

    #[inline(always)]
    fn store(self, to: &mut Chunk) {
        to.0 = self.0;
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * other.0[i]))
    }

    #[inline(always)]
    fn shifted<const COUNT: usize>(self, next: Self) -> Self {
        Self(std::array::from_fn(|i| {
            if i + COUNT < 8 {
                self.0[i + COUNT]
            } else {
                next.0[i + COUNT - 8]
            }
        }))
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    //! The types of this module are only made by `with_lanes`, on processors that have the
    //! instructions, and their methods are inlined into functions that enable them.

    use super::{Chunk, Lanes};
    use std::arch::x86_64::*;

    #[derive(Clone, Copy)]
    pub struct Avx512Lanes(__m512d);

    impl Lanes for Avx512Lanes {
        #[inline(always)]
        fn zero() -> Self {
            // SAFETY: the processor has AVX-512 F (module comment).
            Self(unsafe { _mm512_setzero_pd() })
        }

        #[inline(always)]
        fn load(from: &Chunk) -> Self {
            // SAFETY: the processor has AVX-512 F; a chunk is 64 readable bytes, aligned to 64.
            Self(unsafe { _mm512_load_pd(from.0.as_ptr()) })
        }

        #[inline(always)]
        fn widen(from: &[f32; 8]) -> Self {
            // SAFETY: the processor has AVX-512 F; eight f32 are 32 readable bytes.
            Self(unsafe { _mm512_cvtps_pd(_mm256_loadu_ps(from.as_ptr())) })
        }

        #[inline(always)]
        fn store(self, to: &mut Chunk) {
            // SAFETY: the processor has AVX-512 F; a chunk is 64 writable bytes, aligned to 64.
            unsafe { _mm512_store_pd(to.0.as_mut_ptr(), self.0) }
        }

        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            // SAFETY: the processor has AVX-512 F.
            Self(unsafe { _mm512_add_pd(self.0, other.0) })
        }

        #[inline(always)]
        fn times(self, other: Self) -> Self {
            // SAFETY: the processor has AVX-512 F.
            Self(unsafe { _mm512_mul_pd(self.0, other.0) })
        }

        #[inline(always)]
        fn shifted<const COUNT: usize>(self, next: Self) -> Self {
            // SAFETY: the processor has AVX-512 F; the casts keep all bits.
            unsafe {
                let (a, b) = (_mm512_castpd_si512(self.0), _mm512_castpd_si512(next.0));
                Self(_mm512_castsi512_pd(match COUNT {
                    1 => _mm512_alignr_epi64::<1>(b, a),
                    2 => _mm512_alignr_epi64::<2>(b, a),
                    4 => _mm512_alignr_epi64::<4>(b, a),
                    _ => unreachable!("shifts are by 1, 2 or 4"),
                }))
            }
        }
    }

    #[derive(Clone, Copy)]
    pub struct Avx2Lanes(__m256d, __m256d);

    impl Lanes for Avx2Lanes {
        #[inline(always)]
        fn zero() -> Self {
            // SAFETY: the processor has AVX2 (module comment).
            unsafe { Self(_mm256_setzero_pd(), _mm256_setzero_pd()) }
        }

        #[inline(always)]
        fn load(from: &Chunk) -> Self {
            let p = from.0.as_ptr();
            // SAFETY: the processor has AVX2; a chunk is 64 readable bytes, aligned to 64.
            unsafe { Self(_mm256_load_pd(p), _mm256_load_pd(p.add(4))) }
        }

        #[inline(always)]
        fn widen(from: &[f32; 8]) -> Self {
            let p = from.as_ptr();
            // SAFETY: the processor has AVX2; eight f32 are 32 readable bytes.
            unsafe {
                Self(
                    _mm256_cvtps_pd(_mm_loadu_ps(p)),
                    _mm256_cvtps_pd(_mm_loadu_ps(p.add(4))),
                )
            }
        }

        #[inline(always)]
        fn store(self, to: &mut Chunk) {
            let p = to.0.as_mut_ptr();
            // SAFETY: the processor has AVX2; a chunk is 64 writable bytes, aligned to 64.
            unsafe {
                _mm256_store_pd(p, self.0);
                _mm256_store_pd(p.add(4), self.1);
            }
        }

        #[inline(always)]
        fn plus(self, other: Self) -> Self {
            // SAFETY: the processor has AVX2.
            unsafe {
                Self(
                    _mm256_add_pd(self.0, other.0),
                    _mm256_add_pd(self.1, other.1),
                )
            }
        }

        #[inline(always)]
        fn times(self, other: Self) -> Self {
            // SAFETY: the processor has AVX2.
            unsafe {
                Self(
                    _mm256_mul_pd(self.0, other.0),
                    _mm256_mul_pd(self.1, other.1),
                )
            }
        }

        #[inline(always)]
        fn shifted<const COUNT: usize>(self, next: Self) -> Self {
            /// The last `COUNT`.. of a, then the first of b, of four.
            #[inline(always)]
            fn shift_four<const COUNT: usize>(a: __m256d, b: __m256d) -> __m256d {
                // SAFETY: the processor has AVX2.
                unsafe {
                    let middle = _mm256_permute2f128_pd::<0x21>(a, b);
                    match COUNT {
                        1 => _mm256_shuffle_pd::<0b0101>(a, middle),
                        2 => middle,
                        _ => unreachable!("halves are shifted by 1 or 2"),
                    }
                }
            }
            if COUNT == 4 {
                Self(self.1, next.0)
            } else {
                Self(
                    shift_four::<COUNT>(self.0, self.1),
                    shift_four::<COUNT>(self.1, next.0),
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct EveryOperation;

    impl LanesWork for EveryOperation {
        type Output = Vec<[f64; 8]>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let floats: [f32; 8] = std::array::from_fn(|i| 0.1 + i as f32);
            let chunk = Chunk(std::array::from_fn(|i| 100.0 + (i as f64).sqrt()));
            let (a, b) = (L::widen(&floats), L::load(&chunk));
            [
                L::zero(),
                a,
                b,
                a.plus(b),
                a.times(b),
                a.shifted::<1>(b),
                a.shifted::<2>(b),
                a.shifted::<4>(b),
            ]
            .into_iter()
            .map(|lanes| {
                let mut out = Chunk::default();
                lanes.store(&mut out);
                out.0
            })
            .collect()
        }
    }

    #[test]
    fn every_level_does_the_same() {
        let expected = with_lanes(SimdLevel::Portable, EveryOperation);
        assert_eq!(expected[5][..2], [expected[1][1], expected[1][2]]);
        assert_eq!(expected[7][3..5], [expected[1][7], expected[2][0]]);
        for level in SimdLevel::available() {
            assert_eq!(with_lanes(level, EveryOperation), expected, "{level:?}");
        }
    }
}

//! Which vector instructions the hot loops use.

use serde::{Deserialize, Serialize};
use std::sync::OnceLock;
use thiserror::Error;

/// A level of vector instructions. Results may differ between levels in the last digits, never
/// within one: a study stores its level and keeps it (DESIGN section 4, point 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SimdLevel {
    /// Plain Rust, any processor.
    Portable,
    /// x86-64 with AVX2 and FMA.
    Avx2,
    /// x86-64 with AVX-512 F, BW, DQ, VL and VNNI.
    Avx512,
}

/// The vector instructions of this processor that decide on its level.
pub fn flags() -> Vec<String> {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as has;
        let all = [
            ("avx2", has!("avx2")),
            ("fma", has!("fma")),
            ("avx512f", has!("avx512f")),
            ("avx512bw", has!("avx512bw")),
            ("avx512dq", has!("avx512dq")),
            ("avx512vl", has!("avx512vl")),
            ("avx512vnni", has!("avx512vnni")),
        ];
        let there = all.into_iter().filter(|(_, there)| *there);
        there.map(|(name, _)| name.to_owned()).collect()
    }
    #[cfg(not(target_arch = "x86_64"))]
    Vec::new()
}

/// A level could not be selected.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum SimdError {
    #[error(
        "the vector level `{wanted}` needs instructions that this processor lacks (it has \
         `{available}`): use a node that has them, or a study of its own with `{available}`"
    )]
    Unavailable {
        wanted: &'static str,
        available: &'static str,
    },
    #[error(
        "the vector level is already `{current}` in this process and cannot become `{wanted}`: \
         select it before the first volume is prepared"
    )]
    Fixed {
        wanted: &'static str,
        current: &'static str,
    },
}

static CURRENT: OnceLock<SimdLevel> = OnceLock::new();

impl SimdLevel {
    /// All levels, the plainest first.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The level itself.
    ///
    /// # Panics
    /// When this processor lacks it.
    pub fn expect_here(self) -> Self {
        let highest = Self::detect();
        assert!(self <= highest, "this processor lacks {}", self.name());
        self
    }

    /// The highest level of this processor.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            use std::arch::is_x86_feature_detected as has;
            if has!("avx512f")
                && has!("avx512bw")
                && has!("avx512dq")
                && has!("avx512vl")
                && has!("avx512vnni")
                && has!("avx2")
                && has!("fma")
            {
                return Self::Avx512;
            }
            if has!("avx2") && has!("fma") {
                return Self::Avx2;
            }
        }
        Self::Portable
    }

    /// The levels that this processor can run, the plainest first.
    pub fn available() -> impl Iterator<Item = Self> {
        let highest = Self::detect();
        Self::ALL.into_iter().filter(move |&level| level <= highest)
    }

    /// Fixes the level of this process, before anything has asked for it. Selecting the level that
    /// already holds is no error.
    ///
    /// # Errors
    /// When the processor lacks the instructions, or another level is already in use.
    pub fn select(level: Self) -> Result<(), SimdError> {
        if level > Self::detect() {
            return Err(SimdError::Unavailable {
                wanted: level.name(),
                available: Self::detect().name(),
            });
        }
        let current = *CURRENT.get_or_init(|| level);
        if current == level {
            Ok(())
        } else {
            Err(SimdError::Fixed {
                wanted: level.name(),
                current: current.name(),
            })
        }
    }

    /// The level of this process: the selected one, or else the highest of the processor, from the
    /// first call on.
    pub fn current() -> Self {
        *CURRENT.get_or_init(Self::detect)
    }

    /// `portable`, `avx2` or `avx512`, as in configurations.
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }
}

/// Compiles the plain loops of an `#[inline(always)]` function once for each [`SimdLevel`] and
/// calls the one asked for:
///
/// `for_simd_level! { fn row_sums(image: &Image, sums: &mut [f64]) = row_sums_loops; }` makes
/// `fn row_sums(level: SimdLevel, image: &Image, sums: &mut [f64])`. One const parameter may
/// follow the name.
///
/// The compiler neither contracts nor reorders floating-point operations, so loops without
/// explicit FMA give the same bits at every level.
///
/// The function made panics when the processor lacks the level.
macro_rules! for_simd_level {
    ($(#[$attribute:meta])* $visibility:vis fn $name:ident $(<const $constant:ident: $kind:ty>)? (
        $($argument:ident: $type:ty),* $(,)?
    ) $(-> $result:ty)? = $loops:ident;) => {
        $(#[$attribute])*
        $visibility fn $name $(<const $constant: $kind>)? (
            level: $crate::simd::SimdLevel,
            $($argument: $type),*
        ) $(-> $result)? {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            fn avx2 $(<const $constant: $kind>)? ($($argument: $type),*) $(-> $result)? {
                $loops $(::<$constant>)? ($($argument),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(
                enable = "avx2,fma,avx512f,avx512bw,avx512dq,avx512vl"
            )]
            fn avx512 $(<const $constant: $kind>)? ($($argument: $type),*) $(-> $result)? {
                $loops $(::<$constant>)? ($($argument),*)
            }
            assert!(
                level <= $crate::simd::SimdLevel::detect(),
                "this processor lacks the vector level {}",
                level.name()
            );
            match level {
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the processor has the level, as asserted above.
                $crate::simd::SimdLevel::Avx2 => unsafe {
                    avx2 $(::<$constant>)? ($($argument),*)
                },
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the processor has the level, as asserted above.
                $crate::simd::SimdLevel::Avx512 => unsafe {
                    avx512 $(::<$constant>)? ($($argument),*)
                },
                _ => $loops $(::<$constant>)? ($($argument),*),
            }
        }
    };
}
pub(crate) use for_simd_level;

#[cfg(test)]
mod tests {
    use super::*;

    #[inline(always)]
    fn double_loops(values: &mut [f32]) {
        for value in values {
            *value *= 2.0;
        }
    }

    for_simd_level! {
        fn double(values: &mut [f32]) = double_loops;
    }

    #[test]
    fn every_available_level_runs() {
        for level in SimdLevel::available() {
            let mut values: Vec<f32> = (0..37).map(|i| i as f32).collect();
            double(level, &mut values);
            assert!(values.iter().enumerate().all(|(i, &v)| v == 2.0 * i as f32));
        }
    }

    #[test]
    fn the_selected_level_stays() {
        let current = SimdLevel::current();
        assert_eq!(SimdLevel::select(current), Ok(()));
        for other in SimdLevel::ALL.into_iter().filter(|&l| l != current) {
            assert!(SimdLevel::select(other).is_err(), "{}", other.name());
        }
        assert_eq!(SimdLevel::current(), current);
    }
}

//! Which vector instructions the hot loops use.

use serde::{Deserialize, Serialize};

/// A set of vector instructions. A study resolves its level once, stores it, and refuses a node
/// that lacks it (DESIGN section 4.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SimdLevel {
    /// What every processor of the target has.
    Portable,
    /// AVX2 and FMA (x86-64-v3).
    Avx2,
    /// AVX-512 F, BW, CD, DQ and VL (x86-64-v4).
    Avx512,
}

impl SimdLevel {
    /// All levels, lowest first.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The highest level that this processor has.
    pub fn best() -> Self {
        Self::ALL
            .into_iter()
            .rfind(|level| level.is_available())
            .unwrap_or(Self::Portable)
    }

    /// True when this processor has the level.
    #[inline]
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512cd")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
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
            #[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
            fn avx2 $(<const $constant: $kind>)? ($($argument: $type),*) $(-> $result)? {
                $loops $(::<$constant>)? ($($argument),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(
                enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512bw,avx512cd,avx512dq,avx512vl"
            )]
            fn avx512 $(<const $constant: $kind>)? ($($argument: $type),*) $(-> $result)? {
                $loops $(::<$constant>)? ($($argument),*)
            }
            assert!(
                level.is_available(),
                "this processor lacks the vector instructions of level {level:?}"
            );
            match level {
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the processor has the level, as asserted above; every processor with
                // AVX2 has the bit-manipulation instructions.
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
        for level in SimdLevel::ALL.into_iter().filter(|l| l.is_available()) {
            let mut values: Vec<f32> = (0..37).map(|i| i as f32).collect();
            double(level, &mut values);
            assert!(values.iter().enumerate().all(|(i, &v)| v == 2.0 * i as f32));
        }
        assert!(SimdLevel::best().is_available());
    }

    #[test]
    fn a_level_is_written_in_small_letters() {
        assert_eq!(
            serde_json::to_string(&SimdLevel::Avx512).unwrap(),
            "\"avx512\""
        );
    }
}

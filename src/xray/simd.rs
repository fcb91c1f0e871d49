//! Which vector instructions the kernels use.

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

#[cfg(test)]
mod tests {
    use super::*;

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

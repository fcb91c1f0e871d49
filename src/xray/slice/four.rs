//! Four `f32` at a time. Every x86-64 processor has the instructions, so there is one level only.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::*;

/// Four `f32` in a register.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy)]
pub(super) struct Four(__m128);

#[cfg(target_arch = "x86_64")]
impl Four {
    #[inline(always)]
    pub fn load(from: &[f32; 4]) -> Self {
        // SAFETY: four f32 are 16 readable bytes.
        Self(unsafe { _mm_loadu_ps(from.as_ptr()) })
    }

    #[inline(always)]
    pub fn all(value: f32) -> Self {
        // SAFETY: SSE is part of x86-64.
        Self(unsafe { _mm_set1_ps(value) })
    }

    #[inline(always)]
    pub fn store(self, to: &mut [f32; 4]) {
        // SAFETY: four f32 are 16 writable bytes.
        unsafe { _mm_storeu_ps(to.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        // SAFETY: SSE is part of x86-64.
        Self(unsafe { _mm_add_ps(self.0, other.0) })
    }

    #[inline(always)]
    pub fn times(self, other: Self) -> Self {
        // SAFETY: SSE is part of x86-64.
        Self(unsafe { _mm_mul_ps(self.0, other.0) })
    }

    /// Columns of the matrix with these rows.
    #[inline(always)]
    pub fn transposed([a, b, c, d]: [Self; 4]) -> [Self; 4] {
        // SAFETY: SSE is part of x86-64.
        unsafe {
            let (low_ab, high_ab) = (_mm_unpacklo_ps(a.0, b.0), _mm_unpackhi_ps(a.0, b.0));
            let (low_cd, high_cd) = (_mm_unpacklo_ps(c.0, d.0), _mm_unpackhi_ps(c.0, d.0));
            [
                Self(_mm_movelh_ps(low_ab, low_cd)),
                Self(_mm_movehl_ps(low_cd, low_ab)),
                Self(_mm_movelh_ps(high_ab, high_cd)),
                Self(_mm_movehl_ps(high_cd, high_ab)),
            ]
        }
    }
}

/// Four `f32`.
#[cfg(not(target_arch = "x86_64"))]
#[derive(Clone, Copy)]
pub(super) struct Four([f32; 4]);

#[cfg(not(target_arch = "x86_64"))]
impl Four {
    #[inline(always)]
    pub fn load(from: &[f32; 4]) -> Self {
        Self(*from)
    }

    #[inline(always)]
    pub fn all(value: f32) -> Self {
        Self([value; 4])
    }

    #[inline(always)]
    pub fn store(self, to: &mut [f32; 4]) {
        *to = self.0;
    }

    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }

    #[inline(always)]
    pub fn times(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * other.0[i]))
    }

    /// Columns of the matrix with these rows.
    #[inline(always)]
    pub fn transposed(rows: [Self; 4]) -> [Self; 4] {
        std::array::from_fn(|column| Self(std::array::from_fn(|row| rows[row].0[column])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_are_those_of_four_numbers() {
        let rows: [[f32; 4]; 4] =
            std::array::from_fn(|r| std::array::from_fn(|c| (10 * r + c) as f32));
        let columns = Four::transposed(rows.each_ref().map(Four::load));
        for (c, column) in columns.into_iter().enumerate() {
            let mut got = [0.0; 4];
            column.times(Four::all(2.0)).plus(column).store(&mut got);
            assert_eq!(got, std::array::from_fn(|r| 3.0 * rows[r][c]));
        }
    }
}

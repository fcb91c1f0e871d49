//! Textures: smooth random fields that depend on place and seed alone, so that any thread may
//! evaluate any voxel.

use crate::geometry::Point;
use crate::random::Stream;
use rand::Rng;

/// Random values on a lattice, interpolated smoothly; mean 0, values in [-1, 1].
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    seed: u64,
}

/// SplitMix64's finalizer: every input bit changes every output bit.
#[inline]
fn scrambled(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// `f64::floor`, which is a call into the maths library on processors that are not asked for by name.
#[inline]
fn floor(x: f64) -> i64 {
    let i = x as i64;
    i - i64::from((i as f64) > x)
}

impl Noise {
    pub fn new(stream: &mut Stream) -> Self {
        Self {
            seed: stream.next_u64(),
        }
    }

    #[inline]
    fn lattice(&self, i: i64, j: i64, k: i64) -> f64 {
        let key = (i as u64)
            .wrapping_mul(0x9e37_79b9_7f4a_7c15)
            .wrapping_add((j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f))
            .wrapping_add((k as u64).wrapping_mul(0x1656_67b1_9e37_79f9));
        (scrambled(key ^ self.seed) >> 11) as f64 * (2.0 / (1u64 << 53) as f64) - 1.0
    }

    /// The field at `p`, with lattice cells of `size_mm`.
    #[inline]
    pub fn at(&self, p: &Point, size_mm: f64) -> f64 {
        self.stretched(p, [size_mm; 3])
    }

    /// The field with lattice cells of another size along each axis.
    #[inline]
    pub fn stretched(&self, p: &Point, size_mm: [f64; 3]) -> f64 {
        let q: [f64; 3] = std::array::from_fn(|a| p[a] / size_mm[a]);
        let base = q.map(floor);
        let f: [f64; 3] = std::array::from_fn(|a| {
            let t = q[a] - base[a] as f64;
            t * t * (3.0 - 2.0 * t)
        });
        let [i, j, k] = base;
        let mut sum = 0.0;
        for dk in 0..2 {
            for dj in 0..2 {
                let wy = if dj == 0 { 1.0 - f[1] } else { f[1] };
                let wz = if dk == 0 { 1.0 - f[2] } else { f[2] };
                let a = self.lattice(i, j + dj, k + dk);
                let b = self.lattice(i + 1, j + dj, k + dk);
                sum += wy * wz * (a + (b - a) * f[0]);
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

    #[test]
    fn the_field_is_centered_smooth_and_seeded() {
        let mut s = stream(1, Purpose::PhantomTexture, "test");
        let (a, b) = (Noise::new(&mut s), Noise::new(&mut s));
        let (mut sum, mut squares, mut jump, mut differs) = (0.0, 0.0, 0.0f64, false);
        for n in 0..20_000 {
            let t = f64::from(n) * 0.37;
            let p = Point::new(t, 2.1 * t, -0.7 * t);
            let v = a.at(&p, 5.0);
            sum += v;
            squares += v * v;
            let near = a.at(&(p + crate::geometry::Vector::new(0.01, 0.0, 0.0)), 5.0);
            jump = jump.max((near - v).abs());
            differs |= v != b.at(&p, 5.0);
        }
        assert!((sum / 20_000.0).abs() < 0.02, "mean {}", sum / 20_000.0);
        assert!((0.02..0.2).contains(&(squares / 20_000.0)));
        assert!(jump < 0.01, "largest step {jump}");
        assert!(differs);
    }
}

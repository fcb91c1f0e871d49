//! Tails of the standard normal distribution, also where they underflow.

use statrs::distribution::{ContinuousCDF, Normal};
use std::f64::consts::{LN_10, PI};

/// From here on the continued fraction of the tail converges to rounding within its 80 steps;
/// below, the series does.
const FAR_TAIL: f64 = 2.0;

/// P(Z > z). (statrs' `erfc` has ten digits, and none where the tail is small.)
pub fn upper_tail(z: f64) -> f64 {
    if z >= FAR_TAIL {
        ln_far_tail(z).exp()
    } else if z <= -FAR_TAIL {
        1.0 - ln_far_tail(-z).exp()
    } else {
        0.5 - central(z)
    }
}

/// log10 P(Z > z), finite for every finite z.
pub fn log10_upper_tail(z: f64) -> f64 {
    if z >= FAR_TAIL {
        ln_far_tail(z) / LN_10
    } else if z <= -FAR_TAIL {
        (-ln_far_tail(-z).exp()).ln_1p() / LN_10
    } else {
        upper_tail(z).log10()
    }
}

/// ln P(Z > z) by P(Z > z) = phi(z) / (z + 1/(z + 2/(z + 3/(z + ...)))) (Laplace).
fn ln_far_tail(z: f64) -> f64 {
    let denominator = (1..=80).rev().fold(z, |rest, k| z + f64::from(k) / rest);
    -0.5 * z * z - 0.5 * (2.0 * PI).ln() - denominator.ln()
}

/// P(0 < Z < z), negative for z < 0, by phi(z) (z + z^3/3 + z^5/(3 5) + ...).
fn central(z: f64) -> f64 {
    let (mut term, mut sum) = (z, z);
    for k in 1..60 {
        term *= z * z / f64::from(2 * k + 1);
        sum += term;
    }
    sum * (-0.5 * z * z).exp() / (2.0 * PI).sqrt()
}

/// P(Z <= z).
pub fn lower_tail(z: f64) -> f64 {
    upper_tail(-z)
}

/// The z with P(Z <= z) = `p`; -inf and +inf at 0 and 1.
///
/// # Panics
/// When `p` lies outside [0, 1].
pub fn quantile(p: f64) -> f64 {
    Normal::standard().inverse_cdf(p)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of mpmath: `mp.log10(mp.erfc(z / mp.sqrt(2)) / 2)`, 30 digits.
    #[test]
    fn tails_agree_with_high_precision() {
        for (z, expected) in REFERENCE {
            let found = log10_upper_tail(z);
            assert!(
                (found - expected).abs() < 1e-13 * expected.abs().max(0.01),
                "z {z}: {found} against {expected}"
            );
        }
    }

    const REFERENCE: [(f64, f64); 7] = [
        (-3.0, -0.000_586_649_313_790_066_7),
        (0.0, -std::f64::consts::LOG10_2),
        (1.5, -1.175_176_721_614_816),
        (5.999, -9.003_189_944_402_542),
        (6.0, -9.005_864_327_476_704),
        (12.5, -35.427_992_702_181_03),
        (150.0, -4_888.388_121_904_651),
    ];

    #[test]
    fn both_branches_meet() {
        for z in [FAR_TAIL, -FAR_TAIL] {
            let (below, above) = (upper_tail(z.next_down()), upper_tail(z.next_up()));
            assert!((below / above - 1.0).abs() < 1e-13, "{below} {above}");
        }
    }

    #[test]
    fn the_quantile_inverts_the_tail() {
        for p in [0.001, 0.025, 0.3, 0.5, 0.975] {
            assert!((lower_tail(quantile(p)) - p).abs() < 1e-9);
        }
    }
}

//! Mean, standard deviation, quantiles and shares under a threshold.

use super::{StatisticsError, check};
use serde::Serialize;

/// What a table prints of one sample; every field has the sample's unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Number of values.
    pub n: usize,
    pub mean: f64,
    /// Sample standard deviation (divisor n - 1); 0 for a single value.
    pub sd: f64,
    pub min: f64,
    /// 25th percentile.
    pub q25: f64,
    pub median: f64,
    /// 75th percentile.
    pub q75: f64,
    /// 95th percentile.
    pub q95: f64,
    pub max: f64,
}

impl Summary {
    /// Summarizes `values`, in any order. Sums run in the given order, so equal input gives equal
    /// bits.
    ///
    /// # Errors
    /// When there is no value, or one is not finite.
    pub fn of(values: &[f64]) -> Result<Self, StatisticsError> {
        check("summarized", values)?;
        let n = values.len();
        let mean = values.iter().sum::<f64>() / n as f64;
        // The second sum corrects the rounding of the mean (two-pass algorithm).
        let (squares, rest) = values.iter().fold((0.0, 0.0), |(squares, rest), value| {
            let d = value - mean;
            (squares + d * d, rest + d)
        });
        let variance = if n > 1 {
            ((squares - rest * rest / n as f64) / (n - 1) as f64).max(0.0)
        } else {
            0.0
        };
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        Ok(Self {
            n,
            mean,
            sd: variance.sqrt(),
            min: sorted[0],
            q25: quantile(&sorted, 0.25),
            median: quantile(&sorted, 0.5),
            q75: quantile(&sorted, 0.75),
            q95: quantile(&sorted, 0.95),
            max: sorted[n - 1],
        })
    }
}

/// The `p`-quantile of ascending values, linear between neighbours (Hyndman and Fan's type 7, the
/// default of R and NumPy).
///
/// # Panics
/// When `sorted` is empty or `p` lies outside [0, 1].
pub fn quantile(sorted: &[f64], p: f64) -> f64 {
    assert!((0.0..=1.0).contains(&p), "a quantile's p is {p}");
    let position = p * (sorted.len() - 1) as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    let fraction = position - below as f64;
    sorted[below] + (sorted[above] - sorted[below]) * fraction
}

/// The share of `values` strictly under `threshold`, in [0, 1].
///
/// # Errors
/// When there is no value, or one is not finite.
pub fn share_below(values: &[f64], threshold: f64) -> Result<f64, StatisticsError> {
    check("counted", values)?;
    let below = values.iter().filter(|&&value| value < threshold).count();
    Ok(below as f64 / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_sample() {
        // R: x <- c(3, 1, 4, 1, 5, 9, 2, 6); mean, sd, quantile
        let s = Summary::of(&[3.0, 1.0, 4.0, 1.0, 5.0, 9.0, 2.0, 6.0]).unwrap();
        assert_eq!((s.n, s.min, s.max), (8, 1.0, 9.0));
        assert!((s.mean - 3.875).abs() < 1e-15);
        assert!((s.sd - 2.748_376_143_938_713).abs() < 1e-14);
        assert_eq!((s.q25, s.median, s.q75), (1.75, 3.5, 5.25));
    }

    #[test]
    fn a_large_offset_keeps_the_deviation() {
        let values: Vec<f64> = (0..10).map(|i| 1e9 + f64::from(i % 2)).collect();
        let sd = Summary::of(&values).unwrap().sd;
        assert!((sd - (10.0f64 * 0.25 / 9.0).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn shares_count_strictly() {
        assert_eq!(share_below(&[1.0, 2.0, 3.0, 4.0], 3.0), Ok(0.5));
        assert_eq!(
            share_below(&[], 3.0),
            Err(StatisticsError::Empty("counted"))
        );
    }

    #[test]
    fn one_value_has_no_deviation_and_nan_is_refused() {
        assert_eq!(Summary::of(&[2.0]).unwrap().sd, 0.0);
        let message = Summary::of(&[1.0, f64::NAN]).unwrap_err().to_string();
        assert!(
            message.contains("value 1 of the summarized sample is NaN"),
            "{message}"
        );
    }
}

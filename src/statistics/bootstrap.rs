//! Bootstrap intervals of the median (Efron and Tibshirani 1993, chapters 13 and 14).

use super::{StatisticsError, check, normal, quantile};
use crate::random::{Purpose, stream};
use rand::RngExt;

/// How the bootstrap distribution becomes an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IntervalKind {
    /// Its quantiles.
    Percentile,
    /// Bias-corrected and accelerated: its quantiles at shifted levels.
    Bca,
}

/// An interval of a statistic, in the sample's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

/// The `level` (0.95, say) confidence interval of the median of `values` by `resamples` bootstrap
/// resamples.
///
/// `clusters` gives each value's group: whole groups are drawn, because registrations of one case
/// share its images and are no independent observations. With one group per value this is the
/// ordinary bootstrap. Draws depend on `seed` and `key` (the statistic's name) alone.
///
/// # Errors
/// When there is no value, one is not finite, or `level` or `resamples` is out of range.
///
/// # Panics
/// When `clusters` and `values` differ in length.
pub fn median_interval(
    values: &[f64],
    clusters: &[usize],
    level: f64,
    resamples: usize,
    kind: IntervalKind,
    (seed, key): (u64, &str),
) -> Result<Interval, StatisticsError> {
    check("resampled", values)?;
    assert_eq!(values.len(), clusters.len(), "each value has a group");
    if !(level > 0.0 && level < 1.0) {
        return Err(StatisticsError::OutOfRange {
            field: "level",
            value: level,
            expected: "a number between 0 and 1",
        });
    }
    if resamples < 100 {
        return Err(StatisticsError::OutOfRange {
            field: "resamples",
            value: resamples as f64,
            expected: "100 or more",
        });
    }
    let groups = grouped(values, clusters);
    let mut stream = stream(seed, Purpose::Bootstrap, key);
    let mut drawn = Vec::with_capacity(values.len());
    let mut medians: Vec<f64> = (0..resamples)
        .map(|_| {
            drawn.clear();
            for _ in 0..groups.len() {
                drawn.extend_from_slice(&groups[stream.random_range(0..groups.len())]);
            }
            median(&mut drawn)
        })
        .collect();
    medians.sort_by(f64::total_cmp);
    let tail = (1.0 - level) / 2.0;
    let levels = match kind {
        IntervalKind::Percentile => [tail, 1.0 - tail],
        IntervalKind::Bca => {
            let estimate = median(&mut values.to_vec());
            let bias = bias(&medians, estimate);
            let acceleration = acceleration(&groups);
            [tail, 1.0 - tail].map(|p| {
                let z = bias + normal::quantile(p);
                normal::lower_tail(bias + z / (1.0 - acceleration * z))
            })
        }
    };
    Ok(Interval {
        low: quantile(&medians, levels[0]),
        high: quantile(&medians, levels[1]),
    })
}

/// The values of each group, groups in the order in which they first appear.
fn grouped(values: &[f64], clusters: &[usize]) -> Vec<Vec<f64>> {
    let mut places = std::collections::HashMap::new();
    let mut groups: Vec<Vec<f64>> = Vec::new();
    for (&value, cluster) in values.iter().zip(clusters) {
        let place = *places.entry(cluster).or_insert_with(|| {
            groups.push(Vec::new());
            groups.len() - 1
        });
        groups[place].push(value);
    }
    groups
}

/// The median; reorders the values.
fn median(values: &mut [f64]) -> f64 {
    let n = values.len();
    let (below, &mut middle, _) = values.select_nth_unstable_by(n / 2, f64::total_cmp);
    if n % 2 == 1 {
        return middle;
    }
    let lower = below.iter().copied().max_by(f64::total_cmp);
    // An even number of values has at least one below the upper middle one.
    (lower.expect("two or more values") + middle) / 2.0
}

/// z0: the normal quantile of the share of resamples under the estimate, ties counted one half and
/// the share kept off 0 and 1 by half a resample.
fn bias(sorted_medians: &[f64], estimate: f64) -> f64 {
    let n = sorted_medians.len() as f64;
    let below = sorted_medians.partition_point(|&m| m < estimate) as f64;
    let up_to = sorted_medians.partition_point(|&m| m <= estimate) as f64;
    normal::quantile(((below + up_to) / 2.0).clamp(0.5, n - 0.5) / n)
}

/// a: one sixth of the skewness of the leave-one-group-out medians; 0 where they are all equal.
fn acceleration(groups: &[Vec<f64>]) -> f64 {
    let left_out: Vec<f64> = LeaveOneOut::new(groups).medians();
    if left_out.is_empty() {
        return 0.0;
    }
    let mean = left_out.iter().sum::<f64>() / left_out.len() as f64;
    let (squares, cubes) = left_out.iter().fold((0.0, 0.0), |(s, c), m| {
        let d = mean - m;
        (s + d * d, c + d * d * d)
    });
    if squares > 0.0 {
        cubes / (6.0 * squares.powf(1.5))
    } else {
        0.0
    }
}

/// Medians of all values but one group's, without copying the sample for each of them.
struct LeaveOneOut<'a> {
    groups: &'a [Vec<f64>],
    sorted: Vec<f64>,
}

impl<'a> LeaveOneOut<'a> {
    fn new(groups: &'a [Vec<f64>]) -> Self {
        let mut sorted = groups.concat();
        sorted.sort_by(f64::total_cmp);
        Self { groups, sorted }
    }

    /// One median per group; empty where there is one group only.
    fn medians(&self) -> Vec<f64> {
        if self.groups.len() < 2 {
            return Vec::new();
        }
        self.groups
            .iter()
            .map(|group| self.without(group))
            .collect()
    }

    fn without(&self, group: &[f64]) -> f64 {
        let mut removed = group.to_vec();
        removed.sort_by(f64::total_cmp);
        let n = self.sorted.len() - removed.len();
        let upper = self.nth_without(n / 2, &removed);
        if n % 2 == 1 {
            upper
        } else {
            (self.nth_without(n / 2 - 1, &removed) + upper) / 2.0
        }
    }

    /// The `k`-th of the sorted values once those of `removed` (sorted) are taken out. Each removed
    /// value at or below the candidate moves it one place up.
    fn nth_without(&self, k: usize, removed: &[f64]) -> f64 {
        let mut gone = 0;
        loop {
            let candidate = self.sorted[k + gone];
            let smaller = self.sorted.partition_point(|&v| v < candidate);
            // Among equal values those removed are counted as the first ones.
            let gone_below = removed.partition_point(|&v| v < candidate);
            let equal_gone = removed.partition_point(|&v| v <= candidate) - gone_below;
            let place = k + gone - smaller;
            let needed = gone_below
                + if place < equal_gone {
                    place + 1
                } else {
                    equal_gone
                };
            if needed <= gone {
                return candidate;
            }
            gone = needed;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn interval(values: &[f64], kind: IntervalKind) -> Interval {
        let own: Vec<usize> = (0..values.len()).collect();
        median_interval(values, &own, 0.95, 2000, kind, (7, "test")).unwrap()
    }

    /// The distribution-free interval of a median by order statistics: for n = 101 and 95 %, the
    /// 41st to the 61st value (binomial quantiles).
    #[test]
    fn agrees_with_the_order_statistics_interval() {
        let values: Vec<f64> = (0..101).map(f64::from).collect();
        for kind in [IntervalKind::Percentile, IntervalKind::Bca] {
            let found = interval(&values, kind);
            assert!((found.low - 40.0).abs() <= 1.5, "{kind:?}: {found:?}");
            assert!((found.high - 60.0).abs() <= 1.5, "{kind:?}: {found:?}");
        }
    }

    #[test]
    fn equal_keys_draw_equally_and_clusters_widen() {
        let values: Vec<f64> = (0..100).map(|i| f64::from(i / 10)).collect();
        assert_eq!(
            interval(&values, IntervalKind::Bca),
            interval(&values, IntervalKind::Bca)
        );
        let clusters: Vec<usize> = (0..100).map(|i| i / 10).collect();
        let wide = median_interval(
            &values,
            &clusters,
            0.95,
            2000,
            IntervalKind::Percentile,
            (7, "test"),
        )
        .unwrap();
        let narrow = interval(&values, IntervalKind::Percentile);
        assert!(
            wide.high - wide.low > narrow.high - narrow.low,
            "{wide:?} {narrow:?}"
        );
    }

    #[test]
    fn ranges_are_refused() {
        let too_few = median_interval(&[1.0], &[0], 0.95, 10, IntervalKind::Bca, (1, "k"));
        assert_eq!(
            too_few.unwrap_err().to_string(),
            "resamples is 10, expected 100 or more"
        );
        assert!(median_interval(&[1.0], &[0], 1.0, 100, IntervalKind::Bca, (1, "k")).is_err());
        let one = median_interval(&[3.0], &[0], 0.9, 100, IntervalKind::Bca, (1, "k")).unwrap();
        assert_eq!(
            one,
            Interval {
                low: 3.0,
                high: 3.0
            }
        );
    }

    proptest! {
        #[test]
        fn leaving_out_is_removing(groups in prop::collection::vec(prop::collection::vec(0u8..6, 1..5), 2..8)) {
            let groups: Vec<Vec<f64>> = groups.into_iter()
                .map(|g| g.into_iter().map(f64::from).collect()).collect();
            let found = LeaveOneOut::new(&groups).medians();
            for (skipped, found) in found.into_iter().enumerate() {
                let mut rest: Vec<f64> = groups.iter().enumerate()
                    .filter(|(i, _)| *i != skipped)
                    .flat_map(|(_, g)| g.iter().copied()).collect();
                prop_assert_eq!(found, median(&mut rest));
            }
        }
    }
}

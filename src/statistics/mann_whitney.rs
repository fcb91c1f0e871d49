//! The Mann-Whitney U test (Mann and Whitney 1947; the paper's Table II).

use super::{StatisticsError, check, normal};

/// The alternative to "both samples have the same distribution".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alternative {
    /// One-tailed: the second sample tends to larger values (Table II).
    SecondLarger,
    /// One-tailed: the first sample tends to larger values.
    FirstLarger,
    TwoSided,
}

/// How the p value is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Exact where [`Method::Exact`] applies, else asymptotic.
    Automatic,
    /// The permutation distribution, by its generating function. Needs samples without ties, the
    /// smaller one of at most [`EXACT_SMALLER`] values.
    Exact,
    /// The normal approximation with tie correction and continuity correction.
    Asymptotic,
}

/// The exact test is offered up to this size of the smaller sample (as SciPy's automatic choice).
pub const EXACT_SMALLER: usize = 8;
/// and of the larger one: C(10,008, 8) still counts exactly in 128 bits.
pub const EXACT_LARGER: usize = 10_000;

/// Outcome of the test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MannWhitney {
    /// Number of values of the first and of the second sample.
    pub sizes: [usize; 2],
    /// U of each sample: the number of pairs in which its value is the larger one, ties counted
    /// one half. They add up to n1 n2.
    pub u: [f64; 2],
    /// p value in [0, 1]; 0 where it underflows.
    pub p: f64,
    /// log10 of the p value, finite also where `p` underflows.
    pub log10_p: f64,
    /// True when the permutation distribution was used.
    pub exact: bool,
}

impl MannWhitney {
    /// The common-language effect size U2 / (n1 n2): the probability that a value of the second
    /// sample is larger than one of the first, ties counted one half; 0.5 without any effect.
    pub fn effect(&self) -> f64 {
        self.u[1] / (self.sizes[0] as f64 * self.sizes[1] as f64)
    }
}

/// Tests `first` against `second`; their order of values does not matter.
///
/// # Errors
/// When a sample is empty, has a value that is not finite, or the exact method is asked for where
/// it does not apply.
pub fn mann_whitney(
    first: &[f64],
    second: &[f64],
    alternative: Alternative,
    method: Method,
) -> Result<MannWhitney, StatisticsError> {
    check("first", first)?;
    check("second", second)?;
    let (n1, n2) = (first.len(), second.len());
    let ranks = Ranks::of(first, second);
    let u1 = ranks.first_sum - (n1 * (n1 + 1)) as f64 / 2.0;
    let u2 = (n1 * n2) as f64 - u1;
    let (smaller, larger) = (n1.min(n2), n1.max(n2));
    let can_be_exact = ranks.tie_term == 0.0 && smaller <= EXACT_SMALLER && larger <= EXACT_LARGER;
    let exact = match method {
        Method::Automatic => can_be_exact,
        Method::Asymptotic => false,
        Method::Exact if can_be_exact => true,
        Method::Exact => {
            return Err(StatisticsError::NotExact {
                limit: EXACT_SMALLER,
                other_limit: EXACT_LARGER,
                found: if ranks.tie_term > 0.0 {
                    "there are ties".into()
                } else {
                    format!("they have {n1} and {n2}")
                },
            });
        }
    };
    // The U that is large under the alternative.
    let u = match alternative {
        Alternative::SecondLarger => u2,
        Alternative::FirstLarger => u1,
        Alternative::TwoSided => u1.max(u2),
    };
    let tails = if alternative == Alternative::TwoSided {
        2.0f64
    } else {
        1.0
    };
    let (tail, log10_tail) = if exact {
        let tail = exact_upper_tail(u.round() as usize, smaller, larger);
        (tail, tail.log10())
    } else {
        let z = standardized(u, n1, n2, ranks.tie_term);
        (normal::upper_tail(z), normal::log10_upper_tail(z))
    };
    Ok(MannWhitney {
        sizes: [n1, n2],
        u: [u1, u2],
        p: (tail * tails).min(1.0),
        log10_p: (log10_tail + tails.log10()).min(0.0),
        exact,
    })
}

/// What the test needs of the pooled sample's mid-ranks.
struct Ranks {
    /// Sum of the first sample's ranks. Mid-ranks are multiples of one half, so it is exact.
    first_sum: f64,
    /// Sum of t^3 - t over groups of t tied values.
    tie_term: f64,
}

impl Ranks {
    fn of(first: &[f64], second: &[f64]) -> Self {
        let mut pooled: Vec<(f64, bool)> = first
            .iter()
            .map(|&value| (value, true))
            .chain(second.iter().map(|&value| (value, false)))
            // -0 and +0 are one value; `total_cmp` would part them.
            .map(|(value, of_first)| (value + 0.0, of_first))
            .collect();
        pooled.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (mut first_sum, mut tie_term, mut start) = (0.0, 0.0, 0);
        for group in pooled.chunk_by(|a, b| a.0 == b.0) {
            let mid_rank = start as f64 + (group.len() + 1) as f64 / 2.0;
            let members = group.iter().filter(|(_, of_first)| *of_first).count();
            first_sum += mid_rank * members as f64;
            let t = group.len() as f64;
            tie_term += t * t * t - t;
            start += group.len();
        }
        Self {
            first_sum,
            tie_term,
        }
    }
}

/// z of `u` with tie and continuity correction. When all values are equal U has no variance and
/// nothing speaks for the alternative: z = -inf.
fn standardized(u: f64, n1: usize, n2: usize, tie_term: f64) -> f64 {
    let (a, b) = (n1 as f64, n2 as f64);
    let n = a + b;
    let variance = a * b / 12.0 * ((n + 1.0) - tie_term / (n * (n - 1.0)));
    let above_mean = u - a * b / 2.0 - 0.5;
    if variance <= 0.0 {
        f64::NEG_INFINITY
    } else {
        above_mean / variance.sqrt()
    }
}

/// P(U >= u) under the null hypothesis, from the Gaussian binomial coefficient
/// prod_{i=1..m} (1 - q^(n+i)) / (1 - q^i), whose coefficient of q^k counts the orders with U = k.
fn exact_upper_tail(u: usize, m: usize, n: usize) -> f64 {
    let degree = m * n;
    let mut counts = vec![0i128; degree + 1];
    counts[0] = 1;
    for i in 1..=m {
        for k in (n + i..=degree).rev() {
            counts[k] -= counts[k - n - i];
        }
        for k in i..=degree {
            counts[k] += counts[k - i];
        }
    }
    let total: i128 = counts.iter().sum();
    let tail: i128 = counts[u..].iter().sum();
    tail as f64 / total as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn p(first: &[f64], second: &[f64], alternative: Alternative, method: Method) -> f64 {
        mann_whitney(first, second, alternative, method).unwrap().p
    }

    fn near(found: f64, expected: f64) {
        assert!(
            (found / expected - 1.0).abs() < 1e-9,
            "{found:e} against {expected:e}"
        );
    }

    /// Two samples of 18,000 values that any language can make.
    fn portable() -> (Vec<f64>, Vec<f64>) {
        let fractions = |factor: f64| (1..=18_000).map(move |i| (f64::from(i) * factor).fract());
        (
            fractions(0.618_033_988_749_894_9).collect(),
            fractions(std::f64::consts::SQRT_2)
                .map(|v| 1.01 * v)
                .collect(),
        )
    }

    /// Expected values: SciPy 1.17.1, `mannwhitneyu(x, y, alternative, method="asymptotic")`.
    #[test]
    fn agrees_with_scipy_on_a_table_of_the_papers_size() {
        let (x, y) = portable();
        let less = mann_whitney(&x, &y, Alternative::SecondLarger, Method::Automatic).unwrap();
        assert_eq!(less.u, [160_404_114.0, 324e6 - 160_404_114.0]);
        assert!(!less.exact);
        near(less.p, 0.052_757_438_755_148_85);
        near(10f64.powf(less.log10_p), 0.052_757_438_755_148_85);
        near(less.effect(), 1.0 - 160_404_114.0 / 324e6);
        near(
            p(&x, &y, Alternative::FirstLarger, Method::Automatic),
            0.947_242_670_417_424,
        );
        near(
            p(&x, &y, Alternative::TwoSided, Method::Automatic),
            0.105_514_877_510_297_7,
        );
    }

    #[test]
    fn agrees_with_scipy_on_ties() {
        let (x, y) = portable();
        let rounded = |v: &[f64]| {
            v.iter()
                .map(|v| (50.0 * v).floor() / 50.0)
                .collect::<Vec<_>>()
        };
        let (x, y) = (rounded(&x), rounded(&y));
        let less = mann_whitney(&x, &y, Alternative::SecondLarger, Method::Automatic).unwrap();
        assert_eq!(less.u[0], 160_404_389.5);
        near(less.p, 0.052_753_169_832_839_99);
        near(
            p(&x, &y, Alternative::TwoSided, Method::Automatic),
            0.105_506_339_665_679_97,
        );
    }

    #[test]
    fn agrees_with_scipy_on_tiny_p_and_goes_on_where_it_underflows() {
        let (x, y) = portable();
        for (shift, expected) in [
            (0.02, 3.771_248_081_559_751e-16),
            (0.05, 9.922_997_161_503_386e-69),
        ] {
            let shifted: Vec<f64> = y.iter().map(|v| v + shift).collect();
            near(
                p(&x, &shifted, Alternative::SecondLarger, Method::Asymptotic),
                expected,
            );
        }
        let shifted: Vec<f64> = y.iter().map(|v| v + 0.1).collect();
        let test =
            mann_whitney(&x, &shifted, Alternative::SecondLarger, Method::Asymptotic).unwrap();
        assert!(
            (test.log10_p + 231.708_512_226_585_8).abs() < 1e-9,
            "{}",
            test.log10_p
        );
        let far: Vec<f64> = y.iter().map(|v| v + 2.0).collect();
        let test = mann_whitney(&x, &far, Alternative::SecondLarger, Method::Asymptotic).unwrap();
        assert_eq!((test.p, test.effect()), (0.0, 1.0));
        assert!(test.log10_p < -5_000.0 && test.log10_p.is_finite());
    }

    /// Expected values: SciPy 1.17.1, method="exact".
    #[test]
    fn agrees_with_scipy_on_small_samples() {
        let quarters: Vec<f64> = (0..24).map(|i| f64::from(i) + 0.25).collect();
        let cases: [(&[f64], &[f64], [f64; 3]); 3] = [
            (&[1.0, 2.0, 3.0], &[4.0, 5.0, 6.0], [0.05, 1.0, 0.1]),
            (
                &[1.5, 3.2, 7.1, 0.4],
                &[2.2, 8.8, 9.1, 3.3, 4.7],
                [
                    0.095_238_095_238_095_23,
                    0.944_444_444_444_444_4,
                    0.190_476_190_476_190_47,
                ],
            ),
            (
                &[5.0, 1.0, 9.0, 12.0, 3.5, 2.2, 8.1, 7.7],
                &quarters,
                [
                    0.020_643_545_059_562_857,
                    0.981_575_729_918_332_8,
                    0.041_287_090_119_125_714,
                ],
            ),
        ];
        for (x, y, [less, greater, both]) in cases {
            near(p(x, y, Alternative::SecondLarger, Method::Automatic), less);
            near(p(x, y, Alternative::FirstLarger, Method::Exact), greater);
            near(p(x, y, Alternative::TwoSided, Method::Exact), both);
        }
    }

    proptest! {
        /// Counts every order of the pooled sample.
        #[test]
        fn the_exact_tail_is_that_of_all_permutations(m in 1usize..5, n in 1usize..6, pick in 0.0..1.0f64) {
            let u = (pick * (m * n) as f64) as usize;
            let (mut tail, mut total) = (0, 0);
            for members in 0u32..1 << (m + n) {
                if members.count_ones() as usize != m {
                    continue;
                }
                let mut wins = 0;
                let mut others = 0;
                for place in 0..m + n {
                    if members >> place & 1 == 1 { wins += others } else { others += 1 }
                }
                total += 1;
                tail += usize::from(wins >= u);
            }
            let (tail, total) = (tail as f64, f64::from(total));
            prop_assert!((exact_upper_tail(u, m, n) - tail / total).abs() < 1e-12);
        }

        #[test]
        fn swapping_the_samples_swaps_the_alternative(
            x in prop::collection::vec(-2.0..2.0f64, 1..40),
            y in prop::collection::vec(-2.0..2.0f64, 1..40),
        ) {
            let a = mann_whitney(&x, &y, Alternative::SecondLarger, Method::Automatic).unwrap();
            let b = mann_whitney(&y, &x, Alternative::FirstLarger, Method::Automatic).unwrap();
            prop_assert_eq!(a.u[0], b.u[1]);
            prop_assert_eq!(a.p, b.p);
        }
    }

    #[test]
    fn equal_values_prove_nothing_and_exact_is_refused_with_ties() {
        let same = [1.0; 9];
        assert_eq!(
            p(&same, &same, Alternative::SecondLarger, Method::Automatic),
            1.0
        );
        let message = mann_whitney(&same, &same, Alternative::TwoSided, Method::Exact)
            .unwrap_err()
            .to_string();
        assert!(message.contains("there are ties"), "{message}");
        assert_eq!(
            mann_whitney(&same, &[f64::NAN], Alternative::TwoSided, Method::Automatic)
                .unwrap_err()
                .to_string(),
            "value 0 of the second sample is NaN, not a finite number; leave out failed registrations"
        );
    }
}

//! Summaries, rank tests, effect sizes and the bootstrap.

pub mod bootstrap;
pub mod mann_whitney;
pub mod normal;
pub mod summary;

pub use bootstrap::{Interval, IntervalKind, median_interval};
pub use mann_whitney::{Alternative, MannWhitney, Method, mann_whitney};
pub use summary::{Summary, quantile, share_below};

/// Values that a statistic cannot be computed from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StatisticsError {
    #[error("the {0} sample is empty; leave out comparisons without registrations")]
    Empty(&'static str),
    #[error(
        "value {index} of the {sample} sample is {value}, not a finite number; leave out failed registrations"
    )]
    NotFinite {
        sample: &'static str,
        index: usize,
        value: f64,
    },
    #[error(
        "the exact Mann-Whitney test needs samples without ties, one of at most {limit} values and the other of at most {other_limit}, but {found}; use the asymptotic one"
    )]
    NotExact {
        limit: usize,
        other_limit: usize,
        found: String,
    },
    #[error("{field} is {value}, expected {expected}")]
    OutOfRange {
        field: &'static str,
        value: f64,
        expected: &'static str,
    },
}

/// Refuses empty samples and values that are not finite.
fn check(sample: &'static str, values: &[f64]) -> Result<(), StatisticsError> {
    if values.is_empty() {
        return Err(StatisticsError::Empty(sample));
    }
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(StatisticsError::NotFinite {
            sample,
            index,
            value: values[index],
        }),
        None => Ok(()),
    }
}

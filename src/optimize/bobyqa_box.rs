//! BOBYQA in a box about a start, with the stopping rules that the paper's library uses.
//!
//! The solver is the `bobyqa` crate, a port of PRIMA of Powell's algorithm (DAMTP 2009/NA06) with
//! 2N + 1 interpolation points. Around it stand the scaling of the dimensions by the box and the
//! relative tolerances (DESIGN section 3, facts 2.8).

use bobyqa::{Bobyqa, Config, Status};

/// What a search is run with.
#[derive(Clone, Debug)]
pub struct BoxSearch {
    /// Half widths of the box about the start, one a dimension, positive.
    pub half_widths: Vec<f64>,
    /// Relative tolerance on cost and position: the search ends when an improvement of the best
    /// cost is smaller than this share of it, or when the trust region has shrunk to this share of
    /// its first radius (which is half of the box' half width in every dimension).
    pub tolerance: f64,
    /// Cap on evaluations; a search that meets it says so.
    pub max_evaluations: usize,
}

/// The end of a search.
#[derive(Clone, Debug)]
pub struct BoxOutcome {
    /// The best point seen, as an offset from the start.
    pub offset: Vec<f64>,
    /// Its cost.
    pub cost: f64,
    pub evaluations: usize,
    /// True when the cap ended the search.
    pub capped: bool,
}

/// A search that the solver refused.
#[derive(Debug, thiserror::Error)]
#[error("BOBYQA refused a search in {dimensions} dimensions: {status}")]
pub struct BoxError {
    dimensions: usize,
    status: Status,
}

/// First trust-region radius in units of the half widths.
const FIRST_RADIUS: f64 = 0.5;

/// Minimizes `cost` over offsets from the start that lie in the box. `cost` is not called outside.
///
/// # Errors
/// When the solver refuses the search: fewer than two dimensions or too few evaluations.
pub fn minimize_in_box(
    search: &BoxSearch,
    mut cost: impl FnMut(&[f64]) -> f64,
) -> Result<BoxOutcome, BoxError> {
    let n = search.half_widths.len();
    let mut config = Config::new(n);
    config.rho_begin = FIRST_RADIUS;
    config.rho_end = FIRST_RADIUS * search.tolerance;
    config.max_fun = search.max_evaluations.max(config.npt + 1);
    // Ends the solver when the wrapper below has seen the tolerance on the cost met.
    config.f_target = f64::MIN;
    let first_model = config.npt;
    let refused = |status| BoxError {
        dimensions: n,
        status,
    };
    let mut solver = Bobyqa::new(n, config).map_err(refused)?;

    let mut best = BoxOutcome {
        offset: vec![0.0; n],
        cost: f64::INFINITY,
        evaluations: 0,
        capped: false,
    };
    let mut offset = vec![0.0; n];
    let mut evaluate = |scaled: &[f64]| {
        for ((o, s), w) in offset.iter_mut().zip(scaled).zip(&search.half_widths) {
            *o = s * w;
        }
        let value = cost(&offset);
        best.evaluations += 1;
        if value < best.cost {
            let gain = best.cost - value;
            let small = gain < search.tolerance * 0.5 * (value.abs() + best.cost.abs());
            best.cost = value;
            best.offset.copy_from_slice(&offset);
            if small && best.evaluations > first_model {
                return f64::MIN;
            }
        }
        value
    };
    let mut x = vec![0.0; n];
    let outcome = solver.minimize(&mut evaluate, &mut x, &vec![-1.0; n], &vec![1.0; n]);
    match outcome.status {
        Status::InvalidArgs | Status::AllocationFailed => Err(refused(outcome.status)),
        status => {
            best.capped = status == Status::MaxFunReached;
            Ok(best)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search(half_widths: &[f64], tolerance: f64) -> BoxSearch {
        BoxSearch {
            half_widths: half_widths.to_vec(),
            tolerance,
            max_evaluations: 5000,
        }
    }

    #[test]
    fn finds_an_inner_minimum_in_mixed_units() {
        let target = [0.02, -0.01, 0.05, 3.0, -7.0, 12.0];
        let widths = [0.13, 0.13, 0.26, 25.0, 25.0, 50.0];
        let cost = |x: &[f64]| {
            let q: f64 = (0..6)
                .map(|i| ((x[i] - target[i]) / widths[i]).powi(2))
                .sum();
            0.4 + q + 0.3 * q * q
        };
        let out = minimize_in_box(&search(&widths, 1e-7), cost).unwrap();
        for i in 0..6 {
            assert!(
                (out.offset[i] - target[i]).abs() < 2e-3 * widths[i],
                "{out:?}"
            );
        }
        assert!(!out.capped);
    }

    #[test]
    fn stays_in_the_box_and_ends_on_its_face() {
        let mut outside = false;
        let out = minimize_in_box(&search(&[1.0, 2.0], 1e-6), |x| {
            outside |= x[0].abs() > 1.0 || x[1].abs() > 2.0;
            (x[0] - 3.0).powi(2) + (x[1] + 0.5).powi(2)
        })
        .unwrap();
        assert!(!outside);
        assert!((out.offset[0] - 1.0).abs() < 1e-9 && (out.offset[1] + 0.5).abs() < 1e-2);
    }

    #[test]
    fn a_loose_tolerance_ends_early() {
        let cost = |x: &[f64]| 1.0 + x.iter().map(|v| (v - 0.1) * (v - 0.1)).sum::<f64>();
        let loose = minimize_in_box(&search(&[1.0; 6], 1e-3), cost).unwrap();
        let tight = minimize_in_box(&search(&[1.0; 6], 1e-12), cost).unwrap();
        assert!(loose.evaluations < tight.evaluations);
        assert!(loose.cost < 1.01);
    }

    #[test]
    fn the_cap_is_reported() {
        let capped = BoxSearch {
            max_evaluations: 20,
            ..search(&[1.0; 6], 1e-9)
        };
        let out = minimize_in_box(&capped, |x| {
            x.windows(2)
                .map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (0.9 - w[0]).powi(2))
                .sum()
        })
        .unwrap();
        assert!(out.capped && out.evaluations == 20);
    }
}

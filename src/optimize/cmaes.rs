//! CMA-ES, ask-and-tell.
//!
//! Hansen, "The CMA Evolution Strategy: A Tutorial" (arXiv 1604.00772): weighted recombination
//! with positive weights, cumulative step-size adaptation, rank-one and rank-mu updates of a full
//! covariance. Dimensions are scaled by their initial standard deviations, so that mixed units
//! (rad and mm) start with a unit covariance (DESIGN section 3).

use crate::random::Stream;
use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal};
use std::collections::VecDeque;

/// What a search is run with.
#[derive(Clone, Debug)]
pub struct CmaEsParameters {
    /// Number of candidates a generation, at least 4.
    pub population: usize,
    /// The search ends when the best costs of the last `10 + ceil(30 N / population)` generations
    /// and all costs of the current one span no more than this (TolFun).
    pub cost_tolerance: f64,
    /// Cap on generations; a search that meets it says so.
    pub max_generations: usize,
}

/// Why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CmaEsStop {
    /// Recent costs agree to the tolerance.
    Converged,
    /// The cap on generations was met.
    GenerationCap,
    /// The covariance or the step size left the range of numbers; the mean is the last valid one.
    Degenerate,
}

/// The state of one search. [`CmaEs::ask`] gives a population, [`CmaEs::tell`] takes its costs.
#[derive(Debug)]
pub struct CmaEs {
    parameters: CmaEsParameters,
    scale: DVector<f64>,
    stream: Stream,
    // Strategy parameters, in the tutorial's symbols.
    weights: Vec<f64>,
    mu_eff: f64,
    c_sigma: f64,
    d_sigma: f64,
    c_c: f64,
    c_1: f64,
    c_mu: f64,
    chi_n: f64,
    // State, in scaled coordinates.
    mean: DVector<f64>,
    sigma: f64,
    covariance: DMatrix<f64>,
    eigenvectors: DMatrix<f64>,
    axis_lengths: DVector<f64>,
    path_sigma: DVector<f64>,
    path_c: DVector<f64>,
    /// Steps of the last population, one column a candidate, as `x = mean + sigma * step`.
    steps: DMatrix<f64>,
    generation: usize,
    best_costs: VecDeque<f64>,
    stop: Option<CmaEsStop>,
}

impl CmaEs {
    /// A search around `mean` with one initial standard deviation for each dimension.
    ///
    /// # Panics
    /// When lengths differ, a standard deviation is not positive, or the population is below 4.
    pub fn new(
        mean: &[f64],
        initial_sd: &[f64],
        parameters: CmaEsParameters,
        stream: Stream,
    ) -> Self {
        assert_eq!(mean.len(), initial_sd.len());
        assert!(initial_sd.iter().all(|&s| s > 0.0 && s.is_finite()));
        assert!(
            parameters.population >= 4,
            "a population has 4 candidates or more"
        );
        let n = mean.len();
        let nf = n as f64;
        let lambda = parameters.population;
        let mu = lambda / 2;
        let raw: Vec<f64> = (1..=mu)
            .map(|i| ((lambda as f64 + 1.0) / 2.0).ln() - (i as f64).ln())
            .collect();
        let sum: f64 = raw.iter().sum();
        let weights: Vec<f64> = raw.iter().map(|w| w / sum).collect();
        let mu_eff = 1.0 / weights.iter().map(|w| w * w).sum::<f64>();
        let c_sigma = (mu_eff + 2.0) / (nf + mu_eff + 5.0);
        let d_sigma = 1.0 + 2.0 * (((mu_eff - 1.0) / (nf + 1.0)).sqrt() - 1.0).max(0.0) + c_sigma;
        let c_c = (4.0 + mu_eff / nf) / (nf + 4.0 + 2.0 * mu_eff / nf);
        let c_1 = 2.0 / ((nf + 1.3).powi(2) + mu_eff);
        let c_mu = (1.0 - c_1)
            .min(2.0 * (0.25 + mu_eff + 1.0 / mu_eff - 2.0) / ((nf + 2.0).powi(2) + mu_eff));
        let chi_n = nf.sqrt() * (1.0 - 1.0 / (4.0 * nf) + 1.0 / (21.0 * nf * nf));
        let scale = DVector::from_column_slice(initial_sd);
        Self {
            mean: DVector::from_column_slice(mean).component_div(&scale),
            scale,
            stream,
            weights,
            mu_eff,
            c_sigma,
            d_sigma,
            c_c,
            c_1,
            c_mu,
            chi_n,
            sigma: 1.0,
            covariance: DMatrix::identity(n, n),
            eigenvectors: DMatrix::identity(n, n),
            axis_lengths: DVector::from_element(n, 1.0),
            path_sigma: DVector::zeros(n),
            path_c: DVector::zeros(n),
            steps: DMatrix::zeros(n, lambda),
            generation: 0,
            best_costs: VecDeque::new(),
            stop: None,
            parameters,
        }
    }

    /// Number of dimensions.
    pub fn dimensions(&self) -> usize {
        self.mean.len()
    }

    /// Number of generations told so far.
    pub fn generations(&self) -> usize {
        self.generation
    }

    /// The distribution's mean: the search's result.
    pub fn mean(&self) -> Vec<f64> {
        self.mean.component_mul(&self.scale).as_slice().to_vec()
    }

    /// Why the search ended, or `None` while it goes on.
    pub fn stop(&self) -> Option<CmaEsStop> {
        self.stop
    }

    /// The next population: `population * dimensions` values, candidate after candidate.
    pub fn ask(&mut self) -> Vec<f64> {
        let (n, lambda) = (self.dimensions(), self.parameters.population);
        let mut out = Vec::with_capacity(n * lambda);
        for k in 0..lambda {
            let z = DVector::from_fn(n, |i, _| {
                let z: f64 = StandardNormal.sample(&mut self.stream);
                self.axis_lengths[i] * z
            });
            let step = &self.eigenvectors * z;
            let x = (&self.mean + &step * self.sigma).component_mul(&self.scale);
            self.steps.set_column(k, &step);
            out.extend_from_slice(x.as_slice());
        }
        out
    }

    /// Takes the costs of the population that [`CmaEs::ask`] gave last. A cost that is not a
    /// number ranks behind all others.
    ///
    /// # Panics
    /// When their number is not the population's.
    pub fn tell(&mut self, costs: &[f64]) {
        assert_eq!(
            costs.len(),
            self.parameters.population,
            "one cost a candidate"
        );
        let costs: Vec<f64> = costs
            .iter()
            .map(|&c| if c.is_nan() { f64::INFINITY } else { c })
            .collect();
        let mut order: Vec<usize> = (0..costs.len()).collect();
        order.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]).then(a.cmp(&b)));
        self.generation += 1;
        self.update(&order);
        self.check_stop(costs[order[0]], costs[order[costs.len() - 1]]);
    }

    fn update(&mut self, order: &[usize]) {
        let n = self.dimensions() as f64;
        let mut y_w = DVector::zeros(self.dimensions());
        for (w, &k) in self.weights.iter().zip(order) {
            y_w.axpy(*w, &self.steps.column(k), 1.0);
        }
        self.mean.axpy(self.sigma, &y_w, 1.0);

        let whitened = &self.eigenvectors
            * (self.eigenvectors.transpose() * &y_w).component_div(&self.axis_lengths);
        let c_s = self.c_sigma;
        self.path_sigma =
            &self.path_sigma * (1.0 - c_s) + whitened * (c_s * (2.0 - c_s) * self.mu_eff).sqrt();
        let norm = self.path_sigma.norm();
        let unbiased = (1.0 - (1.0 - c_s).powi(2 * self.generation as i32)).sqrt();
        let h_sigma = norm / unbiased < (1.4 + 2.0 / (n + 1.0)) * self.chi_n;
        let c_c = self.c_c;
        self.path_c *= 1.0 - c_c;
        if h_sigma {
            self.path_c
                .axpy((c_c * (2.0 - c_c) * self.mu_eff).sqrt(), &y_w, 1.0);
        }
        let lost_variance = if h_sigma { 0.0 } else { c_c * (2.0 - c_c) };
        self.covariance *= 1.0 + self.c_1 * lost_variance - self.c_1 - self.c_mu;
        self.covariance
            .ger(self.c_1, &self.path_c, &self.path_c, 1.0);
        for (w, &k) in self.weights.iter().zip(order) {
            let step = self.steps.column(k).into_owned();
            self.covariance.ger(self.c_mu * w, &step, &step, 1.0);
        }
        self.sigma *= ((c_s / self.d_sigma) * (norm / self.chi_n - 1.0)).exp();
        self.decompose();
    }

    fn decompose(&mut self) {
        let symmetric = (&self.covariance + self.covariance.transpose()) * 0.5;
        let eigen = symmetric.clone().symmetric_eigen();
        let valid = self.sigma.is_finite()
            && self.sigma > 0.0
            && eigen.eigenvalues.iter().all(|&v| v.is_finite() && v > 0.0);
        if !valid {
            self.stop = Some(CmaEsStop::Degenerate);
            return;
        }
        self.covariance = symmetric;
        self.axis_lengths = eigen.eigenvalues.map(f64::sqrt);
        self.eigenvectors = eigen.eigenvectors;
    }

    fn check_stop(&mut self, best: f64, worst: f64) {
        let history = 10
            + (30.0 * self.dimensions() as f64 / self.parameters.population as f64).ceil() as usize;
        self.best_costs.push_back(best);
        if self.best_costs.len() > history {
            self.best_costs.pop_front();
        }
        if self.stop.is_some() {
            return;
        }
        if self.best_costs.len() == history {
            let low = self.best_costs.iter().copied().fold(best, f64::min);
            let high = self.best_costs.iter().copied().fold(worst, f64::max);
            if high - low <= self.parameters.cost_tolerance {
                self.stop = Some(CmaEsStop::Converged);
                return;
            }
        }
        if self.generation >= self.parameters.max_generations {
            self.stop = Some(CmaEsStop::GenerationCap);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, stream};

    fn search(
        cost: impl Fn(&[f64]) -> f64,
        start: &[f64],
        sd: &[f64],
        population: usize,
        tolerance: f64,
        key: &str,
    ) -> (Vec<f64>, usize, CmaEsStop) {
        let parameters = CmaEsParameters {
            population,
            cost_tolerance: tolerance,
            max_generations: 5000,
        };
        let mut es = CmaEs::new(start, sd, parameters, stream(7, Purpose::Optimizer, key));
        while es.stop().is_none() {
            let costs: Vec<f64> = es.ask().chunks(start.len()).map(&cost).collect();
            es.tell(&costs);
        }
        (es.mean(), es.generations(), es.stop().unwrap())
    }

    fn ellipsoid(x: &[f64]) -> f64 {
        let n = x.len() as f64 - 1.0;
        (x.iter().enumerate())
            .map(|(i, v)| 1e6f64.powf(i as f64 / n) * v * v)
            .sum()
    }

    fn rosenbrock(x: &[f64]) -> f64 {
        x.windows(2)
            .map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2))
            .sum()
    }

    #[test]
    fn finds_the_minimum_of_an_ill_conditioned_ellipsoid() {
        let (x, _, stop) = search(ellipsoid, &[3.0; 6], &[2.0; 6], 20, 1e-12, "ellipsoid");
        assert_eq!(stop, CmaEsStop::Converged);
        assert!(ellipsoid(&x) < 1e-11, "{x:?}");
    }

    #[test]
    fn finds_the_minimum_of_rosenbrock() {
        let (x, _, _) = search(rosenbrock, &[0.0; 6], &[0.5; 6], 20, 1e-12, "rosenbrock");
        assert!(x.iter().all(|v| (v - 1.0).abs() < 1e-5), "{x:?}");
    }

    #[test]
    fn scaling_a_dimension_and_its_sd_changes_nothing() {
        let (a, generations_a, _) = search(rosenbrock, &[0.0; 3], &[0.5; 3], 10, 1e-9, "scale");
        let wide = |x: &[f64]| rosenbrock(&[x[0], x[1] / 1024.0, x[2]]);
        let (b, generations_b, _) = search(wide, &[0.0; 3], &[0.5, 512.0, 0.5], 10, 1e-9, "scale");
        assert_eq!(generations_a, generations_b);
        assert_eq!(a[1] * 1024.0, b[1]);
    }

    #[test]
    fn a_flat_cost_converges_after_the_history() {
        let (_, generations, stop) = search(|_| 1.0, &[0.0; 6], &[1.0; 6], 100, 0.01, "flat");
        assert_eq!((generations, stop), (12, CmaEsStop::Converged));
    }

    #[test]
    fn costs_that_are_not_numbers_rank_last() {
        let cost = |x: &[f64]| if x[0] < 0.5 { f64::NAN } else { ellipsoid(x) };
        let (x, _, _) = search(cost, &[2.0; 4], &[1.0; 4], 20, 1e-10, "nan");
        assert!((x[0] - 0.5).abs() < 1e-2, "{x:?}");
    }

    #[test]
    fn the_cap_is_reported() {
        let parameters = CmaEsParameters {
            population: 8,
            cost_tolerance: 0.0,
            max_generations: 3,
        };
        let mut es = CmaEs::new(
            &[1.0, 1.0],
            &[1.0, 1.0],
            parameters,
            stream(7, Purpose::Optimizer, "cap"),
        );
        while es.stop().is_none() {
            let costs: Vec<f64> = es.ask().chunks(2).map(ellipsoid).collect();
            es.tell(&costs);
        }
        assert_eq!(
            (es.generations(), es.stop()),
            (3, Some(CmaEsStop::GenerationCap))
        );
    }
}

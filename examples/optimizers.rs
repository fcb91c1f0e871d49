//! Runs the optimizers on test functions and prints a table for `scripts/check_optimizers.py`.

use pao_sim::optimize::{BoxSearch, CmaEs, CmaEsParameters, minimize_in_box};
use pao_sim::random::{Purpose, stream};

type Function = fn(&[f64]) -> f64;

fn sphere(x: &[f64]) -> f64 {
    x.iter().map(|v| v * v).sum()
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

/// A smooth, skewed bowl with its minimum 0.3 at 0.25 in every dimension.
fn bowl(x: &[f64]) -> f64 {
    let q: f64 = (x.iter().enumerate())
        .map(|(i, v)| (1.0 + i as f64) * (v - 0.25).powi(2))
        .sum();
    0.3 + q + 0.2 * (x.iter().sum::<f64>() - 0.25 * x.len() as f64).powi(2) + 0.1 * q * q
}

fn main() {
    let functions: [(&str, Function, f64); 3] = [
        ("sphere", sphere, 2.0),
        ("ellipsoid", ellipsoid, 2.0),
        ("rosenbrock", rosenbrock, 0.0),
    ];
    println!("method,function,n,population,seed,evaluations,cost");
    for (name, f, start) in functions {
        for population in [20, 100] {
            for seed in 0..30 {
                let parameters = CmaEsParameters {
                    population,
                    cost_tolerance: 0.0,
                    max_generations: 100_000 / population,
                };
                let draws = stream(seed, Purpose::Optimizer, name);
                let mut search = CmaEs::new(&[start; 6], &[1.0; 6], parameters, draws);
                let mut best = f64::INFINITY;
                while search.stop().is_none() && best > 1e-9 {
                    let costs: Vec<f64> = search.ask().chunks(6).map(f).collect();
                    best = costs.iter().copied().fold(best, f64::min);
                    search.tell(&costs);
                }
                let evaluations = search.generations() * population;
                println!("cmaes,{name},6,{population},{seed},{evaluations},{best:e}");
            }
        }
    }
    for n in [6, 18] {
        for tolerance in [1e-3, 1e-4, 1e-7] {
            let search = BoxSearch {
                half_widths: vec![1.0; n],
                tolerance,
                max_evaluations: 10_000,
            };
            let outcome = minimize_in_box(&search, bowl).expect("a valid search");
            println!(
                "bobyqa,bowl,{n},{},{tolerance:e},{},{:e}",
                2 * n + 1,
                outcome.evaluations,
                outcome.cost
            );
        }
    }
}

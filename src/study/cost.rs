//! What is left of a study, and what it will cost.

use super::calibration::{Calibration, cell};
use super::{CaseKey, Plan, State};
use crate::store::{COMPLETE, Row};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Where the seconds of an estimate come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Basis {
    /// The study's own rows, so many of them.
    Rows(usize),
    /// A calibration.
    Calibration,
}

/// Work, and what it costs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Cost {
    pub cases: usize,
    pub registrations: usize,
    /// Registrations by `scenario/strategy`.
    pub cells: BTreeMap<String, usize>,
    /// Of one thread; `None` before anything was measured.
    pub thread_seconds: Option<f64>,
    pub basis: Option<Basis>,
}

impl Cost {
    /// The cost of a plan, or of what is left of it after `done`.
    pub fn of(plan: &Plan, done: Option<&State>, rates: Option<&Rates>) -> Self {
        let (mut cells, mut cases) = (BTreeMap::<String, usize>::new(), 0);
        let mut hips = BTreeSet::new();
        for case in &plan.cases {
            let mut keys = plan.registrations(case);
            keys.retain(|key| done.is_none_or(|state| state.row(key).is_none()));
            if keys.is_empty() {
                continue;
            }
            cases += 1;
            hips.insert(hip(case));
            for key in &keys {
                *cells.entry(cell(key)).or_default() += 1;
            }
        }
        let seconds = rates.map(|rates| {
            let registrations: f64 = cells
                .iter()
                .map(|(cell, count)| rates.registration(cell) * *count as f64)
                .sum();
            registrations + rates.simulation * cases as f64 + rates.preparation * hips.len() as f64
        });
        Self {
            cases,
            registrations: cells.values().sum(),
            cells,
            thread_seconds: seconds,
            basis: rates.map(|rates| rates.basis),
        }
    }

    /// How many equal shares of so many threads each end within `hours`, with a tenth to spare. At least
    /// one, at most one a case.
    pub fn shares(&self, threads: usize, hours: f64) -> Option<usize> {
        let seconds = self.thread_seconds?;
        let shares = seconds / (threads as f64 * hours * 3600.0 * 0.9);
        Some((shares.ceil() as usize).clamp(1, self.cases.max(1)))
    }
}

fn hip(case: &CaseKey) -> String {
    case.fragment.hip()
}

/// Mean seconds of one thread.
#[derive(Clone, Debug, PartialEq)]
pub struct Rates {
    basis: Basis,
    preparation: f64,
    simulation: f64,
    cells: BTreeMap<String, f64>,
    mean: f64,
}

impl Rates {
    /// From the rows of a study; `None` when none is complete.
    pub fn of_rows(plan: &Plan, state: &State) -> Option<Self> {
        let mut sums: BTreeMap<String, (f64, usize)> = BTreeMap::new();
        let (mut simulation, mut count) = (0.0, 0);
        let complete = |row: &&Row| row.text("status") == COMPLETE;
        for row in state.planned_rows(plan).filter(complete) {
            let name = format!("{}/{}", row.text("scenario"), row.text("strategy"));
            let own = sums.entry(name).or_default();
            own.0 += row.number("registration_seconds")?;
            own.1 += 1;
            // The preparation of its hip is in it, for the first case of a hip.
            simulation += row.number("simulation_seconds")?;
            count += 1;
        }
        if count == 0 {
            return None;
        }
        let total: f64 = sums.values().map(|(sum, _)| sum).sum();
        Some(Self {
            basis: Basis::Rows(count),
            preparation: 0.0,
            simulation: simulation / count as f64,
            cells: sums
                .into_iter()
                .map(|(k, (s, n))| (k, s / n as f64))
                .collect(),
            mean: total / count as f64,
        })
    }

    /// From a calibration.
    pub fn of_calibration(calibration: &Calibration) -> Self {
        let cells = calibration.registration_seconds.clone();
        Self {
            basis: Basis::Calibration,
            preparation: calibration.preparation_seconds,
            simulation: calibration.simulation_seconds,
            mean: cells.values().sum::<f64>() / cells.len().max(1) as f64,
            cells,
        }
    }

    fn registration(&self, cell: &str) -> f64 {
        self.cells.get(cell).copied().unwrap_or(self.mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::Config;
    use std::path::Path;

    #[test]
    fn a_calibration_gives_the_cost_and_the_shares() {
        let text = "[study]\ninitializations = 2\nscenarios = [\"all_cuts_known\", \"no_cuts_known\"]\n[population]\nphantoms = 1\n[surgery]\nfragments = 1\n[movement]\nmovements = 5\n";
        let config = Config::parse(text, Path::new("a.toml"), &|_| None).unwrap();
        let calibration = Calibration {
            config: config.hash(),
            code: String::new(),
            cpu: String::new(),
            preparation_seconds: 10.0,
            simulation_seconds: 3.0,
            registration_seconds: [
                ("all_cuts_known/paper", 20.0),
                ("no_cuts_known/paper", 30.0),
            ]
            .map(|(k, v)| (k.to_owned(), v))
            .into(),
            peak_memory_bytes: None,
        };
        let rates = Rates::of_calibration(&calibration);
        let cost = Cost::of(&Plan::of(&config), None, Some(&rates));
        // 10 cases on 2 hips, 20 registrations of either scenario.
        assert_eq!((cost.cases, cost.registrations), (10, 40));
        assert_eq!(
            cost.thread_seconds,
            Some(20.0 + 30.0 + 20.0 * 20.0 + 20.0 * 30.0)
        );
        assert_eq!(cost.shares(1, 1.0), Some(1));
        assert_eq!(cost.shares(1, 0.1), Some(4));
        assert_eq!(cost.shares(1, 1e-3), Some(10), "not more than cases");
        assert_eq!(
            Cost::of(&Plan::of(&config), None, None).shares(1, 1.0),
            None
        );
    }
}

//! The numbers behind the tables, as Parquet.

use super::errors_table::{SCENARIOS, absolute};
use super::reference::PAPER;
use super::rows::Rows;
use crate::statistics::{Alternative, Method, StatisticsError, Summary, mann_whitney};
use polars::prelude::*;

/// Columns of errors, and their key in the reference's Table I.
const MEASURES: [(&str, &str); 9] = [
    ("rotation_error_ap_deg", "rot_ap"),
    ("rotation_error_lr_deg", "rot_lr"),
    ("rotation_error_is_deg", "rot_is"),
    ("rotation_error_deg", "rot_total"),
    ("translation_error_ap_mm", "trans_ap"),
    ("translation_error_lr_mm", "trans_lr"),
    ("translation_error_is_mm", "trans_is"),
    ("translation_error_mm", "trans_total"),
    ("lce_error_deg", "lce"),
];

/// Growing columns of summaries of absolute errors: one line a group, scenario and measure.
#[derive(Debug, Default)]
pub struct Summaries {
    group: Vec<String>,
    scenario: Vec<String>,
    measure: Vec<String>,
    n: Vec<u64>,
    numbers: [Vec<f64>; 10],
}

const NUMBERS: [&str; 10] = [
    "mean",
    "sd",
    "min",
    "q25",
    "median",
    "q75",
    "q95",
    "max",
    "paper_mean",
    "paper_sd",
];

impl Summaries {
    /// Adds the complete rows of one group.
    ///
    /// # Errors
    /// When a value is not finite.
    pub fn add(&mut self, group: &str, rows: &Rows) -> Result<(), StatisticsError> {
        for scenario in SCENARIOS {
            let own = rows.with("scenario", scenario);
            if own.is_empty() {
                continue;
            }
            for (column, key) in MEASURES {
                let s = Summary::of(&absolute(&own, column))?;
                let [paper_mean, paper_sd] = PAPER.table1[scenario][key];
                self.group.push(group.into());
                self.scenario.push(scenario.into());
                self.measure.push(column.into());
                self.n.push(s.n as u64);
                let line = [
                    s.mean, s.sd, s.min, s.q25, s.median, s.q75, s.q95, s.max, paper_mean, paper_sd,
                ];
                for (column, value) in self.numbers.iter_mut().zip(line) {
                    column.push(value);
                }
            }
        }
        Ok(())
    }

    /// The columns as a frame.
    ///
    /// # Errors
    /// Never for columns of one length, as these are.
    pub fn frame(self) -> PolarsResult<DataFrame> {
        let height = self.n.len();
        let mut columns = vec![
            Column::new("group".into(), self.group),
            Column::new("scenario".into(), self.scenario),
            Column::new("measure".into(), self.measure),
            Column::new("n".into(), self.n),
        ];
        let numbers = NUMBERS.into_iter().zip(self.numbers);
        columns.extend(numbers.map(|(name, values)| Column::new(name.into(), values)));
        DataFrame::new(height, columns)
    }
}

/// Growing columns of the one-tailed Mann-Whitney tests of Table II.
#[derive(Debug, Default)]
pub struct Tests {
    text: [Vec<String>; 4],
    sizes: [Vec<u64>; 2],
    numbers: [Vec<f64>; 4],
}

impl Tests {
    /// Adds the complete rows of one group.
    ///
    /// # Errors
    /// When a value is not finite.
    pub fn add(&mut self, group: &str, rows: &Rows) -> Result<(), StatisticsError> {
        for comparison in &PAPER.table2 {
            let first = rows.with("scenario", &comparison.first);
            let second = rows.with("scenario", &comparison.second);
            if first.is_empty() || second.is_empty() {
                continue;
            }
            for measure in [
                "rotation_error_deg",
                "translation_error_mm",
                "lce_error_deg",
            ] {
                let (a, b) = (absolute(&first, measure), absolute(&second, measure));
                let test = mann_whitney(&a, &b, Alternative::SecondLarger, Method::Automatic)?;
                let line = [group, &comparison.first, &comparison.second, measure];
                for (column, value) in self.text.iter_mut().zip(line) {
                    column.push(value.to_owned());
                }
                for (column, size) in self.sizes.iter_mut().zip(test.sizes) {
                    column.push(size as u64);
                }
                let line = [test.u[0], test.p, test.log10_p, test.effect()];
                for (column, value) in self.numbers.iter_mut().zip(line) {
                    column.push(value);
                }
            }
        }
        Ok(())
    }

    /// The columns as a frame.
    ///
    /// # Errors
    /// Never for columns of one length, as these are.
    pub fn frame(self) -> PolarsResult<DataFrame> {
        let height = self.sizes[0].len();
        let text = ["group", "first", "second", "measure"]
            .into_iter()
            .zip(self.text);
        let sizes = ["n1", "n2"].into_iter().zip(self.sizes);
        let numbers = ["u1", "p", "log10_p", "effect"]
            .into_iter()
            .zip(self.numbers);
        let mut columns: Vec<Column> = text
            .map(|(name, values)| Column::new(name.into(), values))
            .collect();
        columns.extend(sizes.map(|(name, values)| Column::new(name.into(), values)));
        columns.extend(numbers.map(|(name, values)| Column::new(name.into(), values)));
        DataFrame::new(height, columns)
    }
}

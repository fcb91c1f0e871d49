//! What the stages of a strategy cost.

use super::rows::Rows;
use super::table::{Table, mean_sd};
use crate::statistics::{StatisticsError, Summary};
use crate::store::STAGES;

/// Evaluations, caps and times of each stage, over all scenarios.
///
/// # Errors
/// When a value is not finite.
pub fn effort(rows: &Rows) -> Result<Table, StatisticsError> {
    let mut body = Vec::new();
    for stage in STAGES {
        let evaluations = known(rows, &format!("{stage}_evaluations"));
        if evaluations.is_empty() {
            continue;
        }
        let capped = known(rows, &format!("{stage}_capped"));
        let share = capped.iter().sum::<f64>() / capped.len().max(1) as f64;
        body.push(vec![
            stage.to_string(),
            evaluations.len().to_string(),
            summary(&evaluations)?,
            format!("{:.1} %", 100.0 * share),
            summary(&known(rows, &format!("{stage}_seconds")))?,
        ]);
    }
    for (title, column) in [
        ("shape estimation", "shape_seconds"),
        ("whole registration", "registration_seconds"),
        ("simulation of the case", "simulation_seconds"),
    ] {
        let seconds = known(rows, column);
        if !seconds.is_empty() {
            let n = seconds.len().to_string();
            body.push(vec![
                title.into(),
                n,
                "-".into(),
                "-".into(),
                summary(&seconds)?,
            ]);
        }
    }
    Ok(Table {
        name: "effort".into(),
        title: "What the stages cost".into(),
        header: ["Stage", "n", "evaluations", "capped", "seconds"]
            .map(String::from)
            .to_vec(),
        rows: body,
        notes: vec![
            "Seconds are wall time of one thread beside others, measured when a row was made; they are no result.".into(),
        ],
    })
}

fn summary(values: &[f64]) -> Result<String, StatisticsError> {
    if values.is_empty() {
        return Ok("-".into());
    }
    let s = Summary::of(values)?;
    Ok(mean_sd(s.mean, s.sd))
}

fn known(rows: &Rows, column: &str) -> Vec<f64> {
    let values = rows.numbers(column).iter().copied();
    values.filter(|value| !value.is_nan()).collect()
}

//! Table I: pose and LCE errors by scenario, beside the paper's.

use super::reference::PAPER;
use super::rows::Rows;
use super::table::{Table, mean_sd};
use crate::statistics::{IntervalKind, StatisticsError, Summary, median_interval, share_below};

/// The scenarios in the paper's order.
pub const SCENARIOS: [&str; 4] = [
    "all_cuts_known",
    "no_cuts_known",
    "ilium_pubis_known",
    "ilium_pubis_estimated",
];

/// Columns of Table I: heading, column of the rows, key of the reference.
const COLUMNS: [(&str, &str, &str); 9] = [
    ("Rot. AP (deg)", "rotation_error_ap_deg", "rot_ap"),
    ("Rot. LR (deg)", "rotation_error_lr_deg", "rot_lr"),
    ("Rot. IS (deg)", "rotation_error_is_deg", "rot_is"),
    ("Rot. total (deg)", "rotation_error_deg", "rot_total"),
    ("Trans. AP (mm)", "translation_error_ap_mm", "trans_ap"),
    ("Trans. LR (mm)", "translation_error_lr_mm", "trans_lr"),
    ("Trans. IS (mm)", "translation_error_is_mm", "trans_is"),
    ("Trans. total (mm)", "translation_error_mm", "trans_total"),
    ("LCE (deg)", "lce_error_deg", "lce"),
];

/// The name of a scenario as tables print it.
pub fn scenario_title(scenario: &str) -> String {
    let published = PAPER.scenarios.get(scenario);
    published.cloned().unwrap_or_else(|| scenario.to_string())
}

/// The absolute values of a column.
pub fn absolute(rows: &Rows, column: &str) -> Vec<f64> {
    rows.numbers(column).iter().map(|v| v.abs()).collect()
}

/// Table I of complete rows of one strategy: mean +- SD of absolute errors, ours above the
/// paper's.
///
/// # Errors
/// When a value is not finite.
pub fn table1(rows: &Rows) -> Result<Table, StatisticsError> {
    let mut header = vec!["Scenario".to_string(), "".into(), "n".into()];
    header.extend(COLUMNS.map(|(title, _, _)| title.to_string()));
    let mut body = Vec::new();
    for scenario in SCENARIOS {
        let own = rows.with("scenario", scenario);
        let mut line = vec![
            scenario_title(scenario),
            "here".into(),
            own.len().to_string(),
        ];
        for (_, column, _) in COLUMNS {
            line.push(match own.is_empty() {
                true => "-".into(),
                false => {
                    let summary = Summary::of(&absolute(&own, column))?;
                    mean_sd(summary.mean, summary.sd)
                }
            });
        }
        body.push(line);
        let mut line = vec![String::new(), "paper".into(), "18000".into()];
        for (_, _, key) in COLUMNS {
            let [mean, sd] = PAPER.table1[scenario][key];
            line.push(mean_sd(mean, sd));
        }
        body.push(line);
    }
    Ok(Table {
        name: "table1".into(),
        title: "Table I: fragment pose and LCE errors (mean +- SD of absolute values)".into(),
        header,
        rows: body,
        notes: Vec::new(),
    })
}

/// An interval from fewer cases would say nothing.
const FEWEST_CASES: usize = 5;

/// Medians with 95 % bootstrap intervals (whole cases are resampled), and quartiles.
///
/// # Errors
/// When a value is not finite.
pub fn medians(rows: &Rows, seed: u64) -> Result<Table, StatisticsError> {
    let measures = [
        ("rotation_error_deg", "Rotation (deg)"),
        ("translation_error_mm", "Translation (mm)"),
        ("lce_error_deg", "LCE (deg)"),
    ];
    let mut header = vec!["Scenario".to_string(), "n".into()];
    header.extend(measures.map(|(_, title)| format!("{title}: median [95 % interval]")));
    let mut body = Vec::new();
    for scenario in SCENARIOS {
        let own = rows.with("scenario", scenario);
        let mut line = vec![scenario_title(scenario), own.len().to_string()];
        let cases = case_numbers(&own);
        for (column, _) in measures {
            if own.is_empty() {
                line.push("-".into());
                continue;
            }
            let values = absolute(&own, column);
            let median = Summary::of(&values)?.median;
            if cases
                .iter()
                .max()
                .is_none_or(|last| last + 1 < FEWEST_CASES)
            {
                line.push(format!("{median:.2}"));
                continue;
            }
            let key = format!("{scenario}/{column}");
            let kind = IntervalKind::Percentile;
            let interval = median_interval(&values, &cases, 0.95, 2000, kind, (seed, &key))?;
            line.push(format!(
                "{median:.2} [{:.2}, {:.2}]",
                interval.low, interval.high
            ));
        }
        body.push(line);
    }
    Ok(Table {
        name: "medians".into(),
        title: "Medians of absolute errors".into(),
        header,
        rows: body,
        notes: vec!["Intervals: percentile bootstrap over cases, 2000 resamples; none for fewer than 5 cases.".into()],
    })
}

/// Shares of registrations under the paper's thresholds, beside the paper's.
///
/// # Errors
/// When a value is not finite.
pub fn shares(rows: &Rows) -> Result<Table, StatisticsError> {
    let criteria = [
        (
            "rotation_error_deg",
            3.0,
            "Rotation < 3 deg",
            Some("rotation_below_3deg"),
        ),
        ("rotation_error_deg", 2.0, "Rotation < 2 deg", None),
        ("lce_error_deg", 3.0, "LCE < 3 deg", Some("lce_below_3deg")),
        ("lce_error_deg", 2.0, "LCE < 2 deg", Some("lce_below_2deg")),
    ];
    let mut header = vec!["Scenario".to_string(), "n".into()];
    header.extend(criteria.map(|(_, _, title, _)| format!("{title}: here (paper)")));
    let mut body = Vec::new();
    for scenario in SCENARIOS {
        let own = rows.with("scenario", scenario);
        let mut line = vec![scenario_title(scenario), own.len().to_string()];
        for (column, threshold, _, key) in criteria {
            let here = match own.is_empty() {
                true => "-".to_string(),
                false => {
                    let share = share_below(&absolute(&own, column), threshold)?;
                    format!("{:.0} %", 100.0 * share)
                }
            };
            let paper = key.map_or("-".to_string(), |key| {
                format!("{:.0} %", 100.0 * PAPER.success_rates[key][scenario])
            });
            line.push(format!("{here} ({paper})"));
        }
        body.push(line);
    }
    Ok(Table {
        name: "shares".into(),
        title: "Shares of registrations under a threshold".into(),
        header,
        rows: body,
        notes: Vec::new(),
    })
}

/// The number of each row's case, in order of first appearance.
fn case_numbers(rows: &Rows) -> Vec<usize> {
    let mut keys: Vec<String> = Vec::new();
    (0..rows.len())
        .map(|i| {
            let key = format!(
                "{}/{}/{}/{}",
                rows.text("specimen")[i],
                rows.text("side")[i],
                rows.numbers("fragment")[i],
                rows.numbers("movement")[i]
            );
            keys.iter().position(|k| *k == key).unwrap_or_else(|| {
                keys.push(key);
                keys.len() - 1
            })
        })
        .collect()
}

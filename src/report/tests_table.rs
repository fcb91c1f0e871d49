//! Table II: one-tailed Mann-Whitney tests between scenarios, beside the paper's p values.

use super::errors_table::{absolute, scenario_title};
use super::reference::PAPER;
use super::rows::Rows;
use super::table::Table;
use crate::statistics::{Alternative, MannWhitney, Method, StatisticsError, mann_whitney};

/// Table II of complete rows of one strategy. The alternative is that the second scenario's errors
/// are larger.
///
/// # Errors
/// When a value is not finite.
pub fn table2(rows: &Rows) -> Result<Table, StatisticsError> {
    let measures = [
        ("rotation_error_deg", "Rot."),
        ("translation_error_mm", "Trans."),
        ("lce_error_deg", "LCE"),
    ];
    let mut header = vec!["1".to_string(), "2".into(), "n1".into(), "n2".into()];
    for (_, title) in measures {
        header.push(format!("{title} p here (paper)"));
        header.push(format!("{title} effect"));
    }
    let mut body = Vec::new();
    for comparison in &PAPER.table2 {
        let first = rows.with("scenario", &comparison.first);
        let second = rows.with("scenario", &comparison.second);
        let mut line = vec![
            scenario_title(&comparison.first),
            scenario_title(&comparison.second),
            first.len().to_string(),
            second.len().to_string(),
        ];
        let published = [
            &comparison.p.rotation,
            &comparison.p.translation,
            &comparison.p.lce,
        ];
        for ((column, _), paper) in measures.into_iter().zip(published) {
            if first.is_empty() || second.is_empty() {
                line.extend([format!("- ({paper})"), "-".into()]);
                continue;
            }
            let test = mann_whitney(
                &absolute(&first, column),
                &absolute(&second, column),
                Alternative::SecondLarger,
                Method::Automatic,
            )?;
            line.push(format!("{} ({paper})", p_value(&test)));
            line.push(format!("{:.3}", test.effect()));
        }
        body.push(line);
    }
    Ok(Table {
        name: "table2".into(),
        title: "Table II: one-tailed Mann-Whitney U tests (alternative: the second has larger errors)".into(),
        header,
        rows: body,
        notes: vec![
            "Effect: probability that an error of the second scenario is the larger one (0.5: none). The test takes \
             registrations as independent, as the paper does; those of one case are not."
                .into(),
        ],
    })
}

/// Four decimals, or two digits and a power of ten where they would all be zero. Works from the
/// logarithm, so that a p value below the smallest number is still told.
fn p_value(test: &MannWhitney) -> String {
    if test.log10_p >= -3.3 {
        return format!("{:.4}", test.p);
    }
    let mut exponent = test.log10_p.floor();
    let mut digits = 10f64.powf(test.log10_p - exponent);
    if digits >= 9.95 {
        (digits, exponent) = (1.0, exponent + 1.0);
    }
    format!("{digits:.1}e{exponent}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn p_values_are_told_however_small() {
        let text = |log10_p: f64| {
            p_value(&MannWhitney {
                sizes: [1, 1],
                u: [0.0, 1.0],
                p: 10f64.powf(log10_p),
                log10_p,
                exact: false,
            })
        };
        assert_eq!(text(-1.0), "0.1000");
        assert_eq!(text(-4.6), "2.5e-5");
        assert_eq!(text(-6.999), "1.0e-7");
        assert_eq!(text(-5_000.3), "5.0e-5001");
    }
}

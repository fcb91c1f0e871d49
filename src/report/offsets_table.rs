//! The supplement's figures: offsets of the pelvis' pose, and the sampled movements.

use super::errors_table::{SCENARIOS, scenario_title};
use super::reference::{MeanSd, PAPER};
use super::rows::Rows;
use super::table::{Table, mean_sd};
use crate::statistics::{StatisticsError, Summary};

/// Offsets of the pelvis in view 1 from the truth, in the APP: after the initialization, the single
/// view and the multi-view stages.
///
/// # Errors
/// When a value is not finite.
pub fn offsets(rows: &Rows) -> Result<Table, StatisticsError> {
    let phases = [
        ("initialization", "initialization"),
        ("single_view", "single view"),
        ("multi_view", "multi-view"),
    ];
    let mut body = Vec::new();
    for scenario in SCENARIOS {
        let own = rows.with("scenario", scenario);
        for (phase, title) in phases {
            let published = match phase {
                "initialization" => &PAPER.initialization_offset,
                _ => &PAPER.pelvis_offset_after_registration[scenario],
            };
            let rotation = summary(&own, &format!("pelvis_{phase}_rotation_deg"))?;
            let translation = summary(&own, &format!("pelvis_{phase}_translation_mm"))?;
            body.push(vec![
                scenario_title(scenario),
                title.into(),
                own.len().to_string(),
                rotation,
                paper(published.rotation),
                translation,
                paper(published.translation),
            ]);
        }
    }
    Ok(Table {
        name: "offsets".into(),
        title: "Offset of the pelvis from the truth, view 1, in the APP at the femoral head".into(),
        header: [
            "Scenario",
            "after",
            "n",
            "Rotation (deg)",
            "paper",
            "Translation (mm)",
            "paper",
        ]
        .map(String::from)
        .to_vec(),
        rows: body,
        notes: vec!["The paper does not say after which stage it measured; both are given.".into()],
    })
}

/// Rotation and translation of the sampled movements, one a case.
///
/// # Errors
/// When a value is not finite.
pub fn movements(rows: &Rows) -> Result<Table, StatisticsError> {
    let cases = one_row_a_case(rows);
    let line = |title: &str, column: &str, published: MeanSd| {
        Ok(vec![
            title.to_string(),
            cases.len().to_string(),
            summary(&cases, column)?,
            paper(published),
        ])
    };
    let sampling = &PAPER.sampling;
    Ok(Table {
        name: "movements".into(),
        title: "Sampled movements of the fragment after rejection of collisions".into(),
        header: ["Total", "n", "here", "paper (3600)"]
            .map(String::from)
            .to_vec(),
        rows: vec![
            line(
                "Rotation (deg)",
                "true_rotation_deg",
                sampling.fragment_rotation_total,
            )?,
            line(
                "Translation (mm)",
                "true_translation_mm",
                sampling.fragment_translation_total,
            )?,
        ],
        notes: Vec::new(),
    })
}

/// The first row of each case: what belongs to a case stands in all of its rows.
pub fn one_row_a_case(rows: &Rows) -> Rows {
    let key = |i: usize| {
        (
            &rows.text("specimen")[i],
            &rows.text("side")[i],
            rows.numbers("fragment")[i] as u64,
            rows.numbers("movement")[i] as u64,
        )
    };
    let mut seen = std::collections::BTreeSet::new();
    let first: Vec<bool> = (0..rows.len()).map(|i| seen.insert(key(i))).collect();
    rows.filter(|i| first[i])
}

fn summary(rows: &Rows, column: &str) -> Result<String, StatisticsError> {
    if rows.is_empty() {
        return Ok("-".into());
    }
    let summary = Summary::of(rows.numbers(column))?;
    Ok(mean_sd(summary.mean, summary.sd))
}

fn paper([mean, sd]: MeanSd) -> String {
    mean_sd(mean, sd)
}

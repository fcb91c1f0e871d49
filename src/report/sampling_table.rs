//! What the simulation drew, and how the fragment's shape was estimated.

use super::offsets_table::one_row_a_case;
use super::rows::Rows;
use super::table::{Table, mean_sd};
use crate::statistics::{StatisticsError, Summary};

/// What was drawn for the cases: rejections, LCE angles, views and picks.
///
/// # Errors
/// When a value is not finite.
pub fn sampling(rows: &Rows) -> Result<Table, StatisticsError> {
    let cases = one_row_a_case(rows);
    let fragments = one_row_a_fragment(rows);
    let lines: [(&str, &Rows, &str); 9] = [
        (
            "Random cuts rejected before a fragment",
            &fragments,
            "fragment_rejections",
        ),
        (
            "Movements rejected before a case",
            &cases,
            "movement_rejections",
        ),
        (
            "Voxels of moved bone on bone that stays",
            &cases,
            "overlap_voxels",
        ),
        (
            "LCE angle before the operation (deg)",
            &cases,
            "preoperative_lce_deg",
        ),
        ("LCE angle after it (deg)", &cases, "true_lce_deg"),
        (
            "Orbital angle of view 2 (deg)",
            &cases,
            "true_orbital_angle_2_deg",
        ),
        (
            "Orbital angle of view 3 (deg)",
            &cases,
            "true_orbital_angle_3_deg",
        ),
        ("Offset of the 3D pick (mm)", rows, "pick_point_offset_mm"),
        ("Offset of the 2D pick (px)", rows, "pick_pixel_offset_px"),
    ];
    let mut body = Vec::new();
    for (title, of, column) in lines {
        let values = known(of, column);
        if values.is_empty() {
            continue;
        }
        let s = Summary::of(&values)?;
        let range = format!("{:.2} to {:.2}", s.min, s.max);
        body.push(vec![
            title.into(),
            s.n.to_string(),
            mean_sd(s.mean, s.sd),
            range,
        ]);
    }
    Ok(Table {
        name: "sampling".into(),
        title: "What the simulation drew".into(),
        header: ["", "n", "mean +- SD", "range"].map(String::from).to_vec(),
        rows: body,
        notes: Vec::new(),
    })
}

/// How well the ilium and pubis cuts were estimated, and how often the planned cut stood in.
///
/// # Errors
/// When a value is not finite.
pub fn shape_estimation(rows: &Rows) -> Result<Table, StatisticsError> {
    let own = rows.with("scenario", "ilium_pubis_estimated");
    let nominal = rows.with("scenario", "no_cuts_known");
    let mut body = Vec::new();
    for cut in ["ilium", "pubis"] {
        let reasons = own.text(&format!("{cut}_fallback"));
        let estimated = own.filter(|i| reasons[i].is_empty());
        let fallbacks = own.len() - estimated.len();
        for (what, of) in [("estimated", &estimated), ("planned", &nominal)] {
            let summary = |column: String| -> Result<String, StatisticsError> {
                let values: Vec<f64> = known(of, &column).iter().map(|v| v.abs()).collect();
                if values.is_empty() {
                    return Ok("-".into());
                }
                let s = Summary::of(&values)?;
                Ok(mean_sd(s.mean, s.sd))
            };
            body.push(vec![
                cut.into(),
                what.into(),
                of.len().to_string(),
                if what == "estimated" {
                    fallbacks.to_string()
                } else {
                    "-".into()
                },
                summary(format!("{cut}_angle_error_deg"))?,
                summary(format!("{cut}_offset_error_mm"))?,
            ]);
        }
    }
    Ok(Table {
        name: "shape".into(),
        title: "Cut planes against the true ones (absolute errors)".into(),
        header: ["Cut", "plane", "n", "fallbacks", "Angle (deg)", "Offset (mm)"]
            .map(String::from)
            .to_vec(),
        rows: body,
        notes: vec![
            "A fallback is a registration whose estimate failed, so that the planned cut was used; it is left out of the \
             line above it. Offsets are at the foot of the perpendicular from the femoral head to the true plane."
                .into(),
        ],
    })
}

/// Values of a column that are there.
fn known(rows: &Rows, column: &str) -> Vec<f64> {
    let values = rows.numbers(column).iter().copied();
    values.filter(|value| !value.is_nan()).collect()
}

fn one_row_a_fragment(rows: &Rows) -> Rows {
    let key = |i: usize| {
        let fragment = rows.numbers("fragment")[i] as u64;
        (&rows.text("specimen")[i], &rows.text("side")[i], fragment)
    };
    let mut seen = std::collections::BTreeSet::new();
    let first: Vec<bool> = (0..rows.len()).map(|i| seen.insert(key(i))).collect();
    rows.filter(|i| first[i])
}

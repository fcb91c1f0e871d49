//! Points as CSV whose columns say their frame.

use super::error::PointsFileError;
use super::points::{PointsFile, coordinates};
use crate::anatomy::PatientFrame::{self, Lps, Ras};
use std::path::Path;

/// Columns that say the frame: our own, and those of the table that Slicer exports.
const COLUMNS: [(PatientFrame, [&str; 3]); 4] = [
    (Lps, ["x_lps_mm", "y_lps_mm", "z_lps_mm"]),
    (Ras, ["x_ras_mm", "y_ras_mm", "z_ras_mm"]),
    (Lps, ["l", "p", "s"]),
    (Ras, ["r", "a", "s"]),
];

/// The points of a file. Columns beyond name and coordinates are passed over, but for Slicer's
/// `defined`: a point with 0 there has no position.
///
/// # Errors
/// When there is no column of names, no frame or more than one, or a row is no point.
pub(super) fn parse(text: &str, path: &Path) -> Result<PointsFile, PointsFileError> {
    let format = |reason: String| PointsFileError::Format {
        path: path.into(),
        format: ".csv",
        reason,
    };
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let titles = reader.headers().map_err(|e| format(e.to_string()))?.clone();
    let column = |title: &str| titles.iter().position(|t| t.eq_ignore_ascii_case(title));
    let name = column("name").or_else(|| column("label")).ok_or_else(|| {
        format(format!(
            "its columns are '{}'; expected name,x_lps_mm,y_lps_mm,z_lps_mm or name,x_ras_mm,y_ras_mm,z_ras_mm",
            line(&titles)
        ))
    })?;
    let found: Vec<(PatientFrame, [usize; 3])> = COLUMNS
        .iter()
        .filter_map(|(frame, [x, y, z])| Some((*frame, [column(x)?, column(y)?, column(z)?])))
        .collect();
    let [(frame, axes)] = found[..] else {
        let titles = line(&titles);
        return Err(PointsFileError::Frame {
            path: path.into(),
            reason: match found.len() {
                0 => format!(
                    "its columns are '{titles}'; name them x_lps_mm,y_lps_mm,z_lps_mm (x to the patient's left, \
                     y posterior) or x_ras_mm,y_ras_mm,z_ras_mm (x to the right, y anterior)"
                ),
                _ => format!("its columns '{titles}' name two frames; keep one"),
            },
        });
    };
    let defined = column("defined");

    let mut file = PointsFile::default();
    for record in reader.records() {
        let record = record.map_err(|e| format(e.to_string()))?;
        if defined.is_some_and(|column| &record[column] == "0") {
            file.pass_over(format!("'{}' has no position (defined 0)", &record[name]));
            continue;
        }
        let xyz = coordinates(axes.iter().map(|&axis| &record[axis])).map_err(|reason| {
            let line = record.position().map_or(0, |p| p.line());
            format(format!("line {line}: {reason}"))
        })?;
        file.add(&record[name], frame.to_lps(xyz));
    }
    Ok(file)
}

fn line(titles: &csv::StringRecord) -> String {
    titles.iter().collect::<Vec<_>>().join(",")
}

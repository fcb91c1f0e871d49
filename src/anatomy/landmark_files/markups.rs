//! Slicer's `.mrk.json`: markups of schema 1.x.

use super::error::PointsFileError;
use super::points::{NamedCurve, PointsFile};
use crate::anatomy::PatientFrame;
use crate::geometry::Point;
use serde::Deserialize;
use serde_json::Value;
use std::path::Path;

/// What every version of the schema that Slicer reads is named.
const SCHEMA: &str = "markups-schema-v1.";

#[derive(Deserialize)]
struct File {
    #[serde(rename = "@schema")]
    schema: String,
    markups: Vec<Markup>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Markup {
    #[serde(rename = "type")]
    kind: String,
    #[serde(default)]
    name: String,
    coordinate_system: Option<Value>,
    coordinate_units: Option<Value>,
    #[serde(default)]
    control_points: Vec<ControlPoint>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct ControlPoint {
    #[serde(default)]
    label: String,
    /// Empty or anything where the position is not defined.
    #[serde(default)]
    position: Value,
    position_status: Option<String>,
}

/// The control points of a file: those of closed curves as curves, those of point lists, lines,
/// angles and open curves as points. Planes and regions have no points of anatomy.
///
/// # Errors
/// When it is no Markups file, or a markup states no frame, another unit than mm, or a position
/// that is none.
pub(super) fn parse(text: &str, path: &Path) -> Result<PointsFile, PointsFileError> {
    let format = |reason: String| PointsFileError::Format {
        path: path.into(),
        format: ".mrk.json",
        reason,
    };
    let file: File = serde_json::from_str(text).map_err(|e| format(e.to_string()))?;
    if !file.schema.to_ascii_lowercase().contains(SCHEMA) {
        return Err(format(format!(
            "its @schema is '{}'; expected {SCHEMA}x.json of 3D Slicer",
            file.schema
        )));
    }
    let mut found = PointsFile::default();
    for (n, markup) in file.markups.iter().enumerate() {
        let what = format!("markup {n} ('{}')", markup.name);
        let curve = match markup.kind.as_str() {
            "Fiducial" | "Line" | "Angle" | "Curve" => false,
            "ClosedCurve" => true,
            other => {
                found.pass_over(format!("{what} is a {other}, no list of points"));
                continue;
            }
        };
        let frame =
            frame(markup.coordinate_system.as_ref()).map_err(|reason| PointsFileError::Frame {
                path: path.into(),
                reason: format!("{what} {reason}"),
            })?;
        check_unit(markup.coordinate_units.as_ref()).map_err(|unit| PointsFileError::Unit {
            path: path.into(),
            found: unit,
        })?;
        let mut along = Vec::new();
        for (m, point) in markup.control_points.iter().enumerate() {
            let which = format!("point {m} ('{}') of {what}", point.label);
            match point.position_status.as_deref() {
                None if point.position.is_null() => {
                    found.pass_over(format!("{which} has no position"));
                    continue;
                }
                None | Some("defined") => {}
                Some(status) => {
                    found.pass_over(format!("{which} has no position ({status})"));
                    continue;
                }
            }
            let at = position(&point.position, frame).ok_or_else(|| {
                format(format!(
                    "the position of {which} is {}; expected three numbers",
                    point.position
                ))
            })?;
            if curve {
                along.push(at);
            } else {
                found.add(&point.label, at);
            }
        }
        if curve {
            // Newer versions of Slicer save each curve to a file that is named for it, and no name in it.
            let name = match markup.name.trim() {
                "" if file.markups.len() == 1 => stem(path),
                name => name.to_owned(),
            };
            found.closed_curves.push(NamedCurve {
                name,
                points: along,
            });
        }
    }
    Ok(found)
}

/// A file's name without `.mrk.json`.
fn stem(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.split('.').next().unwrap_or_default().to_owned()
}

/// The schema takes LPS where nothing is said; here that is too little.
fn frame(stated: Option<&Value>) -> Result<PatientFrame, String> {
    let stated = match stated {
        None | Some(Value::Null) => {
            return Err("has no coordinateSystem; write \"LPS\" or \"RAS\" there".into());
        }
        Some(Value::String(text)) => text.clone(),
        Some(other) => other.to_string(),
    };
    match stated.as_str() {
        // As files of the first versions of Slicer 4.11 have it.
        "0" => Ok(PatientFrame::Ras),
        "1" => Ok(PatientFrame::Lps),
        _ => stated
            .parse()
            .map_err(|()| format!("has the coordinateSystem {stated}; expected LPS or RAS")),
    }
}

/// Nothing is mm, as the schema has it; a coded unit begins with its code.
fn check_unit(stated: Option<&Value>) -> Result<(), String> {
    let code = match stated {
        None | Some(Value::Null) => return Ok(()),
        Some(Value::Array(code)) => code.first().unwrap_or(&Value::Null),
        Some(other) => other,
    };
    match code.as_str() {
        Some("mm") => Ok(()),
        _ => Err(code.to_string()),
    }
}

fn position(value: &Value, frame: PatientFrame) -> Option<Point> {
    let numbers: Option<Vec<f64>> = value.as_array()?.iter().map(Value::as_f64).collect();
    let xyz: [f64; 3] = numbers?.try_into().ok()?;
    Some(frame.to_lps(xyz))
}

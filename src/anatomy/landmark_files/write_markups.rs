//! Landmarks and rims as a file that Slicer 5 opens, to be corrected there by hand.

use super::error::PointsFileError;
use crate::anatomy::{Landmark, Landmarks, Side};
use crate::geometry::Point;
use serde_json::{Value, json};
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// The version that Slicer 4.13 and 5 write.
const SCHEMA: &str = "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#";

/// Writes a new `.mrk.json` file: a list of all landmarks, named by [`crate::anatomy::Landmark::key`], and
/// a closed curve `rim_l` and `rim_r` for the rims. LPS, mm, every number to its last bit;
/// [`super::read_landmark_overrides`] reads it. A landmark that is not there becomes a point without a
/// position, which Slicer shows as such and lets people place, an empty rim a curve without points.
///
/// # Errors
/// When the file exists, since somebody may have corrected it, or the disk refuses.
pub fn write_markups(
    landmarks: &Landmarks,
    rims: [&[Point]; 2],
    path: &Path,
) -> Result<(), PointsFileError> {
    let all = Landmark::ALL.into_iter();
    let points = all.flat_map(|landmark| {
        Side::BOTH.map(|side| control_point(&landmark.key(side), landmarks.get(landmark, side)))
    });
    let mut markups = vec![markup("Fiducial", "landmarks", points.collect())];
    for side in Side::BOTH {
        let name = format!("rim_{}", &side.name()[..1]);
        let points = rims[side.index()].iter().enumerate();
        let points =
            points.map(|(n, &at)| control_point(&format!("{name}_{:02}", n + 1), Some(at)));
        markups.push(markup("ClosedCurve", &name, points.collect()));
    }
    let file = json!({"@schema": SCHEMA, "markups": markups});
    let text = serde_json::to_string_pretty(&file).expect("texts and numbers are JSON");

    let io = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::AlreadyExists => PointsFileError::Exists(path.into()),
        _ => PointsFileError::Io {
            doing: "write",
            path: path.into(),
            source,
        },
    };
    let mut file = File::create_new(path).map_err(io)?;
    file.write_all(text.as_bytes()).map_err(io)?;
    file.sync_all().map_err(io)
}

fn markup(kind: &str, name: &str, points: Vec<Value>) -> Value {
    json!({
        "type": kind,
        "name": name,
        "coordinateSystem": "LPS",
        "coordinateUnits": "mm",
        "controlPoints": points,
    })
}

/// As Slicer writes them, those without a position too.
fn control_point(label: &str, at: Option<Point>) -> Value {
    let (position, status) = match at {
        Some(at) => (json!([at.x, at.y, at.z]), "defined"),
        None => (json!(""), "undefined"),
    };
    json!({
        "label": label,
        "position": position,
        "positionStatus": status,
    })
}

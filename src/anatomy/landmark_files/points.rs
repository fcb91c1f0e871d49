//! Named points from a file of any format.

use super::error::PointsFileError;
use super::{csv_table, fcsv, markups};
use crate::geometry::Point;
use std::collections::BTreeSet;
use std::path::Path;

/// A point that has a name. LPS, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPoint {
    /// As the file spells it; never empty.
    pub name: String,
    pub point: Point,
}

/// The control points of a closed curve, in their order along it. LPS, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCurve {
    /// As the file spells it; may be empty.
    pub name: String,
    pub points: Vec<Point>,
}

/// What a file of points holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointsFile {
    /// In the file's order; no name is there twice.
    pub points: Vec<NamedPoint>,
    /// Closed curves, whose control points are not among `points`.
    pub closed_curves: Vec<NamedCurve>,
    /// A line for each point that has no position, or no name, and was passed over.
    pub passed_over: Vec<String>,
}

impl PointsFile {
    /// Takes a point, if it has a name.
    pub(super) fn add(&mut self, name: &str, point: Point) {
        let name = name.trim();
        if name.is_empty() {
            let [x, y, z] = [point.x, point.y, point.z];
            self.pass_over(format!("a point at LPS ({x}, {y}, {z}) has no name"));
        } else {
            self.points.push(NamedPoint {
                name: name.to_owned(),
                point,
            });
        }
    }

    pub(super) fn pass_over(&mut self, line: String) {
        self.passed_over.push(line);
    }
}

/// Reads the named points of a `.fcsv`, `.mrk.json` or `.csv` file ([`super`] says which) into LPS.
/// Points that Slicer holds for undefined, still being placed or missing are passed over; hidden,
/// locked and unselected ones count.
///
/// # Errors
/// When the file cannot be read, does not say its frame or is in another unit than mm, or has a
/// name twice.
pub fn read_points(path: &Path) -> Result<PointsFile, PointsFileError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.to_ascii_lowercase();
    let parse = if name.ends_with(".fcsv") {
        fcsv::parse
    } else if name.ends_with(".json") {
        markups::parse
    } else if name.ends_with(".csv") {
        csv_table::parse
    } else {
        return Err(PointsFileError::UnknownFormat(path.into()));
    };
    let bytes = std::fs::read(path).map_err(|source| PointsFileError::Io {
        doing: "read",
        path: path.into(),
        source,
    })?;
    // Names of points in another encoding lose a letter, not the point.
    let text = String::from_utf8_lossy(&bytes);
    // Some editors begin a text with a mark of its encoding.
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    let file = parse(text, path)?;
    let mut names = BTreeSet::new();
    for point in &file.points {
        if !names.insert(point.name.as_str()) {
            return Err(PointsFileError::Duplicate {
                path: path.into(),
                name: point.name.clone(),
            });
        }
    }
    for line in &file.passed_over {
        tracing::info!("{}: {line}; passed over", path.display());
    }
    Ok(file)
}

/// Three coordinates, if each is a finite number.
pub(super) fn coordinates<'a>(words: impl Iterator<Item = &'a str>) -> Result<[f64; 3], String> {
    let mut xyz = [0.0; 3];
    let mut words = words;
    for value in &mut xyz {
        let word = words.next().unwrap_or_default().trim();
        *value = word
            .parse()
            .ok()
            .filter(|v: &f64| v.is_finite())
            .ok_or_else(|| format!("'{word}' is no coordinate; expected mm"))?;
    }
    Ok(xyz)
}

//! Slicer's `.fcsv`: points as comma-separated lines under three lines of header.

use super::error::PointsFileError;
use super::points::{PointsFile, coordinates};
use crate::anatomy::PatientFrame;
use std::collections::BTreeMap;
use std::path::Path;

const FORMAT: &str = ".fcsv";

const COLUMNS: &str = "id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID";

/// The column of a point's name, and that of the status of its position, which Slicer writes since
/// version 5 without a title.
const LABEL: usize = 11;
const STATUS: usize = 14;

/// The status of a position that is there. The others: 0 undefined, 1 being placed, 3 missing.
const DEFINED: &str = "2";

/// The points of a file.
///
/// # Errors
/// When version or frame are none that Slicer ever wrote, or a line is no point.
pub(super) fn parse(text: &str, path: &Path) -> Result<PointsFile, PointsFileError> {
    let format = |reason: String| PointsFileError::Format {
        path: path.into(),
        format: FORMAT,
        reason,
    };
    let header = header(text).map_err(format)?;
    let version = version(header.get("Markups fiducial file version")).map_err(format)?;
    if let Some(columns) = header.get("columns")
        && !columns.replace(' ', "").eq_ignore_ascii_case(COLUMNS)
    {
        return Err(format(format!(
            "its columns are '{columns}'; expected {COLUMNS}"
        )));
    }
    let frame = frame(version, header.get("CoordinateSystem").copied()).map_err(|reason| {
        PointsFileError::Frame {
            path: path.into(),
            reason,
        }
    })?;

    let mut file = PointsFile::default();
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .from_reader(text.as_bytes());
    for record in reader.records() {
        let record = record.map_err(|e| format(e.to_string()))?;
        let at = |reason: String| {
            let line = record.position().map_or(0, |p| p.line());
            format(format!("line {line}: {reason}"))
        };
        if ![14, 16].contains(&record.len()) {
            return Err(at(format!(
                "it has {} columns; expected 14, or 16 as Slicer 5 writes them",
                record.len()
            )));
        }
        let name = &record[LABEL];
        match record.get(STATUS).map(str::trim) {
            None | Some(DEFINED) => {}
            Some(status) => {
                file.pass_over(format!(
                    "'{name}' has no position (status {status}, expected 2, defined)"
                ));
                continue;
            }
        }
        let xyz = coordinates(record.iter().skip(1)).map_err(at)?;
        file.add(name, frame.to_lps(xyz));
    }
    Ok(file)
}

/// The lines `# key = value`.
fn header(text: &str) -> Result<BTreeMap<&str, &str>, String> {
    let mut header = BTreeMap::new();
    let comments = text.lines().filter_map(|line| line.strip_prefix('#'));
    for (key, value) in comments.filter_map(|line| line.split_once('=')) {
        let (key, value) = (key.trim(), value.trim());
        if header
            .insert(key, value)
            .is_some_and(|before| before != value)
        {
            return Err(format!("its header has two different lines '{key}'"));
        }
    }
    Ok(header)
}

/// Slicer's version that wrote the file: 4.3 brought the format, 4.11 other words for the frame.
fn version(stated: Option<&&str>) -> Result<(u32, u32), String> {
    let Some(stated) = stated else {
        return Err("it has no line '# Markups fiducial file version = ...'".into());
    };
    let mut numbers = stated.split('.').map(|n| n.parse::<u32>().ok());
    match (numbers.next().flatten(), numbers.next().flatten()) {
        (Some(4), Some(minor @ 3..=13)) => Ok((4, minor)),
        (Some(5), Some(minor)) => Ok((5, minor)),
        _ => Err(format!(
            "its version is {stated}; expected 4.3 to 4.13 or 5.x"
        )),
    }
}

/// The frame that the header's words mean in a version.
fn frame(version: (u32, u32), stated: Option<&str>) -> Result<PatientFrame, String> {
    let Some(stated) = stated else {
        return Err("it has no line '# CoordinateSystem = ...'; write RAS or LPS there".into());
    };
    match (version, stated) {
        (_, "0") => Ok(PatientFrame::Ras),
        // These wrote 0 always, and a number that says otherwise is somebody's mistake.
        ((4, ..=10), _) => Err(format!(
            "CoordinateSystem is {stated}; expected 0 (RAS) in a file of version 4.{}",
            version.1
        )),
        (_, "1") => Ok(PatientFrame::Lps),
        _ => stated
            .parse()
            .map_err(|()| format!("CoordinateSystem is {stated}; expected RAS, LPS, 0 or 1")),
    }
}

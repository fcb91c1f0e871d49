//! The axes of the array: which of them lie in the world, and where.

use super::header::Header;
use crate::volume::header_fields::HeaderFields;
use crate::volume::place::grid_from_affine;
use crate::volume::{Grid, VolumeFileError};
use nalgebra::{Matrix3, Matrix3x4, Vector3};

/// Words for a length of one millimetre; an empty one or `???` says nothing, and mm is meant then.
const MILLIMETRE: [&str; 7] = [
    "mm",
    "millimeter",
    "millimeters",
    "millimetre",
    "millimetres",
    "",
    "???",
];

/// The kinds of axes that lie in the world, or may.
const SPATIAL: [&str; 4] = ["domain", "space", "???", "none"];

/// Nobody draws so many segments, and a voxel's labels in all layers are held at once.
const MAX_LAYERS: i64 = 4096;

/// The grid (LPS) of a file with one value a voxel.
///
/// # Errors
/// As [`layered_grid_of`] has them, and when a segmentation has several layers.
pub(super) fn grid_of(header: &Header) -> Result<Grid, VolumeFileError> {
    match layered_grid_of(header)? {
        (grid, 1) => Ok(grid),
        (_, layers) => Err(overlap(&header.fields, layers)),
    }
}

/// The grid (LPS) that a header describes, and how many values each voxel has: one, or where segments of a
/// segmentation overlap one for each of its layers, which follow each other in the file.
///
/// # Errors
/// When it has not three axes of more than one voxel in the world, is not placed in LPS, RAS or LAS
/// mm, or holds several values a voxel that are no layers.
pub(super) fn layered_grid_of(header: &Header) -> Result<(Grid, usize), VolumeFileError> {
    let sizes = header.fields.sizes("dimension", "sizes")?;
    let lps = lps_from_space(&header.fields)?;
    check_units(&header.fields)?;
    let directions = directions(&header.fields, sizes.len())?;
    check_kinds(&header.fields, &directions)?;
    let spatial: Vec<usize> = (0..sizes.len())
        .filter(|&axis| directions[axis].is_some())
        .collect();
    let layers = match has_layers(header, &directions) {
        true => sizes[0],
        false => 1,
    };
    if !(1..=MAX_LAYERS).contains(&layers) {
        return Err(header.fields.wrong(format!(
            "its segments lie in {layers} layers; expected 1 to {MAX_LAYERS}"
        )));
    }
    for axis in 0..sizes.len() {
        let expected = if axis == 0 { layers } else { 1 };
        if directions[axis].is_none() && sizes[axis] != expected {
            return Err(header.fields.wrong(format!(
                "its axis {axis} does not lie in space and has {} values; expected one value a voxel",
                sizes[axis]
            )));
        }
    }
    let &[i, j, k] = spatial.as_slice() else {
        return Err(header.fields.dimensions(sizes));
    };
    let dims = [i, j, k].map(|axis| usize::try_from(sizes[axis]).unwrap_or(0));
    if dims.iter().any(|&d| d < 2) {
        return Err(header.fields.dimensions(sizes));
    }
    let origin = header.fields.get("space origin").ok_or_else(|| {
        let reason = "its header has no 'space origin'; write it anew with its place";
        header.fields.no_place(reason.into())
    })?;
    let origin = vector(origin).ok_or_else(|| {
        header.fields.no_place(format!(
            "its 'space origin' is '{origin}'; expected (x,y,z)"
        ))
    })?;
    let columns = [i, j, k].map(|axis| directions[axis].expect("a spatial axis has a direction"));
    let [x, y, z] = columns.map(|column| lps * column);
    let lps_from_index = Matrix3x4::from_columns(&[x, y, z, lps * origin]);
    let grid =
        grid_from_affine(&lps_from_index, dims).map_err(|reason| header.fields.no_place(reason))?;
    Ok((grid, layers as usize))
}

/// True when the first axis is that of a segmentation's layers, as Slicer writes them.
fn has_layers(header: &Header, directions: &[Option<Vector3<f64>>]) -> bool {
    let kind = header
        .fields
        .get("kinds")
        .and_then(|k| k.split_whitespace().next());
    !header.segment_keys.is_empty()
        && directions.first() == Some(&None)
        && kind.is_none_or(|kind| kind.eq_ignore_ascii_case("list"))
}

/// Says that a file of several layers is no label map.
pub(super) fn overlap(fields: &HeaderFields, layers: usize) -> VolumeFileError {
    fields.wrong(format!(
        "its segments overlap: they lie in {layers} layers and a label map has one; in Slicer, export the \
         segments that are needed as one label map (module Segmentations, Export/import models and \
         labelmaps) and save that"
    ))
}

/// What turns vectors of the header's world into LPS.
fn lps_from_space(fields: &HeaderFields) -> Result<Matrix3<f64>, VolumeFileError> {
    let space = fields.get("space").map(str::to_ascii_lowercase);
    let signs = match space.as_deref() {
        Some("left-posterior-superior" | "lps") => [1.0, 1.0, 1.0],
        Some("right-anterior-superior" | "ras") => [-1.0, -1.0, 1.0],
        Some("left-anterior-superior" | "las") => [1.0, -1.0, 1.0],
        other => {
            let says = match other {
                Some(space) => format!("its 'space' is '{space}'"),
                None => "its header has no 'space'".into(),
            };
            return Err(fields.no_place(format!(
                "{says}, which does not tell left from right; write it anew as \
                 left-posterior-superior, right-anterior-superior or left-anterior-superior"
            )));
        }
    };
    Ok(Matrix3::from_diagonal(&signs.into()))
}

fn check_units(fields: &HeaderFields) -> Result<(), VolumeFileError> {
    let units = fields.get("space units").unwrap_or_default();
    // Each is quoted: the odd pieces lie inside quotes.
    for unit in units.split('"').skip(1).step_by(2) {
        if !MILLIMETRE.contains(&unit.trim().to_ascii_lowercase().as_str()) {
            return Err(fields.unit("'space units'", unit));
        }
    }
    Ok(())
}

/// Each axis' step in the header's world, `None` for an axis that does not lie in it.
fn directions(
    fields: &HeaderFields,
    axes: usize,
) -> Result<Vec<Option<Vector3<f64>>>, VolumeFileError> {
    let Some(text) = fields.get("space directions") else {
        let reason = "its header has no 'space directions'; write it anew with its place";
        return Err(fields.no_place(reason.into()));
    };
    let wrong = || {
        fields.no_place(format!(
            "its 'space directions' are '{text}'; expected (x,y,z) or none for each of {axes} axes"
        ))
    };
    let mut found = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        let (entry, after) = match rest.strip_prefix("none") {
            Some(after) => (None, after),
            None => {
                let end = rest.find(')').ok_or_else(wrong)? + 1;
                (Some(vector(&rest[..end]).ok_or_else(wrong)?), &rest[end..])
            }
        };
        found.push(entry);
        rest = after.trim_start();
    }
    if found.len() != axes {
        return Err(wrong());
    }
    Ok(found)
}

/// `(x,y,z)`
fn vector(text: &str) -> Option<Vector3<f64>> {
    let inside = text.trim().strip_prefix('(')?.strip_suffix(')')?;
    let numbers: Option<Vec<f64>> = inside.split(',').map(|n| n.trim().parse().ok()).collect();
    let [x, y, z] = numbers?.try_into().ok()?;
    Some(Vector3::new(x, y, z))
}

/// An axis of colours or moments has no direction; a file that gives it one contradicts itself.
fn check_kinds(
    fields: &HeaderFields,
    directions: &[Option<Vector3<f64>>],
) -> Result<(), VolumeFileError> {
    let kinds = fields.get("kinds").unwrap_or_default();
    for (axis, kind) in kinds.split_whitespace().enumerate() {
        let spatial = SPATIAL.contains(&kind.to_ascii_lowercase().as_str());
        if !spatial && matches!(directions.get(axis), Some(Some(_))) {
            return Err(fields.no_place(format!(
                "its axis {axis} is of the kind '{kind}' and yet has a direction in space"
            )));
        }
    }
    Ok(())
}

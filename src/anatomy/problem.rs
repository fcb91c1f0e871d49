//! What can be wrong with a specimen, and the check that finds all of it at once.

use super::{Label, Landmark, Side, Specimen};
use crate::geometry::Point;
use crate::volume::Grid;

/// A rim's trace has at least this many points.
pub const MIN_RIM_POINTS: usize = 24;

/// Neighbouring points of a rim's trace are at most this far apart (mm).
pub const MAX_RIM_GAP_MM: f64 = 10.0;

/// What a specimen's sex may be.
pub const SEXES: [&str; 3] = ["male", "female", "unknown"];

/// Whether a name can be a specimen's: letters, digits and `-`, since it goes into keys.
pub fn is_specimen_name(name: &str) -> bool {
    !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-')
}

/// One thing that is wrong with a specimen.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpecimenProblem {
    #[error("file {0} is missing")]
    MissingFile(String),
    #[error("{file}: {reason}")]
    Unreadable { file: String, reason: String },
    #[error("name '{0}'; expected letters, digits and '-' only")]
    Name(String),
    #[error("sex is '{0}'; expected male, female or unknown")]
    Sex(String),
    #[error(
        "the label map's grid ({labels}) is not the CT's ({ct}); resample the labels to the CT with nearest neighbours"
    )]
    GridsDiffer { ct: String, labels: String },
    #[error("no voxel has label {value} ({name})")]
    LabelAbsent { value: u8, name: &'static str },
    #[error(
        "{count} voxels have the unknown label {value}, the first at {voxel:?}; expected 0 background, 1 pelvis, 2 left femur, 3 right femur"
    )]
    UnknownLabel {
        value: u8,
        count: usize,
        voxel: [usize; 3],
    },
    #[error("landmark {0} is missing")]
    LandmarkMissing(String),
    #[error("{what} ({x:.1}, {y:.1}, {z:.1}) lies outside the CT; is it in LPS mm?")]
    Outside {
        what: String,
        x: f64,
        y: f64,
        z: f64,
    },
    #[error("the {side} rim has {found} points; expected {MIN_RIM_POINTS} or more")]
    RimTooShort { side: Side, found: usize },
    #[error(
        "the {side} rim jumps {gap_mm:.1} mm after point {after}; expected an ordered closed line with steps of {MAX_RIM_GAP_MM} mm at most"
    )]
    RimGap {
        side: Side,
        after: usize,
        gap_mm: f64,
    },
}

/// All that is wrong with a specimen before any surgery; empty for a sound one.
pub fn specimen_problems(specimen: &Specimen) -> Vec<SpecimenProblem> {
    let mut problems = Vec::new();
    check_source(specimen, &mut problems);
    if specimen.ct.grid != specimen.labels.grid {
        problems.push(SpecimenProblem::GridsDiffer {
            ct: describe(&specimen.ct.grid),
            labels: describe(&specimen.labels.grid),
        });
    }
    check_labels(specimen, &mut problems);
    for name in specimen.landmarks.missing() {
        problems.push(SpecimenProblem::LandmarkMissing(name));
    }
    for (landmark, side, point) in specimen.landmarks.iter() {
        check_inside(
            specimen,
            || landmark_name(landmark, side),
            &point,
            &mut problems,
        );
    }
    for side in Side::BOTH {
        check_rim(specimen, side, &mut problems);
    }
    problems
}

fn landmark_name(landmark: Landmark, side: Side) -> String {
    format!("landmark {}", landmark.key(side))
}

fn check_source(specimen: &Specimen, problems: &mut Vec<SpecimenProblem>) {
    let name = &specimen.name;
    if !is_specimen_name(name) {
        problems.push(SpecimenProblem::Name(name.clone()));
    }
    let sex = &specimen.source.sex;
    if !SEXES.contains(&sex.as_str()) {
        problems.push(SpecimenProblem::Sex(sex.clone()));
    }
}

fn check_labels(specimen: &Specimen, problems: &mut Vec<SpecimenProblem>) {
    let mut counts = [0usize; 256];
    let mut first = [usize::MAX; 256];
    for (offset, &value) in specimen.labels.data.iter().enumerate() {
        counts[usize::from(value)] += 1;
        if first[usize::from(value)] == usize::MAX {
            first[usize::from(value)] = offset;
        }
    }
    for (label, name) in [
        (Label::Pelvis, "pelvis"),
        (Label::FemurLeft, "left femur"),
        (Label::FemurRight, "right femur"),
    ] {
        if counts[usize::from(label.value())] == 0 {
            let value = label.value();
            problems.push(SpecimenProblem::LabelAbsent { value, name });
        }
    }
    for value in Label::FemurRight.value() + 1..=u8::MAX {
        let count = counts[usize::from(value)];
        if count > 0 {
            problems.push(SpecimenProblem::UnknownLabel {
                value,
                count,
                voxel: specimen.labels.grid.voxel(first[usize::from(value)]),
            });
        }
    }
}

fn check_inside(
    specimen: &Specimen,
    what: impl Fn() -> String,
    point: &Point,
    problems: &mut Vec<SpecimenProblem>,
) {
    if specimen.ct.grid.nearest(point).is_none() {
        problems.push(SpecimenProblem::Outside {
            what: what(),
            x: point.x,
            y: point.y,
            z: point.z,
        });
    }
}

fn check_rim(specimen: &Specimen, side: Side, problems: &mut Vec<SpecimenProblem>) {
    let rim = specimen.rim(side);
    if rim.len() < MIN_RIM_POINTS {
        problems.push(SpecimenProblem::RimTooShort {
            side,
            found: rim.len(),
        });
    }
    for (n, point) in rim.iter().enumerate() {
        check_inside(
            specimen,
            || format!("{side} rim point {n}"),
            point,
            problems,
        );
        let gap_mm = (rim[(n + 1) % rim.len()] - point).norm();
        if gap_mm > MAX_RIM_GAP_MM {
            problems.push(SpecimenProblem::RimGap {
                side,
                after: n,
                gap_mm,
            });
        }
    }
}

fn describe(grid: &Grid) -> String {
    let [i, j, k] = grid.dims;
    let [a, b, c] = grid.spacing;
    let o = grid.origin;
    let d = grid.direction;
    format!(
        "{i} x {j} x {k} voxels of {a} x {b} x {c} mm from ({}, {}, {}), axes ({}, {}, {}), ({}, {}, {}), ({}, {}, {})",
        o.x,
        o.y,
        o.z,
        d[(0, 0)],
        d[(1, 0)],
        d[(2, 0)],
        d[(0, 1)],
        d[(1, 1)],
        d[(2, 1)],
        d[(0, 2)],
        d[(1, 2)],
        d[(2, 2)],
    )
}

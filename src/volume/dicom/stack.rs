//! Slices in their order, and the grid that they make.

use super::data_set::attribute;
use super::problem::DicomProblem;
use super::slice::Slice;
use crate::geometry::Vector;
use crate::volume::place::grid_from_affine;
use crate::volume::{Grid, VolumeFileError};
use dicom_core::Tag;
use dicom_dictionary_std::tags;
use nalgebra::Matrix3x4;
use std::path::Path;

/// How far a slice may lie from where equal spacing puts it, along the normal and beside it: this
/// many mm, and this share of the spacing. Positions are rounded to a tenth of a mm at worst.
const MAX_OFF_MM: f64 = 0.1;
const MAX_OFF_SHARE: f64 = 0.1;

/// Slices closer than this many mm lie at the same place.
const SAME_PLACE_MM: f64 = 1e-3;

/// How far direction cosines may differ within a series: the rounding of decimal strings.
const MAX_COSINE_DIFFERENCE: f64 = 1e-4;

/// Puts the slices in order along their normal (rows x columns), so that k grows with it, and
/// returns the grid that they make.
///
/// # Errors
/// When they are not slices of one grid with right angles and one spacing.
pub(super) fn stack(slices: &mut [Slice], folder: &Path) -> Result<Grid, VolumeFileError> {
    for slice in slices.iter().skip(1) {
        check_alike(slice, &slices[0])?;
    }
    let normal = slices[0].normal();
    let along = |slice: &Slice| slice.position.coords.dot(&normal);
    slices.sort_by(|a, b| along(a).total_cmp(&along(b)).then(a.path().cmp(b.path())));
    let [first, .., last] = &*slices else {
        return Err(DicomProblem::OneSlice.at(slices[0].path()));
    };
    for pair in slices.windows(2) {
        if along(&pair[1]) - along(&pair[0]) < SAME_PLACE_MM {
            let other = pair[0].path().into();
            let at_mm = along(&pair[1]);
            return Err(DicomProblem::SamePlace { other, at_mm }.at(pair[1].path()));
        }
    }
    check_gaps(slices, along)?;
    let spacing = (along(last) - along(first)) / (slices.len() - 1) as f64;
    check_line(slices, &normal, spacing, folder)?;
    let affine = Matrix3x4::from_columns(&[
        first.along_row * first.spacing[0],
        first.along_column * first.spacing[1],
        normal * spacing,
        first.position.coords,
    ]);
    grid_from_affine(&affine, [first.columns, first.rows, slices.len()]).map_err(|reason| {
        VolumeFileError::Place {
            path: first.path().into(),
            reason,
        }
    })
}

fn check_alike(slice: &Slice, first: &Slice) -> Result<(), VolumeFileError> {
    let differs = |tag: Tag| {
        let text = |s: &Slice| s.data.text(tag).unwrap_or_else(|| "nothing".into());
        Err(DicomProblem::Differs {
            attribute: attribute(tag),
            found: text(slice),
            other: first.path().into(),
            expected: text(first),
        }
        .at(slice.path()))
    };
    if slice.rows != first.rows {
        return differs(tags::ROWS);
    }
    if slice.columns != first.columns {
        return differs(tags::COLUMNS);
    }
    let apart = (slice.along_row - first.along_row).amax()
        + (slice.along_column - first.along_column).amax();
    if apart > MAX_COSINE_DIFFERENCE {
        return differs(tags::IMAGE_ORIENTATION_PATIENT);
    }
    if (0..2).any(|a| (slice.spacing[a] / first.spacing[a] - 1.0).abs() > 1e-6) {
        return differs(tags::PIXEL_SPACING);
    }
    if slice.frame_of_reference != first.frame_of_reference {
        return differs(tags::FRAME_OF_REFERENCE_UID);
    }
    Ok(())
}

/// Says so when a slice is missing, or the slices are not equidistant.
fn check_gaps(slices: &[Slice], along: impl Fn(&Slice) -> f64) -> Result<(), VolumeFileError> {
    let gaps: Vec<f64> = slices
        .windows(2)
        .map(|pair| along(&pair[1]) - along(&pair[0]))
        .collect();
    let mut sorted = gaps.clone();
    sorted.sort_by(f64::total_cmp);
    // The lower median: of two gaps the smaller is the spacing and the other one has a hole.
    let spacing_mm = sorted[(sorted.len() - 1) / 2];
    let allowed = 2.0 * max_off(spacing_mm);
    for (pair, &gap_mm) in slices.windows(2).zip(&gaps) {
        if (gap_mm - spacing_mm).abs() <= allowed {
            continue;
        }
        let before = pair[0].path().into();
        let whole = (gap_mm / spacing_mm).round();
        let problem = if whole >= 2.0 && (gap_mm - whole * spacing_mm).abs() <= allowed {
            DicomProblem::Gap {
                before,
                gap_mm,
                spacing_mm,
                missing: match whole {
                    2.0 => "1 slice is".into(),
                    n => format!("{} slices are", n - 1.0),
                },
            }
        } else {
            DicomProblem::Uneven {
                before,
                gap_mm,
                spacing_mm,
            }
        };
        return Err(problem.at(pair[1].path()));
    }
    Ok(())
}

/// Says so when the slices do not lie one behind the other along their normal, where equal
/// spacing puts them.
fn check_line(
    slices: &[Slice],
    normal: &Vector,
    spacing_mm: f64,
    folder: &Path,
) -> Result<(), VolumeFileError> {
    let first = slices[0].position;
    let allowed = max_off(spacing_mm);
    // Where equal spacing puts each slice, seen from where it is.
    let off: Vec<Vector> = (0..slices.len())
        .map(|k| slices[k].position - first - normal * (spacing_mm * k as f64))
        .collect();
    let beside: Vec<Vector> = off.iter().map(|v| v - normal * v.dot(normal)).collect();
    if beside.iter().any(|v| v.norm() > allowed) {
        let step = beside[slices.len() - 1] / (slices.len() - 1) as f64;
        let linear = |(k, v): (usize, &Vector)| (v - step * k as f64).norm() <= allowed;
        if beside.iter().enumerate().all(linear) {
            let shift_mm = step.norm();
            return Err(DicomProblem::Tilt {
                shift_mm,
                spacing_mm,
                angle_deg: shift_mm.atan2(spacing_mm).to_degrees(),
            }
            .at(folder));
        }
        let (k, off_mm) = farthest_from_median(&beside);
        return Err(DicomProblem::Shifted { off_mm }.at(slices[k].path()));
    }
    if off.iter().all(|v| v.norm() <= allowed) {
        return Ok(());
    }
    // Every gap is near the usual one, but they add up: the spacing changes slowly.
    let gap = |k: usize| (slices[k].position - slices[k - 1].position).dot(normal);
    let strangeness = |k: usize| (gap(k) - spacing_mm).abs();
    let k = (1..slices.len())
        .max_by(|&a, &b| strangeness(a).total_cmp(&strangeness(b)))
        .expect("two slices or more");
    Err(DicomProblem::Uneven {
        before: slices[k - 1].path().into(),
        gap_mm: gap(k),
        spacing_mm,
    }
    .at(slices[k].path()))
}

/// The slice that lies farthest beside most others, and how far.
fn farthest_from_median(beside: &[Vector]) -> (usize, f64) {
    let median = Vector::from_fn(|axis, _| {
        let mut values: Vec<f64> = beside.iter().map(|v| v[axis]).collect();
        values.sort_by(f64::total_cmp);
        values[(values.len() - 1) / 2]
    });
    let off = |k: usize| (beside[k] - median).norm();
    let k = (0..beside.len())
        .max_by(|&a, &b| off(a).total_cmp(&off(b)))
        .expect("two slices or more");
    (k, off(k))
}

fn max_off(spacing_mm: f64) -> f64 {
    MAX_OFF_MM.min(MAX_OFF_SHARE * spacing_mm)
}

//! Reading a specimen's folder.

use super::error::SpecimenError;
use super::header::Header;
use super::points::{parse_landmarks, parse_rims};
use super::{CT_FILE, HEADER_FILE, LABELS_FILE, LANDMARKS_FILE, RIMS_FILE};
use crate::anatomy::{Source, Specimen, SpecimenProblem, specimen_problems};
use crate::volume::{Volume, Voxel, read_nifti};
use std::path::Path;

/// Reads and checks a specimen's folder ([`super`] says what is in it).
///
/// # Errors
/// [`SpecimenError::Invalid`] with every problem found: missing or unreadable files first and, if
/// all could be read, what is wrong with their content.
pub fn read_specimen(dir: &Path) -> Result<Specimen, SpecimenError> {
    let mut problems = Vec::new();
    let header = text(dir, HEADER_FILE, &mut problems)
        .and_then(|t| keep(HEADER_FILE, Header::parse(&t), &mut problems));
    let landmarks = text(dir, LANDMARKS_FILE, &mut problems)
        .map(|t| parsed(LANDMARKS_FILE, parse_landmarks(&t), &mut problems));
    let rims = text(dir, RIMS_FILE, &mut problems)
        .map(|t| parsed(RIMS_FILE, parse_rims(&t), &mut problems));
    let ct = volume::<i16>(dir, CT_FILE, &mut problems);
    let labels = volume::<u8>(dir, LABELS_FILE, &mut problems);

    let invalid = |problems| SpecimenError::Invalid {
        place: dir.display().to_string(),
        problems,
    };
    let (Some(header), Some(landmarks), Some(rims), Some(ct), Some(labels), true) =
        (header, landmarks, rims, ct, labels, problems.is_empty())
    else {
        return Err(invalid(problems));
    };
    let specimen = Specimen {
        name: header.name,
        source: header.source,
        ct,
        labels,
        landmarks,
        rims,
    };
    match specimen_problems(&specimen) {
        found if found.is_empty() => Ok(specimen),
        found => Err(invalid(found)),
    }
}

/// Reads where a specimen comes from, and nothing else of its folder.
///
/// # Errors
/// When `specimen.toml` is missing or cannot be read.
pub fn read_source(dir: &Path) -> Result<Source, SpecimenError> {
    let mut problems = Vec::new();
    text(dir, HEADER_FILE, &mut problems)
        .and_then(|t| keep(HEADER_FILE, Header::parse(&t), &mut problems))
        .map(|header| header.source)
        .ok_or_else(|| SpecimenError::Invalid {
            place: dir.display().to_string(),
            problems,
        })
}

fn unreadable(file: &str, reason: String) -> SpecimenProblem {
    SpecimenProblem::Unreadable {
        file: file.into(),
        reason,
    }
}

fn text(dir: &Path, file: &str, problems: &mut Vec<SpecimenProblem>) -> Option<String> {
    let path = dir.join(file);
    if !path.exists() {
        problems.push(SpecimenProblem::MissingFile(path.display().to_string()));
        return None;
    }
    let read = std::fs::read_to_string(path).map_err(|e| e.to_string());
    keep(file, read, problems)
}

fn keep<T>(
    file: &str,
    result: Result<T, String>,
    problems: &mut Vec<SpecimenProblem>,
) -> Option<T> {
    result
        .map_err(|reason| problems.push(unreadable(file, reason)))
        .ok()
}

fn parsed<T>(file: &str, (value, bad): (T, Vec<String>), problems: &mut Vec<SpecimenProblem>) -> T {
    problems.extend(bad.into_iter().map(|reason| unreadable(file, reason)));
    value
}

fn volume<T: Voxel>(
    dir: &Path,
    file: &str,
    problems: &mut Vec<SpecimenProblem>,
) -> Option<Volume<T>> {
    let path = dir.join(file);
    if !path.exists() {
        problems.push(SpecimenProblem::MissingFile(path.display().to_string()));
        return None;
    }
    keep(file, read_nifti(&path).map_err(|e| e.to_string()), problems)
}

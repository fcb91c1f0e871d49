//! The folder of bone surfaces.

use super::error::ImportError;
use super::ply::read_closed_ply;
use crate::anatomy::detect::BoneSurfaces;
use crate::volume::Surface;
use std::path::Path;

/// The files that a folder of bone surfaces holds: PLY, mm, RAS.
pub const BONE_FILES: [&str; 5] = [
    "Sacrum.ply",
    "Hip_L.ply",
    "Hip_R.ply",
    "Femur_L.ply",
    "Femur_R.ply",
];

/// Longest side of the box around a bone (mm): from a small child's sacrum to a tall man's femur.
/// No bone measured in cm is as large, no bone measured in inches, and none in micrometres as small.
const BONE_MM: (f64, f64) = (60.0, 700.0);

/// Reads the closed surfaces ([`BONE_FILES`]) of a folder into LPS.
///
/// # Errors
/// When files are missing (all are named), or with what is wrong with each: unreadable, not closed,
/// not of a bone's size.
pub fn read_bone_surfaces(dir: &Path) -> Result<BoneSurfaces, ImportError> {
    let missing: Vec<String> = BONE_FILES
        .iter()
        .filter(|file| !dir.join(file).is_file())
        .map(|file| file.to_string())
        .collect();
    if !missing.is_empty() {
        return Err(ImportError::MissingFiles {
            dir: dir.into(),
            missing,
        });
    }
    let mut problems = Vec::new();
    let surfaces = BONE_FILES.map(|file| {
        let path = dir.join(file);
        let surface = read_closed_ply(&path).and_then(|surface| sized(surface, &path));
        surface.map_err(|error| problems.push(error)).ok()
    });
    match surfaces {
        [
            Some(sacrum),
            Some(hip_l),
            Some(hip_r),
            Some(femur_l),
            Some(femur_r),
        ] => Ok(BoneSurfaces {
            sacrum,
            hips: [hip_l, hip_r],
            femurs: [femur_l, femur_r],
        }),
        _ if problems.len() == 1 => Err(problems.remove(0)),
        _ => Err(ImportError::Several(problems)),
    }
}

/// The surface, if it has the size of a bone: lengths in m, cm or inches have not.
fn sized(surface: Surface, path: &Path) -> Result<Surface, ImportError> {
    let extent = |axis: usize| {
        let values = surface.vertices().iter().map(|p| p[axis]);
        values.clone().fold(f64::MIN, f64::max) - values.fold(f64::MAX, f64::min)
    };
    let extent_mm = extent(0).max(extent(1)).max(extent(2));
    let (low, high) = BONE_MM;
    if (low..=high).contains(&extent_mm) {
        return Ok(surface);
    }
    Err(ImportError::Size {
        path: path.into(),
        extent_mm,
        low,
        high,
    })
}

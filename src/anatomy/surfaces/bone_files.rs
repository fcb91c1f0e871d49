//! The folder of bone surfaces.

use super::error::ImportError;
use super::ply::read_closed_ply;
use crate::anatomy::detect::BoneSurfaces;
use std::path::Path;

/// The files that a folder of bone surfaces holds: PLY, mm, RAS.
pub const BONE_FILES: [&str; 5] = [
    "Sacrum.ply",
    "Hip_L.ply",
    "Hip_R.ply",
    "Femur_L.ply",
    "Femur_R.ply",
];

/// Reads the closed surfaces ([`BONE_FILES`]) of a folder into LPS.
///
/// # Errors
/// When files are missing (all are named), unreadable, or not closed.
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
    let [sacrum, hip_l, hip_r, femur_l, femur_r] =
        BONE_FILES.map(|file| read_closed_ply(&dir.join(file)));
    Ok(BoneSurfaces {
        sacrum: sacrum?,
        hips: [hip_l?, hip_r?],
        femurs: [femur_l?, femur_r?],
    })
}

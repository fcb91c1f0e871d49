//! The folder of bone surfaces.

use super::error::ImportError;
use super::mesh_file::{MeshFormat, read_closed_surface};
use super::origin::unstated_frame;
use crate::anatomy::detect::BoneSurfaces;
use crate::volume::Surface;
use std::path::{Path, PathBuf};

/// The names of the files that a folder of bone surfaces holds, without the ending that tells
/// their format ([`MeshFormat`]).
pub const BONES: [&str; 5] = ["Sacrum", "Hip_L", "Hip_R", "Femur_L", "Femur_R"];

/// Longest side of the box around a bone (mm): from a small child's sacrum to a tall man's femur.
/// No bone measured in cm is as large, no bone measured in inches, and none in micrometres as small.
const BONE_MM: (f64, f64) = (60.0, 700.0);

/// The file of each of the [`BONES`] in a folder.
///
/// # Errors
/// When files are missing (all are named), or a bone has two.
pub fn bone_files(dir: &Path) -> Result<[PathBuf; 5], ImportError> {
    let io = |source| ImportError::Io {
        path: dir.into(),
        source,
    };
    let mut there = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(io)? {
        there.push(PathBuf::from(entry.map_err(io)?.file_name()));
    }
    // A folder lists its files in any order.
    there.sort();
    let (mut found, mut missing, mut unread) = (Vec::new(), Vec::new(), Vec::new());
    for bone in BONES {
        let of_bone = there
            .iter()
            .filter(|f| f.file_stem() == Some(bone.as_ref()));
        let (read, others): (Vec<&PathBuf>, Vec<&PathBuf>) =
            of_bone.partition(|file| MeshFormat::of(file).is_some());
        let names = |files: Vec<&PathBuf>| files.iter().map(|f| f.display().to_string()).collect();
        match read[..] {
            [file] => found.push(dir.join(file)),
            [] => {
                missing.push(bone.to_owned());
                unread.extend::<Vec<String>>(names(others));
            }
            _ => {
                return Err(ImportError::Ambiguous {
                    dir: dir.into(),
                    files: names(read),
                });
            }
        }
    }
    found.try_into().map_err(|_| ImportError::MissingFiles {
        dir: dir.into(),
        missing,
        unread,
    })
}

/// Reads the closed surfaces ([`bone_files`]) of a folder into LPS. Files that do not state their
/// frame have the one that the folder's `surfaces.toml` says, or are RAS.
///
/// # Errors
/// When files are missing (all are named), or with what is wrong with each: unreadable, not closed,
/// not of a bone's size.
pub fn read_bone_surfaces(dir: &Path) -> Result<BoneSurfaces, ImportError> {
    let unstated = unstated_frame(dir)?;
    let mut problems = Vec::new();
    let surfaces = bone_files(dir)?.map(|path| {
        let surface =
            read_closed_surface(&path, unstated).and_then(|surface| sized(surface, &path));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::detect::{DetectError, detect};

    fn fixture(name: &str) -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/data/surfaces")
            .join(name)
    }

    /// A folder with a body of a bone's size for each bone, each from another format.
    fn folder() -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (from, to) in [
            ("trimesh_binary.ply", "Sacrum.PLY"),
            ("trimesh_binary.stl", "Hip_L.stl"),
            ("vtk42_binary_lps.vtk", "Hip_R.vtk"),
            ("vtk.obj", "Femur_L.obj"),
            ("meshio_ascii.stl", "Femur_R.stl"),
        ] {
            std::fs::copy(fixture(from), folder.path().join(to)).unwrap();
        }
        folder
    }

    #[test]
    fn each_bone_may_come_in_another_format_but_only_once() {
        let folder = folder();
        let at = |name: &str| folder.path().join(name);
        // What exporters leave beside a surface is none.
        std::fs::write(at("Femur_L.mtl"), "").unwrap();
        let bones = read_bone_surfaces(folder.path()).unwrap();
        let volume = bones.sacrum.volume();
        for surface in bones.hips.iter().chain(&bones.femurs) {
            assert!((surface.volume() - volume).abs() < 1e-9);
            assert!((surface.centroid().unwrap() - bones.sacrum.centroid().unwrap()).norm() < 1e-9);
        }
        std::fs::copy(at("Hip_L.stl"), at("Hip_L.ply")).unwrap();
        let message = read_bone_surfaces(folder.path()).unwrap_err().to_string();
        assert!(
            message.contains("holds Hip_L.ply and Hip_L.stl"),
            "{message}"
        );
        std::fs::remove_file(at("Hip_L.ply")).unwrap();
        std::fs::rename(at("Hip_L.stl"), at("Hip_L.vtp")).unwrap();
        std::fs::remove_file(at("Sacrum.PLY")).unwrap();
        let message = read_bone_surfaces(folder.path()).unwrap_err().to_string();
        assert!(
            message.contains("lacks Sacrum, Hip_L;") && message.contains("(Hip_L.vtp is not read"),
            "{message}"
        );
    }

    #[test]
    fn a_frame_that_is_not_the_files_swaps_the_sides_and_is_found_out() {
        let folder = folder();
        let obj = std::fs::read_to_string(fixture("vtk.obj")).unwrap();
        // RAS: the left is at negative x.
        for (bone, shift_mm) in [("Hip_L", -100.0), ("Hip_R", 100.0)] {
            let moved: String = obj
                .lines()
                .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
                    ["v", x, y, z] => {
                        format!("v {} {y} {z}\n", x.parse::<f64>().unwrap() + shift_mm)
                    }
                    _ => format!("{line}\n"),
                })
                .collect();
            std::fs::write(folder.path().join(format!("{bone}.obj")), moved).unwrap();
        }
        std::fs::remove_file(folder.path().join("Hip_L.stl")).unwrap();
        std::fs::remove_file(folder.path().join("Hip_R.vtk")).unwrap();
        let swapped = || {
            let bones = read_bone_surfaces(folder.path()).unwrap();
            matches!(detect(&bones), Err(DetectError::SidesSwapped { .. }))
        };
        assert!(!swapped());
        let origin = folder.path().join("surfaces.toml");
        std::fs::write(&origin, "frame = \"LPS\"\n").unwrap();
        assert!(swapped());
        // A frame that a file states itself wins.
        for bone in ["Hip_L", "Hip_R"] {
            let path = folder.path().join(format!("{bone}.obj"));
            let text = std::fs::read_to_string(&path).unwrap();
            std::fs::write(&path, format!("# SPACE=RAS\n{text}")).unwrap();
        }
        assert!(!swapped());
    }
}

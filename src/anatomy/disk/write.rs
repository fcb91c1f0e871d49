//! Writing a specimen's folder.

use super::error::SpecimenError;
use super::header::{FORMAT_VERSION, Header};
use super::points::{landmarks_text, rims_text};
use super::{CT_FILE, HEADER_FILE, LABELS_FILE, LANDMARKS_FILE, RIMS_FILE};
use crate::anatomy::{Specimen, specimen_problems};
use crate::volume::write_nifti;
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// Writes a specimen as a new folder ([`super`] says what is in it). The folder appears whole or
/// not at all: it is written under another name, synced and renamed.
///
/// # Errors
/// When the folder exists, the specimen is not valid (all problems are named), or the disk refuses.
pub fn write_specimen(specimen: &Specimen, dir: &Path) -> Result<(), SpecimenError> {
    if dir.exists() {
        return Err(SpecimenError::Exists(dir.into()));
    }
    let problems = specimen_problems(specimen);
    if !problems.is_empty() {
        return Err(SpecimenError::Invalid {
            place: format!("'{}'", specimen.name),
            problems,
        });
    }
    let io = |doing, path: &Path| {
        let path = path.to_path_buf();
        move |source| SpecimenError::Io {
            doing,
            path,
            source,
        }
    };
    let parent = match dir.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(parent).map_err(io("create", parent))?;
    let temporary = tempfile::Builder::new()
        .prefix(".partial-specimen-")
        .permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777))
        .tempdir_in(parent)
        .map_err(io("create a folder in", parent))?;

    let header = Header {
        format_version: FORMAT_VERSION,
        name: specimen.name.clone(),
        source: specimen.source.clone(),
    };
    for (file, text) in [
        (HEADER_FILE, header.text()),
        (LANDMARKS_FILE, landmarks_text(&specimen.landmarks)),
        (RIMS_FILE, rims_text(&specimen.rims)),
    ] {
        let path = temporary.path().join(file);
        let write = || -> std::io::Result<()> {
            let mut file = File::create(&path)?;
            file.write_all(text.as_bytes())?;
            file.sync_all()
        };
        write().map_err(io("write", &path))?;
    }
    write_nifti(&specimen.ct, &temporary.path().join(CT_FILE))?;
    write_nifti(&specimen.labels, &temporary.path().join(LABELS_FILE))?;

    // A folder that came into being meanwhile makes the rename fail unless it is empty.
    std::fs::rename(temporary.path(), dir).map_err(io("write", dir))?;
    // The folder has moved: nothing is left to be removed.
    let _ = temporary.keep();
    File::open(parent)
        .and_then(|f| f.sync_all())
        .map_err(io("sync", parent))
}

#[cfg(test)]
mod tests {
    use super::super::read_specimen;
    use super::*;
    use crate::anatomy::{Landmark, Landmarks, Side, Source};
    use crate::geometry::{Point, Vector};
    use crate::volume::{Grid, Volume};
    use std::path::PathBuf;

    fn tiny() -> Specimen {
        let grid = Grid::axis_aligned([12, 10, 8], 2.0, Point::new(-12.0, 5.5, 100.0));
        let mut labels = Volume::filled(grid.clone(), 0);
        labels.data[..3].copy_from_slice(&[1, 2, 3]);
        let ct = Volume::new(
            grid.clone(),
            (0..grid.len()).map(|n| n as i16 - 500).collect(),
        );
        let center = grid.point(5.5, 4.5, 3.5);
        let mut landmarks = Landmarks::default();
        for (n, landmark) in Landmark::ALL.into_iter().enumerate() {
            for side in Side::BOTH {
                let x = side.lateral_sign() * n as f64;
                landmarks.set(landmark, side, center + Vector::new(x, 0.3, 0.0));
            }
        }
        let ring = |s: f64| -> Vec<Point> {
            (0..30)
                .map(|n| (n as f64 * std::f64::consts::TAU / 30.0).sin_cos())
                .map(|(sin, cos)| center + Vector::new(s * cos, sin, 0.0) * 5.0)
                .collect()
        };
        Specimen {
            name: "tiny-1".into(),
            source: Source {
                kind: "test".into(),
                description: "A few voxels.".into(),
                licence: "none".into(),
                sex: "unknown".into(),
                assigned_density: true,
            },
            ct,
            labels,
            landmarks,
            rims: [ring(1.0).into(), ring(-1.0).into()],
        }
    }

    fn written() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path().join("deep/tiny");
        write_specimen(&tiny(), &dir).unwrap();
        (folder, dir)
    }

    #[test]
    fn round_trip() {
        let (_folder, dir) = written();
        let back = read_specimen(&dir).unwrap();
        assert_eq!(format!("{back:?}"), format!("{:?}", tiny()));
        let siblings = std::fs::read_dir(dir.parent().unwrap()).unwrap().count();
        assert_eq!(siblings, 1, "no temporary folder is left");
        let error = write_specimen(&tiny(), &dir).unwrap_err();
        assert!(matches!(error, SpecimenError::Exists(_)), "{error}");
    }

    #[test]
    fn all_unreadable_files_are_named_at_once() {
        let (_folder, dir) = written();
        std::fs::remove_file(dir.join(CT_FILE)).unwrap();
        std::fs::write(dir.join(LABELS_FILE), "x").unwrap();
        std::fs::write(dir.join(RIMS_FILE), "side,x\nleft,1\n").unwrap();
        let header = std::fs::read_to_string(dir.join(HEADER_FILE)).unwrap();
        std::fs::write(
            dir.join(HEADER_FILE),
            header.replace("version = 1", "version = 2"),
        )
        .unwrap();
        let message = read_specimen(&dir).unwrap_err().to_string();
        for part in [
            "ct.nii.gz is missing",
            "labels.nii.gz is not a NIfTI-1 file",
            "rims.csv: CSV",
            "format_version is 2; this program reads 1",
        ] {
            assert!(message.contains(part), "expected '{part}' in: {message}");
        }
        let nowhere = read_specimen(&dir.join("no")).unwrap_err().to_string();
        assert_eq!(nowhere.matches("is missing").count(), 5, "{nowhere}");
    }

    #[test]
    fn all_problems_of_the_content_are_named_at_once_and_nothing_is_written() {
        let mut bad = tiny();
        bad.name = "a/b".into();
        bad.source.sex = "m".into();
        bad.labels.grid.origin.x += 1e-3;
        bad.labels.data[2] = 9;
        let mut landmarks = Landmarks::default();
        landmarks.set(Landmark::Fh, Side::Left, Point::new(1e3, 0.0, 0.0));
        bad.landmarks = landmarks;
        bad.rims[0].truncate(23);
        bad.rims[1].swap(3, 17);
        bad.rims[1][5].z = f64::NAN;
        let folder = tempfile::tempdir().unwrap();
        let message = write_specimen(&bad, &folder.path().join("x"))
            .unwrap_err()
            .to_string();
        for part in [
            "name 'a/b'",
            "sex is 'm'",
            "the label map's grid",
            "no voxel has label 3 (right femur)",
            "1 voxels have the unknown label 9, the first at [2, 0, 0]",
            "landmark ASIS_l is missing",
            "landmark GSN_r is missing",
            "landmark FH_l (1000.0, 0.0, 0.0) lies outside",
            "the left rim has 23 points",
            "the right rim jumps",
            "right rim point 5",
        ] {
            assert!(message.contains(part), "expected '{part}' in: {message}");
        }
        assert!(!message.contains("landmark FH_l is missing"), "{message}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

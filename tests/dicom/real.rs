//! 32 slices of a real body.

use crate::{EXPLICIT, assert_refused, replaced};
use pao_sim::geometry::Vector;
use pao_sim::volume::dicom::DicomProblem;
use pao_sim::volume::{VolumeFileError, read_dicom_series, read_dicom_series_of};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The folder of the real CT, or `None`, with a word on standard output, where it does not exist;
/// where `PAO_SIM_REQUIRE_DATA` is set that is a failure.
fn vhm_ct() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/vhm_ct");
    if path.is_dir() {
        return Some(path);
    }
    assert!(
        std::env::var_os("PAO_SIM_REQUIRE_DATA").is_none(),
        "PAO_SIM_REQUIRE_DATA is set and there is no CT at {}",
        path.display()
    );
    println!("SKIPPED: no CT at {}", path.display());
    None
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    files
}

#[test]
fn a_real_ct_is_read_whole() {
    let Some(data) = vhm_ct() else { return };
    let start = Instant::now();
    let volume = read_dicom_series(&data).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    let bytes: u64 = files(&data)
        .iter()
        .map(|f| f.metadata().unwrap().len())
        .sum();
    println!("{seconds:.3} s, {:.0} MB/s", bytes as f64 / 1e6 / seconds);
    assert_eq!(volume.grid.dims, [512, 512, 32]);
    assert_eq!(volume.grid.spacing, [1.0; 3]);
    assert_eq!(volume.grid.origin.coords, Vector::new(0.0, 0.0, 400.0));
    assert_eq!(volume.grid.direction, nalgebra::Matrix3::identity());
    // By pydicom (scripts/check_dicom.py).
    let sum: i64 = volume.data.iter().map(|&v| i64::from(v)).sum();
    let (min, max) = (volume.data.iter().min(), volume.data.iter().max());
    assert_eq!((min, max), (Some(&-1024), Some(&1369)));
    assert_eq!(sum, SUM_BY_PYDICOM);
}

const SUM_BY_PYDICOM: i64 = -5_596_417_500;

#[test]
fn a_real_ct_in_another_order_is_the_same() {
    let Some(data) = vhm_ct() else { return };
    let folder = tempfile::tempdir().unwrap();
    for (n, file) in files(&data).iter().enumerate() {
        // 13 and 32 have no common factor: every number once. No extension, as hospitals do.
        let name = format!("IM{:04}", n * 13 % 32);
        std::fs::copy(file, folder.path().join(name)).unwrap();
    }
    let whole = read_dicom_series(&data).unwrap();
    assert!(read_dicom_series(folder.path()).unwrap() == whole);
    assert!(read_dicom_series(&folder.path().join("IM0005")).unwrap() == whole);
}

#[test]
fn a_missing_slice_is_named_by_its_neighbours() {
    let Some(data) = vhm_ct() else { return };
    let folder = tempfile::tempdir().unwrap();
    let copy = |file: &Path| {
        let to = folder.path().join(file.file_name().unwrap());
        std::fs::copy(file, &to).unwrap();
        to
    };
    let copies: Vec<_> = files(&data).iter().map(|f| copy(f)).collect();
    for hole in [1, 15, 30] {
        std::fs::remove_file(&copies[hole]).unwrap();
        let [before, after] = [&copies[hole - 1], &copies[hole + 1]].map(|f| f.to_str().unwrap());
        let parts = [
            &format!("{after} lies 2.000 mm after {before}"),
            "slices are 1.000 mm apart: 1 slice is missing",
        ];
        assert_refused(folder.path(), &parts);
        copy(&files(&data)[hole]);
    }
    for hole in [7, 8, 9] {
        std::fs::remove_file(&copies[hole]).unwrap();
    }
    assert_refused(
        folder.path(),
        &["lies 4.000 mm after", "3 slices are missing"],
    );
}

#[test]
fn two_mixed_series_are_listed_and_can_be_chosen() {
    let Some(data) = vhm_ct() else { return };
    const UID: &str = "1.2.826.0.1.3680043.2.1125.1.75064541463040.2005072610175534453";
    const OTHER: &str = "1.2.826.0.1.3680043.2.1125.1.75064541463040.2005072610175534459";
    let folder = tempfile::tempdir().unwrap();
    for (n, file) in files(&data).iter().enumerate() {
        let bytes = std::fs::read(file).unwrap();
        let name = file.file_name().unwrap().to_str().unwrap();
        if n < 10 {
            let other = replaced(&bytes, UID, OTHER);
            std::fs::write(folder.path().join(format!("other {name}")), other).unwrap();
        }
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let listed = format!("\n  {OTHER}  CT \"Resampled to 1mm voxels\", 10 slices, axial");
    assert_refused(
        folder.path(),
        &["holds 2 series", UID, "32 slices, axial", &listed],
    );
    let whole = read_dicom_series(&data).unwrap();
    assert!(read_dicom_series_of(folder.path(), UID).unwrap() == whole);
    let one = folder.path().join("other vhm.401.dcm");
    let other = read_dicom_series(&one).unwrap();
    assert!(other == whole.cropped([0; 3], [511, 511, 9]));
    match read_dicom_series_of(folder.path(), "1.2.3").unwrap_err() {
        VolumeFileError::Dicom { problem, .. } => {
            assert!(
                matches!(*problem, DicomProblem::NoSuchSeries { .. }),
                "{problem}"
            );
        }
        other => panic!("{other}"),
    }
}

#[test]
fn a_real_slice_that_was_cut_or_named_wrongly_is_refused() {
    let Some(data) = vhm_ct() else { return };
    let folder = tempfile::tempdir().unwrap();
    let files = files(&data);
    std::fs::copy(&files[0], folder.path().join("1")).unwrap();
    let bytes = std::fs::read(&files[1]).unwrap();
    let file = folder.path().join("2");
    std::fs::write(&file, &bytes[..400_000]).unwrap();
    assert_refused(
        folder.path(),
        &["2 ends too early", "524288 expected", "copy it again"],
    );
    std::fs::write(&file, replaced(&bytes, EXPLICIT, "1.2.840.10008.1.2\0\0\0")).unwrap();
    assert_refused(
        folder.path(),
        &["2 names the transfer syntax Implicit", "(0002,0010)"],
    );
}

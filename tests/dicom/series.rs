//! What slices make one grid, and what else a folder may hold.

use crate::{assert_refused, fixture, read, replaced};
use pao_sim::volume::read_dicom_series;

#[test]
fn folders_hold_other_things_as_well() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    assert_refused(folder.path(), &["holds no slice of a CT: it is empty"]);
    std::fs::create_dir(at("sub")).unwrap();
    assert_refused(
        folder.path(),
        &["1 subfolder", "subfolders are not looked into"],
    );
    for name in ["README", "DICOMDIR", ".DS_Store", "._1.dcm"] {
        std::fs::write(at(name), "text").unwrap();
    }
    assert_refused(folder.path(), &["4 files no DICOM (", "README"]);
    for name in ["1.dcm", "2.dcm", "3.dcm"] {
        std::fs::copy(fixture("oblique").join(name), at(name)).unwrap();
    }
    for name in ["1.dcm", "2.dcm"] {
        let localizer = fixture("localizers").join(name);
        std::fs::copy(localizer, at(&format!("scout {name}"))).unwrap();
    }
    assert_eq!(read_dicom_series(folder.path()).unwrap(), read("oblique"));
    std::fs::write(at("4.DCM"), "").unwrap();
    assert_refused(
        folder.path(),
        &["4.DCM is named as a DICOM file", "byte 128"],
    );
    assert_refused(
        &at("README"),
        &["README holds no slice of a CT", "byte 128"],
    );
    assert_refused(&at("nothing"), &["cannot read", "nothing"]);
}

#[test]
fn slices_must_make_one_grid() {
    let two = |a: &str, b: &str| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::copy(fixture(a), folder.path().join("a")).unwrap();
        std::fs::copy(fixture(b), folder.path().join("b")).unwrap();
        read_dicom_series(folder.path()).unwrap_err().to_string()
    };
    let expect = |message: String, parts: &[&str]| {
        for part in parts {
            assert!(message.contains(part), "expected '{part}' in: {message}");
        }
    };
    let (first, second) = ("encodings/explicit.dcm", "encodings/second.dcm");
    let same = two(first, "encodings/rle.dcm");
    expect(
        same,
        &["b lies at the same place as", "a, 30.000 mm", "keep one"],
    );
    let turned = two(first, "oblique/1.dcm");
    expect(
        turned,
        &["b has ImageOrientationPatient (0020,0037) = ", "a has 1.0"],
    );
    let size = two(second, "huge/1.dcm");
    expect(size, &["b ends too early", "40 bytes"]);
    // Of the sheared series the first and the third slice lie in one plane with no others.
    let sheared = two(first, "tilt/1.dcm");
    expect(sheared, &["sheared", "15.00 degrees"]);

    let folder = tempfile::tempdir().unwrap();
    std::fs::copy(fixture(first), folder.path().join("a")).unwrap();
    assert_refused(folder.path(), &["a is the only slice"]);
    let change = |from: &str, to: &str, slice: &str| {
        let bytes = std::fs::read(fixture(slice)).unwrap();
        std::fs::write(folder.path().join("c"), replaced(&bytes, from, to)).unwrap();
        read_dicom_series(folder.path()).unwrap_err().to_string()
    };
    std::fs::copy(fixture(second), folder.path().join("b")).unwrap();
    let third = "signed/1.dcm";
    expect(
        change("32.500000", "32.800000", third),
        &[
            "c lies 1.550 mm after",
            "b, where slices are 1.250 mm apart",
            "not equidistant",
        ],
    );
    expect(
        change("20.000000", "20.500000", third),
        &["c lies 0.500 mm beside the line of the other slices"],
    );
    expect(
        change("0.75\\0.5", "0.75\\0.6", third),
        &[
            "c has PixelSpacing (0028,0030) = 0.75\\0.6",
            "a has 0.75\\0.5",
        ],
    );
    expect(
        change(".1071.2000", ".1071.2001", third),
        &["c has FrameOfReferenceUID (0020,0052)"],
    );
}

/// No gap differs much from its neighbours, but the last is a fifth wider than the first.
#[test]
fn a_spacing_that_changes_slowly_is_refused() {
    let bytes = std::fs::read(fixture("signed/1.dcm")).unwrap();
    let stack = |growth: f64| {
        let folder = tempfile::tempdir().unwrap();
        let mut z = 30.0;
        for k in 0..10 {
            let slice = replaced(&bytes, "32.500000", format!("{z:.6}"));
            std::fs::write(folder.path().join(format!("{k}")), slice).unwrap();
            z += 1.25 + growth * f64::from(k);
        }
        read_dicom_series(folder.path()).map(|volume| volume.grid.spacing[2])
    };
    assert!((stack(0.0).unwrap() - 1.25).abs() < 1e-9);
    // Within what the rounding of positions may do.
    assert!((stack(0.005).unwrap() - 1.27).abs() < 1e-9);
    let message = stack(0.025).unwrap_err().to_string();
    assert!(message.contains("not equidistant"), "{message}");
    assert!(message.contains("slices are 1.350 mm apart"), "{message}");
}

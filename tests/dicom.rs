//! CT volumes read from DICOM series: small synthetic ones that pydicom wrote (`tests/data/dicom`),
//! and 32 slices of a real body.

use pao_sim::geometry::Vector;
use pao_sim::volume::dicom::DicomProblem;
use pao_sim::volume::{Volume, VolumeFileError, read_dicom_series, read_dicom_series_of};
use std::path::{Path, PathBuf};
use std::time::Instant;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/dicom")
        .join(name)
}

fn read(name: &str) -> Volume<i16> {
    read_dicom_series(&fixture(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// What the script gave voxel (i, j, k).
fn hounsfield([i, j, k]: [usize; 3]) -> i16 {
    (100 * k + 10 * j + i) as i16 - 50
}

/// Every voxel that is not what `expected` says.
fn wrong(volume: &Volume<i16>, expected: impl Fn([usize; 3]) -> i16) -> Vec<([usize; 3], i16)> {
    (0..volume.grid.len())
        .map(|offset| (volume.grid.voxel(offset), volume.data[offset]))
        .filter(|&(voxel, value)| value != expected(voxel))
        .collect()
}

fn assert_place(volume: &Volume<i16>, dims: [usize; 3], direction: [Vector; 3]) {
    let grid = &volume.grid;
    assert_eq!(grid.dims, dims);
    for (a, mm) in [0.5, 0.75, 1.25].into_iter().enumerate() {
        assert!((grid.spacing[a] - mm).abs() < 1e-6, "{:?}", grid.spacing);
        let column = grid.direction.column(a).into_owned();
        assert!((column - direction[a]).norm() < 1e-7, "{}", grid.direction);
    }
    let origin = Vector::new(-10.0, 20.0, 30.0);
    assert!(
        (grid.origin.coords - origin).norm() < 1e-6,
        "{}",
        grid.origin
    );
}

/// The message of a refusal, with its parts.
fn assert_refused(path: &Path, parts: &[&str]) {
    let error = read_dicom_series(path).expect_err(&format!("{}", path.display()));
    let message = error.to_string();
    for part in parts {
        assert!(message.contains(part), "expected '{part}' in: {message}");
    }
}

#[test]
fn every_encoding_holds_the_same_voxels() {
    for encoding in [
        "explicit",
        "implicit",
        "big_endian",
        "deflated",
        "rle",
        "jpeg_lossless",
        "jpeg_lossless_p14",
    ] {
        let folder = tempfile::tempdir().unwrap();
        for (from, to) in [(encoding, "B"), ("second", "A.DCM")] {
            let from = fixture("encodings").join(format!("{from}.dcm"));
            std::fs::copy(from, folder.path().join(to)).unwrap();
        }
        let volume = read_dicom_series(folder.path()).unwrap();
        assert_place(&volume, [5, 4, 2], axes());
        assert_eq!(wrong(&volume, hounsfield), [], "{encoding}");
    }
}

fn axes() -> [Vector; 3] {
    [Vector::x(), Vector::y(), Vector::z()]
}

#[test]
fn oblique_slices_keep_their_place() {
    let turn = nalgebra::Rotation3::from_axis_angle(&Vector::z_axis(), -35_f64.to_radians())
        * nalgebra::Rotation3::from_axis_angle(&Vector::x_axis(), 20_f64.to_radians());
    let volume = read("oblique");
    let direction = std::array::from_fn(|a| turn.matrix().column(a).into_owned());
    assert_place(&volume, [5, 4, 3], direction);
    assert_eq!(wrong(&volume, hounsfield), []);
}

#[test]
fn coronal_slices_run_backwards() {
    let volume = read("coronal");
    assert_place(&volume, [5, 4, 3], [Vector::x(), -Vector::z(), Vector::y()]);
    assert_eq!(wrong(&volume, hounsfield), []);
}

#[test]
fn numbers_are_read_as_they_are_stored() {
    for name in ["signed_12", "rubbish_above", "bits_32", "padding_in_range"] {
        let volume = read(name);
        assert_place(&volume, [5, 4, 3], axes());
        assert_eq!(wrong(&volume, hounsfield), [], "{name}");
    }
    let extremes = [-32768, 32767, 0];
    let signed = wrong(&read("signed"), |[i, j, k]| match i + j {
        0 => extremes[k],
        _ => hounsfield([i, j, k]),
    });
    assert_eq!(signed, []);
    let tenths = wrong(&read("bits_8"), |[_, j, k]| (100 * k + 10 * j) as i16 - 50);
    assert_eq!(tenths, []);
}

#[test]
fn each_slice_has_its_own_rescaling() {
    // The third slice's line has steps of 2 HU.
    let expected = |[i, j, k]: [usize; 3]| {
        let hu = hounsfield([i, j, k]);
        if k == 2 { hu - hu.rem_euclid(2) } else { hu }
    };
    assert_eq!(wrong(&read("rescale"), expected), []);
}

#[test]
fn padding_below_air_becomes_air() {
    let expected = |[i, j, k]: [usize; 3]| match (i, j) {
        (0, 0..=2) => -1024,
        // Beyond the range of padding.
        (0, 3) => -1985,
        _ => hounsfield([i, j, k]),
    };
    assert_eq!(wrong(&read("padding"), expected), []);
}

#[test]
fn what_is_no_ct_in_hounsfield_units_is_refused() {
    for (name, parts) in [
        (
            "mr",
            &["1.dcm has Modality (0008,0060) = MR", "expected CT"][..],
        ),
        (
            "monochrome1",
            &[
                "PhotometricInterpretation (0028,0004) = MONOCHROME1",
                "expected MONOCHROME2",
            ],
        ),
        (
            "no_rescale",
            &[
                "has no RescaleSlope (0028,1053)",
                "export the original series",
            ],
        ),
        (
            "high_bit",
            &[
                "HighBit (0028,0102) = 13",
                "expected 11, one less than BitsStored",
            ],
        ),
        ("us_units", &["RescaleType (0028,1054) = US", "expected HU"]),
        (
            "enhanced",
            &["NumberOfFrames (0028,0008) = 2", "multi-frame", "emf2sf"],
        ),
        (
            "localizers",
            &[
                "localizers holds no slice of a CT",
                "2 files localizer (1.dcm, 2.dcm)",
            ],
        ),
        (
            "tilt",
            &[
                "tilt is a sheared stack",
                "0.335 mm",
                "1.250 mm",
                "tilted by 15.00 degrees",
                "dcm2niix",
            ],
        ),
    ] {
        assert_refused(&fixture(name), parts);
    }
}

/// Nothing of the size that a header claims is allocated.
#[test]
fn a_header_may_not_claim_more_than_the_file_has() {
    let error = read_dicom_series(&fixture("huge")).unwrap_err();
    let VolumeFileError::Truncated {
        found, expected, ..
    } = error
    else {
        panic!("{error}")
    };
    assert_eq!((found, expected), (40, 65535 * 65535 * 2));
}

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
        std::fs::write(folder.path().join("c"), replaced(&bytes, from, to, 1)).unwrap();
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
            let slice = replaced(&bytes, "32.500000", &format!("{z:.6}"), 1);
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

/// `bytes` with `from` replaced by `to`, of the same length, `times` times.
fn replaced(bytes: &[u8], from: &str, to: &str, times: usize) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let places: Vec<usize> = (0..=bytes.len() - from.len())
        .filter(|&at| bytes[at..].starts_with(from.as_bytes()))
        .collect();
    assert_eq!(places.len(), times, "'{from}' in the file");
    let mut out = bytes.to_vec();
    for at in places {
        out[at..at + from.len()].copy_from_slice(to.as_bytes());
    }
    out
}

const EXPLICIT: &str = "1.2.840.10008.1.2.1\0";

#[test]
fn a_wrong_transfer_syntax_is_found_out() {
    let plain = std::fs::read(fixture("encodings/explicit.dcm")).unwrap();
    let rle = std::fs::read(fixture("encodings/rle.dcm")).unwrap();
    let implicit = std::fs::read(fixture("encodings/implicit.dcm")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("slice");
    for (bytes, from, to, parts) in [
        (
            &plain,
            EXPLICIT,
            "1.2.840.10008.1.2\0\0\0",
            &[
                "names the transfer syntax Implicit VR Little Endian",
                "is in explicit VR little endian",
            ][..],
        ),
        (
            &plain,
            EXPLICIT,
            "1.2.840.10008.1.2.2\0",
            &["names the transfer syntax Explicit VR Big Endian"],
        ),
        (
            &plain,
            EXPLICIT,
            "1.2.840.10008.1.2.5\0",
            &[
                "names the transfer syntax RLE Lossless",
                "pixels are not encapsulated",
                "(0002,0010)",
            ],
        ),
        (
            &plain,
            EXPLICIT,
            "1.2.840.10008.1.2.9\0",
            &[
                "transfer syntax unknown (1.2.840.10008.1.2.9)",
                "gdcmconv --raw",
            ],
        ),
        (
            &rle,
            "1.2.840.10008.1.2.5\0",
            EXPLICIT,
            &["Explicit VR Little Endian, but its pixels are encapsulated"],
        ),
        (
            &implicit,
            "1.2.840.10008.1.2\0",
            "1.2.840.10008.1.0\0",
            &["1.2.840.10008.1.0", "gdcmconv"],
        ),
    ] {
        std::fs::write(&file, replaced(bytes, from, to, 1)).unwrap();
        assert_refused(folder.path(), parts);
    }
    // Longer names stand in the JPEG file.
    let jpeg = std::fs::read(fixture("encodings/jpeg_lossless.dcm")).unwrap();
    for (to, parts) in [
        (
            "1.2.840.10008.1.2.4.90",
            &["JPEG 2000 Image Compression (Lossless Only)", "gdcmconv"][..],
        ),
        (
            "1.2.840.10008.1.2.4.80",
            &["JPEG-LS Lossless Image Compression", "gdcmconv"],
        ),
        (
            "1.2.840.10008.1.2.4.50",
            &["JPEG Baseline (Process 1)", "export the original"],
        ),
    ] {
        std::fs::write(&file, replaced(&jpeg, "1.2.840.10008.1.2.4.70", to, 1)).unwrap();
        assert_refused(folder.path(), parts);
    }
}

/// Every length of every encoding: no cut file is read, and none is passed over.
#[test]
fn a_file_that_was_cut_is_refused_wherever_it_was_cut() {
    for encoding in [
        "explicit",
        "implicit",
        "big_endian",
        "deflated",
        "rle",
        "jpeg_lossless",
    ] {
        let folder = tempfile::tempdir().unwrap();
        let second = folder.path().join("second");
        std::fs::copy(fixture("encodings/second.dcm"), second).unwrap();
        std::fs::copy(fixture("signed/1.dcm"), folder.path().join("third")).unwrap();
        let whole = std::fs::read(fixture("encodings").join(format!("{encoding}.dcm"))).unwrap();
        let file = folder.path().join("first.dcm");
        std::fs::write(&file, &whole).unwrap();
        read_dicom_series(folder.path()).unwrap();
        // A deflated stream's last byte is padding.
        let end = whole.len() - usize::from(encoding == "deflated");
        for length in 0..end {
            std::fs::write(&file, &whole[..length]).unwrap();
            match read_dicom_series(folder.path()) {
                Err(error) => assert!(error.to_string().contains("first.dcm"), "{error}"),
                Ok(_) => panic!("{encoding}, {length} of {} bytes", whole.len()),
            }
        }
    }
}

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
            let other = replaced(&bytes, UID, OTHER, 1);
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
    std::fs::write(
        &file,
        replaced(&bytes, EXPLICIT, "1.2.840.10008.1.2\0\0\0", 1),
    )
    .unwrap();
    assert_refused(
        folder.path(),
        &["2 names the transfer syntax Implicit", "(0002,0010)"],
    );
}

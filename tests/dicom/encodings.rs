//! Transfer syntaxes, and files that were cut.

use crate::{EXPLICIT, assert_place, assert_refused, axes, fixture, hounsfield, replaced, wrong};
use pao_sim::volume::{VolumeFileError, read_dicom_series};

/// A slice of one series in each.
const ENCODINGS: [&str; 7] = [
    "explicit",
    "implicit",
    "big_endian",
    "deflated",
    "rle",
    "jpeg_lossless",
    "jpeg_lossless_p14",
];

#[test]
fn every_encoding_holds_the_same_voxels() {
    for encoding in ENCODINGS {
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
        std::fs::write(&file, replaced(bytes, from, to)).unwrap();
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
        std::fs::write(&file, replaced(&jpeg, "1.2.840.10008.1.2.4.70", to)).unwrap();
        assert_refused(folder.path(), parts);
    }
}

/// Every length of every encoding: no cut file is read, and none is passed over.
#[test]
fn a_file_that_was_cut_is_refused_wherever_it_was_cut() {
    for encoding in ENCODINGS {
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

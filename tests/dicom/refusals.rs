//! Slices that are no CT in Hounsfield units: file, attribute and advice stand in each message.

use crate::{assert_refused, fixture, replaced};

/// An element in explicit VR little endian with a short length.
fn element(tag: [u16; 2], vr: &str, value: &[u8]) -> Vec<u8> {
    let mut bytes = tag.map(u16::to_le_bytes).concat();
    bytes.extend(vr.as_bytes());
    bytes.extend((value.len() as u16).to_le_bytes());
    bytes.extend(value);
    bytes
}

/// The fixture's first slice with an edit, as `slice.dcm` in a folder for itself.
fn assert_edit_refused(fixture_name: &str, from: &[u8], to: &[u8], parts: &[&str]) {
    let bytes = std::fs::read(fixture(fixture_name)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("slice.dcm"), replaced(&bytes, from, to)).unwrap();
    assert_refused(folder.path(), &[&["slice.dcm has "], parts].concat());
}

#[test]
fn a_picture_in_colour_is_refused() {
    let samples = |n: u16| element([0x28, 2], "US", &n.to_le_bytes());
    assert_edit_refused(
        "encodings/explicit.dcm",
        &samples(1),
        &samples(3),
        &[
            "SamplesPerPixel (0028,0002) = 3",
            "expected 1: a picture in colour has no Hounsfield units",
            "export the original series",
        ],
    );
    let kind = |name: &str| element([0x28, 4], "CS", name.as_bytes());
    for name in ["RGB ", "YBR_FULL", "PALETTE COLOR "] {
        assert_edit_refused(
            "encodings/explicit.dcm",
            &kind("MONOCHROME2 "),
            &kind(name),
            &[
                &format!("PhotometricInterpretation (0028,0004) = {}", name.trim()),
                "expected MONOCHROME2: anything else is a picture to look at",
                "export the original series",
            ],
        );
    }
}

/// A table of values instead of a line: some secondary captures have it.
#[test]
fn a_modality_lut_is_refused() {
    let item = [
        element([0x28, 0x3002], "US", &[2, 0, 0, 0, 16, 0]),
        element([0x28, 0x3004], "LO", b"HU"),
        element([0x28, 0x3006], "US", &[0, 0, 1, 0]),
    ]
    .concat();
    let mut sequence = [0x28_u16, 0x3000].map(u16::to_le_bytes).concat();
    sequence.extend(b"SQ\0\0");
    sequence.extend((item.len() as u32 + 8).to_le_bytes());
    sequence.extend([0xfe, 0xff, 0x00, 0xe0]);
    sequence.extend((item.len() as u32).to_le_bytes());
    sequence.extend(item);
    let unit = element([0x28, 0x1054], "LO", b"HU");
    assert_edit_refused(
        "no_rescale/1.dcm",
        &unit,
        &[&unit[..], &sequence].concat(),
        &[
            "no RescaleSlope (0028,1053)",
            "it has a ModalityLUTSequence instead, which is not read",
            "convert it with another program",
        ],
    );
}

/// Whatever class of image a file says it is.
#[test]
fn several_frames_in_a_file_are_refused() {
    let rows = element([0x28, 0x10], "US", &[4, 0]);
    let frames = element([0x28, 8], "IS", b"2 ");
    assert_edit_refused(
        "encodings/explicit.dcm",
        &rows,
        &[&frames[..], &rows].concat(),
        &[
            "NumberOfFrames (0028,0008) = 2",
            "expected one slice a file",
            "split it with dcm4che's emf2sf, or convert it to NIfTI with dcm2niix",
        ],
    );
}

#[test]
fn what_is_no_ct_in_hounsfield_units_is_refused() {
    for (name, parts) in [
        (
            "mr",
            &[
                "1.dcm has Modality (0008,0060) = MR",
                "expected CT: only a CT has the Hounsfield units",
                "name the folder of a CT series",
            ][..],
        ),
        (
            "monochrome1",
            &[
                "1.dcm has PhotometricInterpretation (0028,0004) = MONOCHROME1",
                "expected MONOCHROME2",
                "export the original series",
            ],
        ),
        (
            "no_rescale",
            &[
                "1.dcm has no RescaleSlope (0028,1053)",
                "export the original series",
            ],
        ),
        (
            "high_bit",
            &[
                "1.dcm has HighBit (0028,0102) = 13",
                "expected 11, one less than BitsStored",
                "export it again",
            ],
        ),
        (
            "us_units",
            &["1.dcm has RescaleType (0028,1054) = US", "expected HU"],
        ),
        (
            "enhanced",
            &[
                "1.dcm has NumberOfFrames (0028,0008) = 2",
                "multi-frame",
                "emf2sf",
            ],
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

//! Against files that pynrrd wrote (scripts/write_vsd.py).

use super::*;
use crate::anatomy::import::Note;
use crate::anatomy::{Side, Structure};
use crate::geometry::Point;
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/vsd")
}

const SCAN: &str = "SMIR.Body.076Y.M.CT.1";

#[test]
fn the_files_of_a_subject_are_found() {
    for dir in [folder(), folder().join(SCAN)] {
        let files = find_vsd(&dir).unwrap();
        assert!(files.ct.ends_with("SMIR.Pelvis-Thighs.nrrd"));
        assert!(
            files
                .segmentation
                .ends_with("SMIR.Pelvis-Thighs_Reconstruction.seg.nrrd")
        );
        assert_eq!(files.sex, "male");
    }
    let other = tempfile::tempdir().unwrap();
    let message = find_vsd(other.path()).unwrap_err().to_string();
    assert!(message.contains("holds 0 files"), "{message}");
    for name in [
        "a.pelvis_Reconstruction.seg.nrrd",
        "a.nrrd",
        "a_Reconstruction.seg.nrrd",
    ] {
        std::fs::write(other.path().join(name), "").unwrap();
    }
    let message = find_vsd(other.path()).unwrap_err().to_string();
    assert!(message.contains("holds 0 CTs"), "{message}");
    std::fs::write(other.path().join("a.Pelvis.nii.gz"), "").unwrap();
    assert!(
        find_vsd(other.path())
            .unwrap()
            .ct
            .ends_with("a.Pelvis.nii.gz")
    );
    std::fs::write(other.path().join("Transform-Upside-Down.h5"), "").unwrap();
    let message = find_vsd(other.path()).unwrap_err().to_string();
    assert!(message.contains("lies upside down"), "{message}");
}

#[test]
fn both_ways_of_slicer_to_save_segments_are_read() {
    let one = find_vsd(&folder()).unwrap().segmentation;
    let layers = folder().join(SCAN).join("layers.seg.nrrd");
    for path in [one, layers] {
        let (read, notes) = read_segmentation(&path).unwrap();
        assert_eq!(notes, vec![]);
        let map = read.volume();
        let grid = &map.grid;
        assert_eq!(grid.dims, [3, 4, 5]);
        for offset in 0..60 {
            assert_eq!(map.data[offset], (offset % 6) as u8);
        }
        let at = grid.center([2, 1, 4]);
        let expected = Point::new(10.0 + 0.8 - 0.45, -20.0 + 0.6 + 0.6, 38.0);
        assert!((at - expected).norm() < 1e-12, "{at}");
    }
}

/// Slicer of today writes the layer and label of each segment; segments that do not overlap share a layer.
#[test]
fn layers_hold_the_segments_that_say_so() {
    let good = std::fs::read(folder().join(SCAN).join("layers.seg.nrrd")).unwrap();
    let end = good.windows(2).position(|w| w == b"\n\n").unwrap();
    let header = std::str::from_utf8(&good[..end]).unwrap();
    let mut header = header
        .replace("sizes: 6 3 4 5", "sizes: 2 3 4 5")
        .replace("gzip", "raw");
    for (number, layer, label) in [(1, 0, 9), (2, 1, 3), (3, 0, 5), (4, 0, 7), (5, 1, 4)] {
        header += &format!("\nSegment{number}_Layer:={layer}\nSegment{number}_LabelValue:={label}");
    }
    let mut bytes = (header + "\n\n").into_bytes();
    for n in 0..60 {
        // The right femur has five voxels of the sacrum as well.
        bytes.extend(match n % 5 {
            0 if n < 25 => [9, 4],
            0 => [9, 0],
            1 => [0, 3],
            2 => [5, 0],
            3 => [7, 0],
            _ => [0, 4],
        });
    }
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), bytes).unwrap();
    let (read, notes) = read_segmentation(file.path()).unwrap();
    for (offset, &value) in read.volume().data.iter().enumerate() {
        assert_eq!(usize::from(value), offset % 5 + 1);
    }
    let overlap = Note::Overlap {
        first: Structure::Sacrum,
        second: Structure::Femur(Side::Right),
        voxels: 5,
    };
    assert_eq!(notes, [overlap]);
    let volume = crate::volume::read_volume::<u8>(file.path()).unwrap_err();
    assert!(volume.to_string().contains("lie in 2 layers"), "{volume}");
}

#[test]
fn the_ct_lies_where_pynrrd_put_it() {
    let subject = read_vsd(&find_vsd(&folder()).unwrap()).unwrap();
    assert_eq!(subject.ct.at(2, 1, 4), 100 * 4 + 10 + 2 - 200);
    assert_eq!(subject.ct.grid, subject.structures.volume().grid);
}

fn message(change: impl Fn(&str) -> String) -> String {
    let good = std::fs::read(folder().join(SCAN).join("layers.seg.nrrd")).unwrap();
    let end = good.windows(2).position(|w| w == b"\n\n").unwrap();
    let mut bytes = change(std::str::from_utf8(&good[..end]).unwrap()).into_bytes();
    bytes.extend(&good[end..]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.seg.nrrd");
    std::fs::write(&path, bytes).unwrap();
    read_segmentation(&path).unwrap_err().to_string()
}

#[test]
fn broken_segmentations_are_refused_with_the_reason() {
    let says = |part: &str, from: &str, to: &str| {
        let message = message(|header| {
            assert!(header.contains(from), "{header}");
            header.replace(from, to)
        });
        assert!(message.contains(part), "expected '{part}' in: {message}");
        assert!(message.contains("broken.seg.nrrd"), "{message}");
    };
    says(
        "360 bytes of voxel values, 396 expected",
        "6 3 4 5",
        "6 3 2 11",
    );
    says("no segment of the name hip_left; it has", "Hip_L", "Liver");
    says("'sizes' '3 4 5'", "6 3 4 5", "3 4 5");
    says("lie in 0 layers", "6 3 4 5", "0 3 4 5");
    says("lie in 5000000 layers", "6 3 4 5", "5000000 3 4 5");
    says("dimensions [6, 3, 1, 20]", "6 3 4 5", "6 3 1 20");
    says("axis 0 does not lie in space and has 6", "list", "vector");
    says("start with NRRD000", "NRRD0005", "PNG");
    says(
        "'space' is 'scanner-xyz'",
        "left-posterior-superior",
        "scanner-xyz",
    );
    says("type short; expected unsigned char", "uint8", "short");
    says("encoding is 'bzip2'", "gzip", "bzip2");
    says("labels are text", "gzip", "text");
    says("no Segment0_Name", "Segment0_Name", "Segment0_Other");
    says("axis 0 does not lie in space and has 6", "Segment", "Other");
    says(
        "Segment2_Layer is 6; expected 0 to 5",
        "Segment2_Name",
        "Segment2_Layer:=6\nSegment2_Name",
    );
    says("not at right angles", "(0,0,2)", "(1,0,2)");
    let ct = find_vsd(&folder()).unwrap().ct;
    let message = read_segmentation(&ct).unwrap_err().to_string();
    assert!(message.contains("it names none"), "{message}");
}

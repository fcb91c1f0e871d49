//! Against files that pynrrd wrote (scripts/write_vsd.py).

use super::*;
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
    says("ends after 60 of 66 voxels", "6 3 4 5", "6 3 2 11");
    says("no segment of the name hip_left", "Hip_L", "Liver");
    says("the sizes [3, 4, 5]", "6 3 4 5", "3 4 5");
    says("expected 2 to 65535", "6 3 4 5", "6 3 1 20");
    says("does not start as", "NRRD0005", "PNG");
    says(
        "the space scanner-xyz",
        "left-posterior-superior",
        "scanner-xyz",
    );
    says("holds short", "uint8", "short");
    says("encoded as bzip2", "gzip", "bzip2");
    says("names no segment", "Segment0_Name", "Other0_Name");
    says("not at right angles", "(0,0,2)", "(1,0,2)");
}

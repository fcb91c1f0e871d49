//! Against a file that h5py wrote (scripts/write_deepfluoro.py).

use super::*;
use crate::anatomy::{Landmark, Side, Structure};
use crate::geometry::{Point, Vector};
use std::path::PathBuf;

fn fixture() -> PathBuf {
    PathBuf::from(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/data/deepfluoro.h5"
    ))
}

#[test]
fn every_voxel_and_point_is_where_h5py_put_it() {
    let first = read_deepfluoro(&fixture(), Some("17-1882")).unwrap();
    assert_eq!(first.ct.grid.dims, [3, 4, 5]);
    assert_eq!(first.ct.at(2, 1, 4), 100 * 4 + 10 + 2 - 200);
    assert_eq!(
        first.ct.grid.center([2, 1, 4]),
        Point::new(-8.5, 21.25, -896.0)
    );
    let map = first.structures.volume();
    assert_eq!(map.grid, first.ct.grid);
    for offset in 0..60 {
        // 3 is vertebrae; both parts of the sacrum are one.
        let expected = [0, 2, 3, 0, 1, 4, 5, 1][offset % 8];
        assert_eq!(map.data[offset], expected, "{offset}");
    }
    let head = first.landmarks.get(Landmark::Fh, Side::Left);
    assert_eq!(head, Some(Point::new(93.2, 37.9, -941.5)));
    assert_eq!(first.landmarks.iter().count(), 2);
    assert_eq!(first.notes.len(), 1, "{:?}", first.notes);
    assert!(first.notes[0].to_string().contains("X-l"));

    // Integers, shuffled, without names, with axes of their own: columns of dir-mat are index axes.
    let second = read_deepfluoro(&fixture(), Some("18-1109")).unwrap();
    assert_eq!(second.ct.data, first.ct.data);
    assert_eq!(second.structures.volume().data, map.data);
    assert_eq!(second.ct.grid.spacing, [0.5, 0.75, 2.0]);
    let at = second.ct.grid.center([2, 3, 4]);
    assert!(
        (at - Point::new(1.0 - 3.0 * 0.75, 2.0 + 2.0 * 0.5, 3.0 + 8.0)).norm() < 1e-12,
        "{at}"
    );
    assert_eq!(second.ct.grid.direction.column(0), Vector::y());
    assert_eq!(
        second.structures.count(Structure::Sacrum),
        first.structures.count(Structure::Sacrum)
    );
}

#[test]
fn a_specimen_must_be_named_and_there() {
    let message = |id| read_deepfluoro(&fixture(), id).unwrap_err().to_string();
    assert!(message(None).contains("holds 17-1882, 18-1109; say which"));
    assert!(message(Some("17")).contains("no specimen '17'; it holds 17-1882"));
    let message = |id| {
        read_deepfluoro(std::path::Path::new(id), None)
            .unwrap_err()
            .to_string()
    };
    assert!(message("no/such.h5").contains("no/such.h5"));
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    assert!(message(source).contains("not a readable HDF5 file"));
}

/// Broken files are refused without a panic and without more memory than the file's size allows.
#[test]
fn broken_bytes_are_refused() {
    use crate::random::{Purpose, stream};
    use rand::RngExt;
    let good = std::fs::read(fixture()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.h5");
    let mut stream = stream(5, Purpose::PhantomShape, "hdf5 mutations");
    let mut refused = 0;
    for _ in 0..400 {
        let mut bytes = good.clone();
        for _ in 0..stream.random_range(1..6) {
            let at = stream.random_range(0..bytes.len());
            bytes[at] = stream.random();
        }
        if stream.random_range(0..8) == 0 {
            bytes.truncate(stream.random_range(0..good.len()));
        }
        std::fs::write(&path, bytes).unwrap();
        refused += usize::from(read_deepfluoro(&path, Some("18-1109")).is_err());
    }
    assert!(refused > 20, "{refused}");
}

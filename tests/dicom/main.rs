//! CT volumes read from DICOM series: small synthetic ones that pydicom wrote (`tests/data/dicom`),
//! and 32 slices of a real body.

mod encodings;
mod real;
mod refusals;
mod series;
mod voxels;

use pao_sim::geometry::Vector;
use pao_sim::volume::{Volume, read_dicom_series};
use std::path::{Path, PathBuf};

/// The transfer syntax of most fixtures, as their meta header writes it.
const EXPLICIT: &str = "1.2.840.10008.1.2.1\0";

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

fn axes() -> [Vector; 3] {
    [Vector::x(), Vector::y(), Vector::z()]
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

/// `bytes` with the only place of `from` replaced; a text within an element keeps its length.
fn replaced(bytes: &[u8], from: impl AsRef<[u8]>, to: impl AsRef<[u8]>) -> Vec<u8> {
    let (from, to) = (from.as_ref(), to.as_ref());
    let places: Vec<usize> = (0..bytes.len())
        .filter(|&at| bytes[at..].starts_with(from))
        .collect();
    let &[at] = places.as_slice() else {
        panic!("'{}' at {places:?}", from.escape_ascii());
    };
    [&bytes[..at], to, &bytes[at + from.len()..]].concat()
}

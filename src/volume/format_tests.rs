//! The same volume written through each format and both conventions comes back equal.

use super::metaimage::read_metaimage;
use super::nifti::{NiftiVoxel, read_nifti, write_nifti};
use super::nrrd::{nrrd_segment_names, read_nrrd};
use super::{Grid, Volume, VolumeFileError, Voxel, read_volume};
use crate::geometry::{Point, Vector};
use flate2::Compression;
use nalgebra::{Matrix3, Rotation3};
use proptest::prelude::*;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A voxel that the writers below write.
trait Written: NiftiVoxel + PartialEq + std::fmt::Debug {
    const NRRD: &str;
    const METAIMAGE: &str;
    fn bytes(self, big: bool) -> Vec<u8>;
}

impl Written for i16 {
    const NRRD: &str = "short";
    const METAIMAGE: &str = "MET_SHORT";
    fn bytes(self, big: bool) -> Vec<u8> {
        match big {
            true => self.to_be_bytes().into(),
            false => self.to_le_bytes().into(),
        }
    }
}

impl Written for u8 {
    const NRRD: &str = "unsigned char";
    const METAIMAGE: &str = "MET_UCHAR";
    fn bytes(self, _: bool) -> Vec<u8> {
        vec![self]
    }
}

/// How a file is written.
#[derive(Clone, Copy, Debug)]
struct Way {
    /// RAS where the format has it, else LPS.
    ras: bool,
    compressed: bool,
    big: bool,
    detached: bool,
}

impl Way {
    fn all() -> impl Iterator<Item = Self> {
        (0..16).map(|n| Self {
            ras: n & 1 != 0,
            compressed: n & 2 != 0,
            big: n & 4 != 0,
            detached: n & 8 != 0,
        })
    }
}

fn raw<T: Written>(volume: &Volume<T>, big: bool) -> Vec<u8> {
    volume.data.iter().flat_map(|v| v.bytes(big)).collect()
}

fn numbers(values: impl IntoIterator<Item = f64>, between: &str) -> String {
    let texts: Vec<String> = values.into_iter().map(|v| v.to_string()).collect();
    texts.join(between)
}

fn write_nrrd<T: Written>(volume: &Volume<T>, way: Way, folder: &Path) -> PathBuf {
    let grid = &volume.grid;
    let sign = if way.ras { -1.0 } else { 1.0 };
    let world = |v: Vector| format!("({})", numbers([sign * v.x, sign * v.y, v.z], ","));
    let axes = (0..3).map(|a| world(grid.direction.column(a) * grid.spacing[a]));
    let mut header = format!(
        "NRRD0004\ntype: {}\ndimension: 3\nspace: {}\nsizes: {} {} {}\nspace directions: {}\nspace origin: {}\n\
         encoding: {}\nendian: {}\n",
        T::NRRD,
        ["left-posterior-superior", "right-anterior-superior"][usize::from(way.ras)],
        grid.dims[0],
        grid.dims[1],
        grid.dims[2],
        axes.collect::<Vec<_>>().join(" "),
        world(grid.origin.coords),
        ["raw", "gzip"][usize::from(way.compressed)],
        ["little", "big"][usize::from(way.big)],
    );
    let mut data = raw(volume, way.big);
    if way.compressed {
        let mut gz = flate2::write::GzEncoder::new(Vec::new(), Compression::fast());
        gz.write_all(&data).unwrap();
        data = gz.finish().unwrap();
    }
    if way.detached {
        header += "data file: voxels\n";
        std::fs::write(folder.join("voxels"), data).unwrap();
        data = Vec::new();
    } else {
        header += "\n";
    }
    written(folder, ["a.nrrd", "a.nhdr"], way, header, data)
}

fn write_metaimage<T: Written>(volume: &Volume<T>, way: Way, folder: &Path) -> PathBuf {
    let grid = &volume.grid;
    let axes = (0..3).flat_map(|a| grid.direction.column(a).iter().copied().collect::<Vec<_>>());
    let flag = |on: bool| ["False", "True"][usize::from(on)];
    let header = format!(
        "NDims = 3\nDimSize = {} {} {}\nElementType = {}\nElementSpacing = {}\nTransformMatrix = {}\nOffset = {}\n\
         CompressedData = {}\nBinaryDataByteOrderMSB = {}\nElementDataFile = {}\n",
        grid.dims[0],
        grid.dims[1],
        grid.dims[2],
        T::METAIMAGE,
        numbers(grid.spacing, " "),
        numbers(axes, " "),
        numbers(grid.origin.iter().copied(), " "),
        flag(way.compressed),
        flag(way.big),
        ["LOCAL", "voxels"][usize::from(way.detached)],
    );
    let mut data = raw(volume, way.big);
    if way.compressed {
        let mut zlib = flate2::write::ZlibEncoder::new(Vec::new(), Compression::fast());
        zlib.write_all(&data).unwrap();
        data = zlib.finish().unwrap();
    }
    if way.detached {
        std::fs::write(folder.join("voxels"), data).unwrap();
        data = Vec::new();
    }
    written(folder, ["a.mha", "a.mhd"], way, header, data)
}

fn written(folder: &Path, names: [&str; 2], way: Way, header: String, data: Vec<u8>) -> PathBuf {
    let path = folder.join(names[usize::from(way.detached)]);
    std::fs::write(&path, [header.into_bytes(), data].concat()).unwrap();
    path
}

/// Voxels equal, and the same grid to within `tolerance_mm` at every voxel.
fn same<T: Written>(
    found: Result<Volume<T>, VolumeFileError>,
    expected: &Volume<T>,
    tolerance_mm: f64,
) -> Result<(), TestCaseError> {
    let found = found.map_err(|error| TestCaseError::fail(error.to_string()))?;
    prop_assert_eq!(found.grid.dims, expected.grid.dims);
    prop_assert_eq!(&found.data, &expected.data);
    for offset in 0..found.data.len() {
        let voxel = found.grid.voxel(offset);
        let apart = (found.grid.center(voxel) - expected.grid.center(voxel)).norm();
        prop_assert!(apart < tolerance_mm, "{:?} lies {} mm off", voxel, apart);
    }
    Ok(())
}

fn comes_back<T: Written>(volume: &Volume<T>) -> Result<(), TestCaseError> {
    let folder = tempfile::tempdir().unwrap();
    for way in Way::all() {
        let path = write_nrrd(volume, way, folder.path());
        same(read_nrrd(&path), volume, 1e-9)?;
        same(read_volume(&path), volume, 1e-9)?;
        let path = write_metaimage(volume, way, folder.path());
        same(read_metaimage(&path), volume, 1e-9)?;
        same(read_volume(&path), volume, 1e-9)?;
    }
    for name in ["a.nii", "a.nii.gz"] {
        let path = folder.path().join(name);
        write_nifti(volume, &path).unwrap();
        same(read_nifti(&path), volume, 1e-3)?;
        same(read_volume(&path), volume, 1e-3)?;
    }
    Ok(())
}

fn grids() -> impl Strategy<Value = Grid> {
    let dims = prop::array::uniform3(2..6_usize);
    let spacing = prop::array::uniform3(0.1..5.0_f64);
    let origin = prop::array::uniform3(-1500.0..1500.0_f64);
    let angles = prop::array::uniform3(-3.2..3.2_f64);
    (dims, spacing, origin, angles, 0..12_u8).prop_map(|(dims, spacing, origin, angles, axes)| {
        // Half of them turned, half along the world's axes in any order; half of either mirrored.
        let mut direction = match axes % 6 {
            0..3 => *Rotation3::from_euler_angles(angles[0], angles[1], angles[2]).matrix(),
            n => Matrix3::from_fn(|r, c| f64::from(u8::from((r + usize::from(n)) % 3 == c))),
        };
        if axes >= 6 {
            direction.column_mut(1).neg_mut();
        }
        Grid {
            dims,
            spacing,
            origin: Point::from(origin),
            direction,
        }
    })
}

fn volumes<T: Written + Arbitrary>() -> impl Strategy<Value = Volume<T>> {
    grids().prop_flat_map(|grid| {
        prop::collection::vec(any::<T>(), grid.len())
            .prop_map(move |data| Volume::new(grid.clone(), data))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn hounsfield_units_come_back(volume in volumes::<i16>()) {
        comes_back(&volume)?;
    }

    #[test]
    fn labels_come_back(volume in volumes::<u8>()) {
        comes_back(&volume)?;
    }
}

fn example() -> Volume<u8> {
    let grid = Grid::axis_aligned([2, 3, 4], 1.5, Point::new(1.0, 2.0, 3.0));
    Volume::new(grid, (0..24).collect())
}

const PLAIN: Way = Way {
    ras: false,
    compressed: false,
    big: false,
    detached: false,
};

/// Reads the file with a part of its header replaced.
fn edited<T: Voxel>(path: &Path, from: &str, to: &str) -> Result<Volume<T>, VolumeFileError> {
    let bytes = std::fs::read(path).unwrap();
    let at = bytes.windows(from.len()).position(|w| w == from.as_bytes());
    let at = at.unwrap_or_else(|| panic!("no '{from}' in {}", path.display()));
    let end = at + from.len();
    let copy = path.with_file_name(format!("edited-{}", path.file_name().unwrap().display()));
    std::fs::write(&copy, [&bytes[..at], to.as_bytes(), &bytes[end..]].concat()).unwrap();
    read_volume(&copy)
}

fn refusals(path: &Path, cases: &[(&str, &str, &str)]) {
    for (from, to, part) in cases {
        let message = edited::<u8>(path, from, to).unwrap_err().to_string();
        assert!(message.contains(part), "expected '{part}' in: {message}");
        assert!(message.contains("edited-"), "names the file: {message}");
    }
}

#[test]
fn nrrd_files_that_are_not_what_they_must_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = write_nrrd(&example(), PLAIN, folder.path());
    refusals(
        &path,
        &[
            ("encoding: raw", "encoding: bzip2", "raw or gzip"),
            ("encoding: raw", "encoding: hex", "raw or gzip"),
            (
                "space: left-posterior-superior",
                "space: scanner-xyz",
                "left from right",
            ),
            (
                "space: left-posterior-superior",
                "space dimension: 3",
                "no 'space'",
            ),
            (
                "space: left-posterior-superior",
                "space: LPST",
                "left from right",
            ),
            (
                "space directions",
                "# space directions",
                "no 'space directions'",
            ),
            (
                "space directions: (1.5,0,0) ",
                "space directions: (1.5,0,0) none ",
                "for each of 3 axes",
            ),
            ("(1.5,0,0)", "(1.5,0,)", "expected (x,y,z)"),
            ("(1.5,0,0)", "(1.5,1.5,0)", "right angles"),
            ("(1.5,0,0)", "(1e300,0,0)", "voxels have the size"),
            ("(1.5,0,0)", "(nan,0,0)", "not finite"),
            ("(1.5,0,0)", "none", "2 values"),
            ("space origin", "# space origin", "no 'space origin'"),
            (
                "encoding",
                "space units: \"mm\" \"cm\" \"mm\"\nencoding",
                "lengths in 'cm'",
            ),
            (
                "encoding",
                "kinds: domain time domain\nencoding",
                "axis 1 is of the kind 'time'",
            ),
            ("encoding", "byte skip: -2\nencoding", "expected 0 or more"),
            ("encoding", "data file: LIST\nencoding", "several files"),
            (
                "encoding",
                "data file: a%d.raw 1 4 1\nencoding",
                "several files",
            ),
            (
                "sizes: 2 3 4",
                "sizes: 2 3 5",
                "24 bytes of voxel values, 30 expected",
            ),
            ("sizes: 2 3 4", "sizes: 24 1 1", "dimensions [24, 1, 1]"),
            ("sizes: 2 3 4", "sizes: 2 3 -4", "dimensions [2, 3, -4]"),
            (
                "sizes: 2 3 4",
                "sizes: 4294967296 4294967296 4294967296",
                "more than any file",
            ),
            (
                "type: unsigned char",
                "type: short",
                "24 bytes of voxel values, 48 expected",
            ),
        ],
    );
    // One byte a voxel needs no byte order, two do.
    edited::<u8>(&path, "endian: little\n", "").unwrap();
    let ct = write_nrrd(&example().map(i16::from), PLAIN, folder.path());
    refusals(&ct, &[("endian: little\n", "", "expected little or big")]);
}

#[test]
fn axes_outside_space_are_passed_over_when_they_hold_one_value() {
    let folder = tempfile::tempdir().unwrap();
    let path = write_nrrd(&example(), PLAIN, folder.path());
    let bytes = std::fs::read(&path).unwrap();
    let header = String::from_utf8_lossy(&bytes).replace("dimension: 3", "dimension: 4");
    for (sizes, none, at) in [("1 2 3 4", "none ", 0), ("2 3 4 1", " none", 1)] {
        let four = header.replace("sizes: 2 3 4", &format!("sizes: {sizes}"));
        let directions = "(1.5,0,0) (0,1.5,0) (0,0,1.5)";
        let places = [format!("{none}{directions}"), format!("{directions}{none}")];
        let four = four.replace(directions, &places[at]);
        std::fs::write(&path, four).unwrap();
        assert_eq!(read_nrrd::<u8>(&path).unwrap(), example(), "{sizes}");
    }
}

#[test]
fn metaimage_files_that_are_not_what_they_must_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = write_metaimage(&example(), PLAIN, folder.path());
    refusals(
        &path,
        &[
            (
                "TransformMatrix",
                "Transform",
                "no 'TransformMatrix'; write",
            ),
            ("Offset", "Shift", "no 'Offset'; write"),
            ("ElementSpacing", "Spacing", "no 'ElementSpacing'"),
            (
                "ElementSpacing = 1.5",
                "ElementSpacing = -1.5",
                "positive lengths",
            ),
            ("ElementSpacing = 1.5", "ElementSpacing = nan", "not finite"),
            (
                "TransformMatrix = 1 0",
                "TransformMatrix = 1 1",
                "right angles",
            ),
            (
                "TransformMatrix = 1 0",
                "TransformMatrix = 1",
                "expected 9 numbers",
            ),
            ("NDims", "DistanceUnits = cm\nNDims", "lengths in 'cm'"),
            (
                "NDims",
                "ElementNumberOfChannels = 3\nNDims",
                "3 values a voxel",
            ),
            (
                "NDims",
                "ElementToIntensityFunctionSlope = 2\nNDims",
                "value * 2 + 0",
            ),
            ("NDims", "ObjectType = Tube\nNDims", "holds a 'Tube'"),
            ("NDims", "HeaderSize = -3\nNDims", "'HeaderSize' is -3"),
            ("NDims", "BinaryData = maybe\nNDims", "True or False"),
            ("LOCAL", "LIST", "several files"),
            ("LOCAL", "slice%03d.raw 1 4 1", "several files"),
            (
                "DimSize = 2 3 4",
                "DimSize = 2 3 5",
                "24 bytes of voxel values, 30 expected",
            ),
            (
                "DimSize = 2 3 4",
                "DimSize = 4294967296 4294967296 4294967296",
                "more than any file",
            ),
            (
                "CompressedData = False",
                "CompressedData = True\nHeaderSize = -1",
                "'HeaderSize' is -1",
            ),
            (
                "CompressedData = False",
                "CompressedData = True\nBinaryData = False",
                "compressed text",
            ),
            ("NDims", "BinaryData = False\nNDims", "which is no number"),
        ],
    );
    // What contradicts the matrix is only logged.
    let with = edited::<u8>(&path, "NDims", "AnatomicalOrientation = LPS\nNDims");
    assert_eq!(with.unwrap(), example());
}

#[test]
fn a_missing_data_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let way = Way {
        detached: true,
        ..PLAIN
    };
    for path in [
        write_nrrd(&example(), way, folder.path()),
        write_metaimage(&example(), way, folder.path()),
    ] {
        read_volume::<u8>(&path).unwrap();
        let _ = std::fs::remove_file(folder.path().join("voxels"));
        let message = read_volume::<u8>(&path).unwrap_err().to_string();
        assert!(message.contains("voxels"), "{message}");
        std::fs::write(folder.path().join("voxels"), [7; 24]).unwrap();
    }
}

/// Slicer's keys, without those that say how segments are shown.
fn segmentation(folder: &Path, keys: &str) -> PathBuf {
    let path = write_nrrd(&example(), PLAIN, folder);
    let text = String::from_utf8(std::fs::read(&path).unwrap()).unwrap();
    let path = folder.join("a.seg.nrrd");
    std::fs::write(&path, text.replacen("\n\n", &format!("\n{keys}\n"), 1)).unwrap();
    path
}

const SEGMENTS: &str = "Segment0_ID:=Segment_1\nSegment0_LabelValue:=3\nSegment0_Layer:=0\nSegment0_Name:=left hip\n\
    Segment10_LabelValue:=7\nSegment10_Layer:=0\nSegment10_Name:=sacrum\\nand more\nSegment2_LabelValue:=1\n\
    Segment2_Layer:=0\nSegment2_Name:=right hip\nSegmentation_ReferenceImageExtentOffset:=10 20 30\n";

#[test]
fn a_segmentation_is_a_label_map_with_names() {
    let folder = tempfile::tempdir().unwrap();
    let path = segmentation(folder.path(), SEGMENTS);
    assert_eq!(read_volume::<u8>(&path).unwrap(), example());
    let names = nrrd_segment_names(&path).unwrap();
    let expected = [(3, "left hip"), (1, "right hip"), (7, "sacrum\nand more")];
    assert_eq!(
        names,
        expected.map(|(label, name)| (label, name.to_owned()))
    );
    let plain = write_nrrd(&example(), PLAIN, folder.path());
    assert_eq!(nrrd_segment_names(&plain).unwrap(), []);
    let refused = |from: &str, to: &str, part: &str| {
        let path = segmentation(folder.path(), &SEGMENTS.replace(from, to));
        let message = nrrd_segment_names(&path).unwrap_err().to_string();
        assert!(message.contains(part), "expected '{part}' in: {message}");
    };
    refused(
        "LabelValue:=7",
        "LabelValue:=300",
        "Segment10_LabelValue is 300",
    );
    refused(
        "LabelValue:=7",
        "LabelValue:=3",
        "two of its segments have the label 3",
    );
    refused(
        "Segment2_LabelValue",
        "Segment2_Extent",
        "Segment2_LabelValue is missing",
    );
    refused("Segment2_Name", "Segment2_Extent", "no Segment2_Name");
    refused(
        "Segment2_Layer:=0",
        "Segment2_Layer:=1",
        "Segment2_Layer is 1; expected 0 to 0",
    );
}

#[test]
fn overlapping_segments_are_refused_with_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let path = segmentation(folder.path(), SEGMENTS);
    let text = String::from_utf8(std::fs::read(&path).unwrap()).unwrap();
    let text = text
        .replace("dimension: 3", "dimension: 4")
        .replace("sizes: 2 3 4", "sizes: 2 2 3 2")
        .replace("(1.5,0,0)", "none (1.5,0,0)");
    std::fs::write(&path, text).unwrap();
    let volume = read_volume::<u8>(&path).unwrap_err();
    let names = nrrd_segment_names(&path).unwrap_err();
    for message in [volume.to_string(), names.to_string()] {
        assert!(message.contains("2 layers"), "{message}");
        assert!(message.contains("in Slicer, export"), "{message}");
    }
}

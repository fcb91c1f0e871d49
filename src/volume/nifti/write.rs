//! Writing a volume.

use super::affine::set_grid;
use super::voxel::NiftiVoxel;
use crate::volume::{Volume, VolumeFileError};
use ::nifti::NiftiHeader;
use ::nifti::writer::WriterOptions;
use ndarray::{ArrayView3, ShapeBuilder};
use std::fs::File;
use std::path::Path;

/// Writes a volume as `.nii` or `.nii.gz`, by its name's end. The file appears whole or not at
/// all: it is written under another name, synced and renamed. The header's floats have 32 bits,
/// which moves a voxel by less than 1e-4 mm.
///
/// # Errors
/// When the name ends otherwise, a dimension is beyond the format's 32767, or the disk refuses.
pub fn write_nifti<T: NiftiVoxel>(volume: &Volume<T>, path: &Path) -> Result<(), VolumeFileError> {
    let io = |source| VolumeFileError::Io {
        doing: "write",
        path: path.into(),
        source,
    };
    let unwritable = |reason: String| VolumeFileError::Unwritable {
        path: path.into(),
        reason,
    };
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned());
    let suffix = match name {
        Some(n) if n.ends_with(".nii.gz") => ".nii.gz",
        Some(n) if n.ends_with(".nii") => ".nii",
        _ => return Err(unwritable("its name must end with .nii or .nii.gz".into())),
    };
    let dims = volume.grid.dims;
    if dims.iter().any(|&d| d < 2 || d > i16::MAX as usize) {
        return Err(unwritable(format!(
            "its dimensions are {dims:?}; the format holds 2 to {} voxels along an axis",
            i16::MAX
        )));
    }

    let folder = match path.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    let temporary = tempfile::Builder::new()
        .prefix(".partial-")
        .suffix(suffix)
        .permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666))
        .tempfile_in(folder)
        .map_err(io)?;

    let mut header = NiftiHeader {
        xyzt_units: 2, // mm
        ..NiftiHeader::default()
    };
    set_grid(&mut header, &volume.grid);
    let values = ArrayView3::from_shape(dims.f(), &volume.data)
        .expect("a volume holds one value per voxel of its grid");
    let options = WriterOptions::new(temporary.path()).reference_header(&header);
    T::write(values, &options).map_err(|error| match error {
        ::nifti::NiftiError::Io(source) => io(source),
        other => unwritable(other.to_string()),
    })?;

    // The writer drops its buffer without looking whether the last bytes arrived.
    if suffix == ".nii" {
        let expected = 352 + size_of_val(volume.data.as_slice()) as u64;
        let found = temporary.as_file().metadata().map_err(io)?.len();
        if found != expected {
            return Err(unwritable(format!(
                "only {found} of {expected} bytes could be written; is the disk full?"
            )));
        }
    }
    temporary.as_file().sync_all().map_err(io)?;
    temporary.persist(path).map_err(|e| io(e.error))?;
    File::open(folder).and_then(|f| f.sync_all()).map_err(io)
}

#[cfg(test)]
mod tests {
    use super::super::read_nifti;
    use super::*;
    use crate::geometry::Point;
    use crate::volume::Grid;
    use std::io::Write;
    use std::path::PathBuf;

    fn ct() -> Volume<i16> {
        let grid = Grid {
            dims: [5, 4, 3],
            spacing: [0.5, 0.75, 2.0],
            origin: Point::new(-120.5, 33.25, 810.0),
            direction: *nalgebra::Rotation3::from_euler_angles(0.1, 0.2, 0.3).matrix(),
        };
        let data = (0..60).map(|n| n * 37 - 1024).collect();
        Volume::new(grid, data)
    }

    fn written(name: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        write_nifti(&ct(), &path).unwrap();
        (folder, path)
    }

    #[test]
    fn round_trip_keeps_values_and_places() {
        for name in ["a.nii", "b.x.nii.gz"] {
            let (folder, path) = written(name);
            let back = read_nifti::<i16>(&path).unwrap();
            assert_eq!(back.data, ct().data);
            for corner in [[0, 0, 0], [4, 3, 2]] {
                let apart = back.grid.center(corner) - ct().grid.center(corner);
                assert!(apart.norm() < 1e-4, "{name} {corner:?}: {apart}");
            }
            // Trips do not drift.
            write_nifti(&back, &path).unwrap();
            let twice = read_nifti::<i16>(&path).unwrap();
            let apart = twice.grid.center([4, 3, 2]) - back.grid.center([4, 3, 2]);
            assert!(apart.norm() < 1e-6, "{name}: {apart}");
            let files = std::fs::read_dir(folder.path()).unwrap().count();
            assert_eq!(files, 1, "no temporary file is left");
        }
    }

    /// The same bytes written by hand in the other byte order, as floats, with scaling.
    #[test]
    fn big_endian_scaled_floats_are_read() {
        let (_folder, path) = written("a.nii");
        let mut bytes = std::fs::read(&path).unwrap()[..352].to_vec();
        let swap = |bytes: &mut [u8], at: usize, size: usize| bytes[at..at + size].reverse();
        for at in [0, 32] {
            swap(&mut bytes, at, 4);
        }
        (0..8).for_each(|n| swap(&mut bytes, 40 + 2 * n, 2));
        bytes[70..74].copy_from_slice(&[0, 16, 0, 32]);
        (0..8).for_each(|n| swap(&mut bytes, 76 + 4 * n, 4));
        swap(&mut bytes, 108, 4);
        bytes[112..116].copy_from_slice(&0.5_f32.to_be_bytes());
        bytes[116..120].copy_from_slice(&(-7.0_f32).to_be_bytes());
        [252, 254]
            .into_iter()
            .for_each(|at| swap(&mut bytes, at, 2));
        (0..18).for_each(|n| swap(&mut bytes, 256 + 4 * n, 4));
        for n in 0..60 {
            bytes.extend((n as f32 * 2.0).to_be_bytes());
        }
        std::fs::write(&path, bytes).unwrap();
        let back = read_nifti::<i16>(&path).unwrap();
        assert_eq!(back.data, (0..60).map(|n| n - 7).collect::<Vec<i16>>());
        assert!((back.grid.center([4, 3, 2]) - ct().grid.center([4, 3, 2])).norm() < 1e-4);
    }

    fn message(change: impl Fn(&mut Vec<u8>)) -> String {
        let (_folder, path) = written("a.nii");
        let mut bytes = std::fs::read(&path).unwrap();
        change(&mut bytes);
        std::fs::write(&path, bytes).unwrap();
        let message = read_nifti::<i16>(&path).unwrap_err().to_string();
        assert!(message.contains("a.nii"), "names the file: {message}");
        message
    }

    #[test]
    fn broken_files_are_refused_with_the_reason() {
        let says = |text: &str, change: fn(&mut Vec<u8>)| {
            let message = message(change);
            assert!(message.contains(text), "expected '{text}' in: {message}");
        };
        says("shorter than a header", |b| b.truncate(200));
        says("Invalid NIfTI-1", |b| b[344..348].fill(b'x'));
        says(".hdr/.img", |b| b[345] = b'i');
        says("119 bytes of voxel values, 120 expected", |b| {
            b.truncate(352 + 119)
        });
        says("dimensions [5, 4]", |b| b[40] = 2);
        says("dimensions [5, 4, 3, 2]", |b| (b[40], b[48]) = (4, 2));
        says("dimensions [5, 1, 3]", |b| b[44] = 1);
        says("unit code 1", |b| b[123] = 1);
        says("datatype 128", |b| b[70] = 128);
        says("where its voxels lie", |b| b[280..296].fill(0xff));
        says("voxels start at byte 12", |b| {
            b[108..112].copy_from_slice(&12.0_f32.to_le_bytes())
        });
    }

    #[test]
    fn a_cut_off_gzip_file_is_truncated_and_garbage_is_no_nifti() {
        let (_folder, path) = written("a.nii.gz");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 40]).unwrap();
        let error = read_nifti::<i16>(&path).unwrap_err();
        assert!(
            matches!(error, VolumeFileError::Truncated { .. }),
            "{error}"
        );
        std::fs::write(&path, b"\x1f\x8bgarbage that is no gzip stream").unwrap();
        let error = read_nifti::<i16>(&path).unwrap_err();
        assert!(matches!(error, VolumeFileError::Format { .. }), "{error}");
        assert!(matches!(
            read_nifti::<i16>(Path::new("no/such.nii")),
            Err(VolumeFileError::Io { .. })
        ));
    }

    #[test]
    fn several_gzip_members_are_one_file() {
        let (_folder, path) = written("a.nii");
        let bytes = std::fs::read(&path).unwrap();
        let mut members = Vec::new();
        for part in bytes.chunks(300) {
            let mut gz = flate2::write::GzEncoder::new(&mut members, Default::default());
            gz.write_all(part).unwrap();
            gz.finish().unwrap();
        }
        std::fs::write(&path, members).unwrap();
        assert_eq!(read_nifti::<i16>(&path).unwrap().data, ct().data);
    }

    #[test]
    fn a_label_map_holds_whole_numbers_only() {
        let (_folder, path) = written("a.nii");
        let message = read_nifti::<u8>(&path).unwrap_err().to_string();
        assert!(
            message.contains("voxel [0, 0, 0]") && message.contains("-1024"),
            "{message}"
        );
        assert!(message.contains("0 to 255"), "{message}");
    }
}

//! One way in for every format.

use super::dicom::read_dicom_series;
use super::metaimage::{is_metaimage, read_metaimage};
use super::nifti::{is_nifti, read_nifti};
use super::nrrd::read_nrrd;
use super::samples::voxel_of;
use super::{Volume, VolumeFileError, Voxel, nrrd, source};
use std::io::Read;
use std::path::Path;

/// Bytes at a file's start that tell its format.
const START_BYTES: u64 = 1024;

/// What is read, for messages.
const READ: &str = "NIfTI-1 (.nii, .nii.gz), NRRD (.nrrd, .nhdr), MetaImage (.mha, .mhd), a folder of a DICOM series";

/// The formats of single files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Nifti,
    Nrrd,
    MetaImage,
    Dicom,
}

/// Reads a volume of any format that is known: by the file's content or, where that tells nothing, by its
/// name. A folder, or a `.dcm` file in it, is a DICOM series.
///
/// # Errors
/// As the format's reader has them, or when the format is unknown.
pub fn read_volume<T: Voxel>(path: &Path) -> Result<Volume<T>, VolumeFileError> {
    if path.is_dir() {
        return read_series(path);
    }
    let mut start = Vec::new();
    source::open(path)?
        .take(START_BYTES)
        .read_to_end(&mut start)
        .map_err(source::unreadable(path))?;
    match by_content(&start).or_else(|| by_name(path)) {
        Some(Format::Nifti) => read_nifti(path),
        Some(Format::Nrrd) => read_nrrd(path),
        Some(Format::MetaImage) => read_metaimage(path),
        Some(Format::Dicom) => read_series(path),
        None => Err(VolumeFileError::Format {
            path: path.into(),
            format: "volume file",
            reason: format!("it has another format than {READ}"),
        }),
    }
}

/// Reads the one DICOM series of a folder, or the series that a file of it belongs to.
fn read_series<T: Voxel>(path: &Path) -> Result<Volume<T>, VolumeFileError> {
    let ct = read_dicom_series(path)?;
    let voxels = ct.data.iter().enumerate();
    let data = voxels
        .map(|(offset, &hu)| voxel_of(hu.into(), &ct.grid, offset, path))
        .collect::<Result<_, _>>()?;
    Ok(Volume::new(ct.grid, data))
}

fn by_content(start: &[u8]) -> Option<Format> {
    if start.starts_with(nrrd::START) {
        Some(Format::Nrrd)
    } else if is_nifti(start) {
        Some(Format::Nifti)
    } else if start.get(128..132) == Some(b"DICM") {
        Some(Format::Dicom)
    } else if is_metaimage(start) {
        Some(Format::MetaImage)
    } else {
        None
    }
}

fn by_name(path: &Path) -> Option<Format> {
    let name = path.file_name()?.to_string_lossy().to_ascii_lowercase();
    let ends = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
    if ends(&[".nii", ".nii.gz", ".hdr", ".img"]) {
        Some(Format::Nifti)
    } else if ends(&[".nrrd", ".nhdr"]) {
        Some(Format::Nrrd)
    } else if ends(&[".mha", ".mhd"]) {
        Some(Format::MetaImage)
    } else if ends(&[".dcm"]) {
        Some(Format::Dicom)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    #[test]
    fn content_goes_before_name() {
        assert_eq!(by_content(b"NRRD0004\n"), Some(Format::Nrrd));
        assert_eq!(by_content(b"\n NDims = 3\n"), Some(Format::MetaImage));
        assert_eq!(by_content(b"colour = blue\n"), None);
        let mut nifti = vec![0; 400];
        nifti[..4].copy_from_slice(&348_i32.to_be_bytes());
        assert_eq!(by_content(&nifti), None, "no magic");
        nifti[344..348].copy_from_slice(b"n+1\0");
        assert_eq!(by_content(&nifti), Some(Format::Nifti));
        let mut gz = flate2::write::GzEncoder::new(Vec::new(), Default::default());
        gz.write_all(&nifti).unwrap();
        assert_eq!(by_content(&gz.finish().unwrap()), Some(Format::Nifti));
        let mut dicom = vec![0; 200];
        dicom[128..132].copy_from_slice(b"DICM");
        assert_eq!(by_content(&dicom), Some(Format::Dicom));
    }

    #[test]
    fn what_is_not_known_is_told_with_what_is() {
        let folder = tempfile::tempdir().unwrap();
        let says = |path: &Path, part: &str| {
            let message = read_volume::<i16>(path).unwrap_err().to_string();
            assert!(message.contains(part), "expected '{part}' in: {message}");
        };
        let path = folder.path().join("a.png");
        std::fs::write(&path, "some picture").unwrap();
        says(&path, "NRRD (.nrrd, .nhdr), MetaImage (.mha, .mhd)");
        for (name, part) in [
            ("a.NII.gz", "NIfTI-1 file"),
            ("a.nhdr", "NRRD file"),
            ("a.mha", "MetaImage file"),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, "some picture").unwrap();
            says(&path, part);
        }
        says(folder.path(), "holds no slice of a CT");
        says(Path::new("no/such.nrrd"), "No such file");
        says(Path::new("/dev/null"), "no regular file");
    }
}

//! Reading a series.

use super::data_set::{DataSet, Opened};
use super::folder::{series_in, series_uid};
use super::problem::DicomProblem;
use super::slice::Slice;
use super::stack::stack;
use crate::volume::{Volume, VolumeFileError};
use dicom_dictionary_std::tags;
use rayon::prelude::*;
use std::path::Path;

/// Reads the CT of a folder that holds the files of one series, or of the series that one file
/// belongs to, in Hounsfield units. The world is the patient's, LPS in mm. i runs along the rows, j
/// along the columns, and k along rows x columns whatever the order of names, numbers or scanning.
///
/// Files that are no DICOM, objects without an image and localizers are ignored, with a line in the
/// log; subfolders are not looked into. Padding (PixelPaddingValue) that lies below -1024 HU becomes
/// -1024, all other values are rounded to whole Hounsfield units and otherwise stay as they are.
///
/// # Errors
/// When there is no series or more than one, a file is broken or not read (compressed otherwise than
/// by RLE or JPEG Lossless, several frames), it is no CT in Hounsfield units, or the slices are not
/// equidistant, not of one size and orientation, sheared (gantry tilt), or at the same place.
pub fn read_dicom_series(path: &Path) -> Result<Volume<i16>, VolumeFileError> {
    if path.is_dir() {
        return read(path, None);
    }
    match DataSet::open(path)? {
        Opened::Image(image) => {
            let folder = match path.parent() {
                Some(parent) if parent != Path::new("") => parent,
                _ => Path::new("."),
            };
            read(folder, Some(&series_uid(&image)))
        }
        Opened::NoImage => {
            let found = "it is a DICOM object without an image".into();
            Err(DicomProblem::NoSlices { found }.at(path))
        }
        Opened::NotDicom => {
            let found = "it has no 'DICM' at byte 128".into();
            Err(DicomProblem::NoSlices { found }.at(path))
        }
    }
}

/// Reads the series with this SeriesInstanceUID from a folder that holds several; see
/// [`read_dicom_series`].
///
/// # Errors
/// As [`read_dicom_series`], and when the folder has no such series.
pub fn read_dicom_series_of(folder: &Path, series: &str) -> Result<Volume<i16>, VolumeFileError> {
    read(folder, Some(series))
}

fn read(folder: &Path, series: Option<&str>) -> Result<Volume<i16>, VolumeFileError> {
    let images = series_in(folder, series)?;
    let mut slices = images
        .into_iter()
        .map(Slice::new)
        .collect::<Result<Vec<_>, _>>()?;
    let grid = stack(&mut slices, folder)?;
    tell(&slices, folder);
    let mut data = vec![0; grid.len()];
    let read: Vec<_> = data
        .par_chunks_mut(grid.dims[0] * grid.dims[1])
        .zip(&slices)
        .enumerate()
        .map(|(k, (out, slice))| slice.read_into(out, k))
        .collect();
    // The first slice's error, whichever thread was first.
    read.into_iter().collect::<Result<(), _>>()?;
    Ok(Volume::new(grid, data))
}

/// Logs what a user may want to know of a series that is read all the same.
fn tell(slices: &[Slice], folder: &Path) {
    let lossy = |s: &&Slice| s.data.text(tags::LOSSY_IMAGE_COMPRESSION).as_deref() == Some("01");
    let lossy = slices.iter().filter(lossy).count();
    if lossy > 0 {
        tracing::warn!(
            "{}: {lossy} slices were compressed with a loss once; their Hounsfield units are not the \
             scanner's",
            folder.display()
        );
    }
}

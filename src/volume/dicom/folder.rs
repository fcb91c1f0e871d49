//! The files of one series among those of a folder.

use super::data_set::{DataSet, Opened, io};
use super::problem::{DicomProblem, SeriesSummary};
use crate::volume::VolumeFileError;
use dicom_dictionary_std::tags;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// How many ignored files are named.
const NAMED: usize = 5;

/// What a folder holds beside images.
#[derive(Debug, Default)]
struct Ignored {
    not_dicom: Vec<PathBuf>,
    no_image: Vec<PathBuf>,
    localizers: Vec<PathBuf>,
    folders: usize,
}

/// Reads the attributes of the images of one series in a folder: of the one with this
/// SeriesInstanceUID, or of the only one.
///
/// # Errors
/// When the folder or a DICOM file in it cannot be read, or there is not one such series.
pub(super) fn series_in(
    folder: &Path,
    series: Option<&str>,
) -> Result<Vec<DataSet>, VolumeFileError> {
    let mut ignored = Ignored::default();
    let files = files_in(folder, &mut ignored)?;
    // In the order of names, whichever thread was first.
    let opened: Vec<_> = files.par_iter().map(|path| DataSet::open(path)).collect();
    let mut images = Vec::new();
    for (path, opened) in files.into_iter().zip(opened) {
        match opened? {
            Opened::Image(image) if is_localizer(&image) => ignored.localizers.push(path),
            Opened::Image(image) => images.push(*image),
            Opened::NoImage => ignored.no_image.push(path),
            Opened::NotDicom if has_dicom_name(&path) => {
                return Err(DicomProblem::NotDicom.at(&path));
            }
            Opened::NotDicom => ignored.not_dicom.push(path),
        }
    }
    let told = ignored.told();
    if images.is_empty() {
        let found = if told.is_empty() {
            "it is empty".into()
        } else {
            told
        };
        return Err(DicomProblem::NoSlices { found }.at(folder));
    }
    if !told.is_empty() {
        tracing::info!("{}: ignored {told}", folder.display());
    }
    choose(images, series).map_err(|p| p.at(folder))
}

fn files_in(folder: &Path, ignored: &mut Ignored) -> Result<Vec<PathBuf>, VolumeFileError> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|e| io(folder, e))? {
        let path = entry.map_err(|e| io(folder, e))?.path();
        let kind = std::fs::metadata(&path).map_err(|e| io(&path, e))?;
        let hidden = path
            .file_name()
            .is_some_and(|n| n.as_encoded_bytes()[0] == b'.');
        if kind.is_dir() {
            ignored.folders += 1;
        } else if hidden || !kind.is_file() {
            ignored.not_dicom.push(path);
        } else {
            files.push(path);
        }
    }
    ignored.not_dicom.sort();
    files.sort();
    Ok(files)
}

fn has_dicom_name(path: &Path) -> bool {
    path.extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("dcm"))
}

fn is_localizer(image: &DataSet) -> bool {
    image
        .text(tags::IMAGE_TYPE)
        .is_some_and(|t| t.split('\\').any(|part| part.trim() == "LOCALIZER"))
}

impl Ignored {
    /// What was ignored, counted and named; empty when nothing was.
    fn told(&self) -> String {
        let lists = [
            (&self.not_dicom, "no DICOM"),
            (&self.no_image, "DICOM without an image"),
            (&self.localizers, "localizer"),
        ];
        let mut told: Vec<String> = lists
            .iter()
            .filter(|(files, _)| !files.is_empty())
            .map(|(files, what)| {
                format!("{} {what} ({})", count(files.len(), "file"), names(files))
            })
            .collect();
        if self.folders > 0 {
            told.push(count(self.folders, "subfolder"));
        }
        told.join(", ")
    }
}

fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

fn names(files: &[PathBuf]) -> String {
    let mut names: Vec<_> = files
        .iter()
        .take(NAMED)
        .filter_map(|f| f.file_name().map(OsStr::to_string_lossy))
        .collect();
    if files.len() > NAMED {
        names.push("...".into());
    }
    names.join(", ")
}

/// The images of the wanted series, or of the only one.
fn choose(images: Vec<DataSet>, wanted: Option<&str>) -> Result<Vec<DataSet>, DicomProblem> {
    let mut series: BTreeMap<String, Vec<DataSet>> = BTreeMap::new();
    for image in images {
        let uid = series_uid(&image);
        series.entry(uid).or_default().push(image);
    }
    if let Some(uid) = wanted {
        return series
            .remove(uid)
            .ok_or_else(|| DicomProblem::NoSuchSeries {
                wanted: uid.into(),
                series: summaries(&series),
            });
    }
    if series.len() > 1 {
        return Err(DicomProblem::SeveralSeries(summaries(&series)));
    }
    Ok(series.into_values().next().unwrap_or_default())
}

/// SeriesInstanceUID, or a word for a file without.
pub(super) fn series_uid(image: &DataSet) -> String {
    image
        .text(tags::SERIES_INSTANCE_UID)
        .unwrap_or_else(|| "none".into())
}

fn summaries(series: &BTreeMap<String, Vec<DataSet>>) -> Vec<SeriesSummary> {
    series
        .iter()
        .map(|(uid, images)| SeriesSummary {
            uid: uid.clone(),
            description: images[0].text(tags::SERIES_DESCRIPTION).unwrap_or_default(),
            modality: images[0].text(tags::MODALITY).unwrap_or_default(),
            slices: images.len(),
            orientation: orientation(&images[0]),
        })
        .collect()
}

/// The plane of an image's slices.
fn orientation(image: &DataSet) -> &'static str {
    let Ok(Some([a, b, c, d, e, f])) = image.numbers::<6>(tags::IMAGE_ORIENTATION_PATIENT) else {
        return "without orientation";
    };
    let normal = [b * f - c * e, c * d - a * f, a * e - b * d].map(f64::abs);
    // Within 8 degrees of the axis.
    match normal.map(|n| n > 0.99) {
        [true, _, _] => "sagittal",
        [_, true, _] => "coronal",
        [_, _, true] => "axial",
        _ => "oblique",
    }
}

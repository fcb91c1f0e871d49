//! What can be wrong with a DICOM series.

use crate::volume::VolumeFileError;
use std::path::{Path, PathBuf};

/// One series of several, for a choice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SeriesSummary {
    /// SeriesInstanceUID.
    pub uid: String,
    /// SeriesDescription, empty where there is none.
    pub description: String,
    pub modality: String,
    /// Files with an image.
    pub slices: usize,
    /// `axial`, `coronal`, `sagittal`, `oblique` or `without orientation`.
    pub orientation: &'static str,
}

/// Why a DICOM file or series was refused. The file or folder is named by the error around it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DicomProblem {
    #[error(
        "holds no slice of a CT: {found}; name the folder that holds the files of one series, \
         subfolders are not looked into"
    )]
    NoSlices {
        /// What there is instead, counted.
        found: String,
    },
    #[error("holds {} series; choose one by its UID:{}", .0.len(), list(.0))]
    SeveralSeries(Vec<SeriesSummary>),
    #[error("holds no series {wanted}; there is:{}", list(.series))]
    NoSuchSeries {
        wanted: String,
        series: Vec<SeriesSummary>,
    },
    #[error("is named as a DICOM file but has no 'DICM' at byte 128; copy it again or remove it")]
    NotDicom,
    #[error("is broken: {0}; copy or export it again")]
    Structure(String),
    #[error("has the transfer syntax {name} ({uid}), which is not read; {advice}")]
    TransferSyntax {
        uid: String,
        name: String,
        advice: &'static str,
    },
    #[error(
        "names the transfer syntax {claimed}, but {found}; correct TransferSyntaxUID (0002,0010), \
         or export the file again"
    )]
    WrongTransferSyntax {
        claimed: &'static str,
        found: &'static str,
    },
    #[error("has no {attribute}; {advice}")]
    Missing {
        /// Keyword and tag.
        attribute: String,
        advice: &'static str,
    },
    #[error("has {attribute} = {found}; expected {expected}")]
    Attribute {
        attribute: String,
        found: String,
        /// What was expected, and what to do.
        expected: String,
    },
    #[error(
        "has {attribute} = {found}, but {other} has {expected}; one volume needs it equal in all \
         slices: export one reconstruction"
    )]
    Differs {
        attribute: String,
        found: String,
        other: PathBuf,
        expected: String,
    },
    #[error("has pixel data that do not decode: {0}; copy or export it again")]
    Pixels(String),
    #[error("is the only slice; a volume needs two or more at different positions")]
    OneSlice,
    #[error(
        "lies at the same place as {other}, {at_mm:.3} mm along the normal; the series holds two \
         reconstructions, two points of time or a copy: keep one"
    )]
    SamePlace { other: PathBuf, at_mm: f64 },
    #[error(
        "lies {gap_mm:.3} mm after {before}, where slices are {spacing_mm:.3} mm apart: {missing} \
         missing between the two; copy the series again"
    )]
    Gap {
        before: PathBuf,
        gap_mm: f64,
        spacing_mm: f64,
        /// `1 slice is`, `3 slices are`.
        missing: String,
    },
    #[error(
        "lies {gap_mm:.3} mm after {before}, where slices are {spacing_mm:.3} mm apart: they are \
         not equidistant; export one reconstruction of one spacing, or resample it"
    )]
    Uneven {
        before: PathBuf,
        gap_mm: f64,
        spacing_mm: f64,
    },
    #[error(
        "is a sheared stack: its slices shift by {shift_mm:.3} mm within their plane for every \
         {spacing_mm:.3} mm, as those of a gantry tilted by {angle_deg:.2} degrees do; resample it \
         to a grid with right angles (dcm2niix does by default) and read the NIfTI"
    )]
    Tilt {
        shift_mm: f64,
        spacing_mm: f64,
        angle_deg: f64,
    },
    #[error(
        "lies {off_mm:.3} mm beside the line of the other slices along their normal; export the \
         series again, or resample it to a grid with right angles"
    )]
    Shifted { off_mm: f64 },
}

impl DicomProblem {
    /// The error of the file or folder that has this problem.
    pub(super) fn at(self, path: &Path) -> VolumeFileError {
        VolumeFileError::Dicom {
            path: path.into(),
            problem: Box::new(self),
        }
    }
}

fn list(series: &[SeriesSummary]) -> String {
    series
        .iter()
        .map(|s| {
            format!(
                "\n  {}  {} \"{}\", {} {}, {}",
                s.uid,
                s.modality,
                s.description,
                s.slices,
                if s.slices == 1 { "slice" } else { "slices" },
                s.orientation
            )
        })
        .collect()
}

//! What all importers share: where the specimen goes, and what people know about it.

use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::output::say;
use pao_sim::anatomy::detect::Given;
use pao_sim::anatomy::import::{
    CtImport, CtImportError, CtImportParameters, CtOrigin, Imported, Note, specimen_from_ct,
};
use pao_sim::anatomy::landmark_files::{
    LandmarkOverrides, PointsFileError, read_landmark_overrides, write_markups,
};
use pao_sim::anatomy::{Landmarks, Side, Specimen, SpecimenError, StructureLabels, write_specimen};
use pao_sim::volume::{Volume, read_dicom_series_of, read_volume};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Flags of every importer that starts from a CT.
#[derive(Debug, clap::Args)]
pub struct Target {
    /// The specimen's folder; it must not be there yet
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// The specimen's name: letters, digits and -. Default: the name of the specimen's folder
    #[arg(long)]
    name: Option<String>,
    /// male, female or unknown
    #[arg(long)]
    sex: Option<String>,
    /// Licence of the CT
    #[arg(long)]
    licence: Option<String>,
    /// Where CT and segmentation come from
    #[arg(long, value_name = "TEXT")]
    from: Option<String>,
    /// Landmarks and rims that people placed (.fcsv, .mrk.json, .csv); they replace those of the data and
    /// those found by rule
    #[arg(long, value_name = "FILE")]
    landmarks: Option<PathBuf>,
    /// Write landmarks and rims there for 3D Slicer, whether or not all were found: those that are missing are
    /// points without a position, to be placed and given by --landmarks. Named .mrk.json; it must not be there yet
    #[arg(long, value_name = "FILE")]
    draft_landmarks: Option<PathBuf>,
    /// Edge of the specimen's voxels
    #[arg(long, value_name = "MM", default_value_t = 1.0)]
    voxel_mm: f64,
}

/// A CT on the command line.
#[derive(Debug, clap::Args)]
pub struct Ct {
    /// The CT in Hounsfield units: NIfTI, NRRD, MetaImage, or the folder of a DICOM series
    #[arg(value_name = "CT")]
    path: PathBuf,
    /// SeriesInstanceUID of the series to take of a folder that holds several
    #[arg(long, value_name = "UID")]
    series: Option<String>,
}

impl Ct {
    /// Reads it.
    pub fn read(&self) -> Result<Volume<i16>, Failure> {
        Ok(match &self.series {
            Some(series) => read_dicom_series_of(&self.path, series)?,
            None => read_volume(&self.path)?,
        })
    }

    /// Its file's or folder's name.
    pub fn name(&self) -> String {
        folder_name(&self.path)
    }
}

/// What an importer's data itself say, where no flag does.
#[derive(Debug)]
pub struct Known {
    pub kind: &'static str,
    pub sex: String,
    pub licence: String,
    pub from: String,
}

/// What an importer read.
#[derive(Debug)]
pub struct Read {
    pub ct: Volume<i16>,
    pub structures: StructureLabels,
    /// The data's own landmarks.
    pub landmarks: Landmarks,
    pub notes: Vec<Note>,
}

impl Target {
    /// Says so when the folder is there: what takes a minute is not begun for nothing.
    pub fn check(&self) -> Result<(), Failure> {
        if let Some(draft) = &self.draft_landmarks {
            check_markups_name("--draft-landmarks", draft)?;
            if draft.exists() {
                return Err(PointsFileError::Exists(draft.clone()).into());
            }
        }
        check_free(&self.out)
    }

    /// Makes the specimen, writes it and tells about it.
    pub fn finish(&self, read: Read, known: Known, common: &Common) -> Result<Exit, Failure> {
        let (mut landmarks, mut notes) = (read.landmarks, read.notes);
        let given = given(self.landmarks.as_deref(), &mut notes)?;
        for (landmark, side, point) in given.landmarks.iter() {
            landmarks.set(landmark, side, point);
        }
        let flag = |flag: &Option<String>, known: String| flag.clone().unwrap_or(known);
        let import = CtImport {
            ct: read.ct,
            structures: read.structures,
            given: Given {
                landmarks,
                rims: given.rims,
            },
            origin: CtOrigin {
                kind: known.kind,
                name: self.name.clone().unwrap_or_else(|| folder_name(&self.out)),
                sex: flag(&self.sex, known.sex),
                licence: flag(&self.licence, known.licence),
                from: flag(&self.from, known.from),
            },
            notes,
        };
        let parameters = CtImportParameters {
            voxel_mm: self.voxel_mm,
            ..Default::default()
        };
        let made = specimen_from_ct(import, &parameters);
        self.write_draft(&made)?;
        let Imported { specimen, notes } = made?;
        write_specimen(&specimen, &self.out)?;
        tell(&specimen, &self.out, &notes, common);
        Ok(Exit::Complete)
    }

    /// What was found for 3D Slicer, also where that is not all.
    fn write_draft(&self, made: &Result<Imported, CtImportError>) -> Result<(), Failure> {
        let Some(draft) = &self.draft_landmarks else {
            return Ok(());
        };
        let (landmarks, rims) = match made {
            Ok(Imported { specimen, .. }) => (
                &specimen.landmarks,
                Side::BOTH.map(|side| specimen.rim(side)),
            ),
            Err(CtImportError::Landmarks(unfound)) => {
                let rim = |side: Side| unfound.rims[side.index()].as_deref();
                let points = |side| rim(side).map_or(&[][..], Vec::as_slice);
                (&unfound.landmarks, Side::BOTH.map(points))
            }
            Err(_) => return Ok(()),
        };
        Ok(write_markups(landmarks, rims, draft)?)
    }
}

/// Says so when a file for 3D Slicer is named otherwise: Slicer tells what a file is by its name.
pub fn check_markups_name(flag: &str, path: &Path) -> Result<(), Failure> {
    match path.to_string_lossy().ends_with(".mrk.json") {
        true => Ok(()),
        false => Err(Failure::Usage(format!(
            "{flag} is {}; expected a name that ends with .mrk.json",
            path.display()
        ))),
    }
}

/// What a landmark file gives; a note for each of its points that means nothing. Nothing without a file.
pub fn given(file: Option<&Path>, notes: &mut Vec<Note>) -> Result<LandmarkOverrides, Failure> {
    let Some(file) = file else {
        return Ok(LandmarkOverrides::default());
    };
    let given = read_landmark_overrides(file)?;
    let told = |line| Note::Reader(format!("{}: {line}", file.display()));
    notes.extend(given.ignored.iter().map(told));
    Ok(given)
}

/// An error when the folder exists.
pub fn check_free(out: &Path) -> Result<(), Failure> {
    match out.exists() {
        true => Err(SpecimenError::Exists(out.to_owned()).into()),
        false => Ok(()),
    }
}

/// The name of a file or folder, also of `.` and `..`.
pub fn folder_name(path: &Path) -> String {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let whole = whole.canonicalize().unwrap_or(whole);
    let name = whole.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Prints what was made, and every note.
pub fn tell(specimen: &Specimen, folder: &Path, notes: &[Note], common: &Common) {
    let [i, j, k] = specimen.ct.grid.dims;
    let mm = specimen.ct.grid.spacing[0];
    let notes: Vec<String> = notes.iter().map(ToString::to_string).collect();
    if common.json {
        say!(
            "{}",
            json!({"specimen": specimen.name, "folder": folder, "dims": [i, j, k], "voxel_mm": mm,
                "notes": notes})
        );
        return;
    }
    say!(
        "{}: specimen {}, {i} x {j} x {k} voxels of {mm} mm",
        folder.display(),
        specimen.name
    );
    for note in notes {
        say!("- {note}");
    }
}

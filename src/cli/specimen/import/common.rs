//! What all importers share: where the specimen goes, and what people know about it.

use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::output::say;
use pao_sim::anatomy::import::{
    CtImport, CtImportParameters, CtOrigin, Imported, Note, specimen_from_ct,
};
use pao_sim::anatomy::landmark_files::{LandmarkOverrides, read_landmark_overrides};
use pao_sim::anatomy::{Landmarks, SpecimenError, StructureLabels, write_specimen};
use pao_sim::volume::{Volume, read_dicom_series_of, read_volume};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Flags of every importer.
#[derive(Debug, clap::Args)]
pub struct Given {
    /// The specimen's folder; it must not be there yet
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// The specimen's name: letters, digits and -. Default: the name of the specimen's folder, or of that
    /// of the surfaces, where it also keys the texture of the bone
    #[arg(long)]
    pub name: Option<String>,
    /// male, female or unknown. Default: as the data say
    #[arg(long)]
    pub sex: Option<String>,
    /// Licence of the data. Default: as they say
    #[arg(long)]
    pub licence: Option<String>,
    /// Where the data come from. Default: as they say
    #[arg(long, value_name = "TEXT")]
    pub from: Option<String>,
    /// Landmarks and rims that people placed (.fcsv, .mrk.json, .csv); they replace those of the data and
    /// those found by rule
    #[arg(long, value_name = "FILE")]
    landmarks: Option<PathBuf>,
}

/// Flags of every importer that starts from a CT.
#[derive(Debug, clap::Args)]
pub struct Target {
    #[command(flatten)]
    given: Given,
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

impl Given {
    /// Says so when the folder is there: what takes a minute is not begun for nothing.
    pub fn check(&self) -> Result<(), Failure> {
        match self.out.exists() {
            true => Err(SpecimenError::Exists(self.out.clone()).into()),
            false => Ok(()),
        }
    }

    /// What the landmark file gives; a note for each of its points that means nothing. Nothing without a file.
    pub fn landmarks(&self, notes: &mut Vec<Note>) -> Result<LandmarkOverrides, Failure> {
        let Some(file) = &self.landmarks else {
            return Ok(LandmarkOverrides::default());
        };
        let given = read_landmark_overrides(file)?;
        let told = |line| Note::Reader(format!("{}: {line}", file.display()));
        notes.extend(given.ignored.iter().map(told));
        Ok(given)
    }

    /// Writes the specimen and tells about it.
    pub fn write(&self, made: &Imported, common: &Common) -> Result<Exit, Failure> {
        write_specimen(&made.specimen, &self.out)?;
        tell(made, &self.out, common);
        Ok(Exit::Complete)
    }
}

impl Target {
    /// As [`Given::check`].
    pub fn check(&self) -> Result<(), Failure> {
        self.given.check()
    }

    /// Makes the specimen, writes it and tells about it.
    pub fn finish(&self, read: Read, known: Known, common: &Common) -> Result<Exit, Failure> {
        let given = &self.given;
        let (mut landmarks, mut notes) = (read.landmarks, read.notes);
        let overrides = given.landmarks(&mut notes)?;
        landmarks.set_all(&overrides.landmarks);
        let flag = |flag: &Option<String>, known: String| flag.clone().unwrap_or(known);
        let import = CtImport {
            ct: read.ct,
            structures: read.structures,
            landmarks,
            rims: overrides.rims,
            origin: CtOrigin {
                kind: known.kind,
                name: flag(&given.name, folder_name(&given.out)),
                sex: flag(&given.sex, known.sex),
                licence: flag(&given.licence, known.licence),
                from: flag(&given.from, known.from),
            },
            notes,
        };
        let parameters = CtImportParameters {
            voxel_mm: self.voxel_mm,
            ..Default::default()
        };
        given.write(&specimen_from_ct(import, &parameters)?, common)
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
fn tell(made: &Imported, folder: &Path, common: &Common) {
    let Imported { specimen, notes } = made;
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

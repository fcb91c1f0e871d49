//! What all importers share: where the specimen goes, and what people know about it.

use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::output::say;
use pao_sim::anatomy::detect::{Given, Unfound};
use pao_sim::anatomy::import::{
    CtImport, CtImportError, CtImportParameters, CtOrigin, Imported, Note, specimen_from_ct,
};
use pao_sim::anatomy::landmark_files::{
    LandmarkOverrides, PointsFileError, read_landmark_overrides, write_markups,
};
use pao_sim::anatomy::{Landmarks, Side, SpecimenError, StructureLabels, write_specimen};
use pao_sim::volume::{Volume, read_dicom_series_of, read_volume};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Flags of every importer.
#[derive(Debug, clap::Args)]
pub struct Shared {
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
    /// those found by rule. May be given several times: 3D Slicer saves points and curves to a file each
    #[arg(long, value_name = "FILE")]
    landmarks: Vec<PathBuf>,
    /// Write landmarks and rims there for 3D Slicer, whether or not all were found: those that are missing are
    /// points without a position, to be placed and given by --landmarks. Named .mrk.json; it must not be there yet
    #[arg(long, value_name = "FILE")]
    draft_landmarks: Option<PathBuf>,
}

/// Flags of every importer that starts from a CT.
#[derive(Debug, clap::Args)]
pub struct Target {
    #[command(flatten)]
    shared: Shared,
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

impl Shared {
    /// Says so when the folder is there: what takes a minute is not begun for nothing.
    pub fn check(&self) -> Result<(), Failure> {
        if let Some(draft) = &self.draft_landmarks {
            check_markups_name("--draft-landmarks", draft)?;
            if draft.exists() {
                return Err(PointsFileError::Exists(draft.clone()).into());
            }
        }
        match self.out.exists() {
            true => Err(SpecimenError::Exists(self.out.clone()).into()),
            false => Ok(()),
        }
    }

    /// What the landmark files give; a note for each of their points that means nothing. Nothing without a file.
    pub fn landmarks(&self, notes: &mut Vec<Note>) -> Result<LandmarkOverrides, Failure> {
        let mut all = LandmarkOverrides::default();
        for file in &self.landmarks {
            let given = read_landmark_overrides(file)?;
            let told = |line| Note::Reader(format!("{}: {line}", file.display()));
            notes.extend(given.ignored.iter().map(told));
            all.join(given).map_err(|twice| {
                Failure::Usage(format!(
                    "--landmarks {} gives {twice}, which a file before it gives too; expected each landmark \
                     and rim in one file",
                    file.display()
                ))
            })?;
        }
        Ok(all)
    }

    /// Writes the specimen and tells about it; what was found for 3D Slicer first, also where that is not all.
    pub fn finish<E: Into<Failure>>(
        &self,
        made: Result<Imported, E>,
        unfound: impl Fn(&E) -> Option<&Unfound>,
        common: &Common,
    ) -> Result<Exit, Failure> {
        if let Some(draft) = &self.draft_landmarks {
            let found = match &made {
                Ok(Imported { specimen, .. }) => Some((
                    &specimen.landmarks,
                    Side::BOTH.map(|side| specimen.rim(side)),
                )),
                Err(error) => unfound(error).map(|found| {
                    let rim = |side: Side| found.rims[side.index()].as_deref();
                    let points = |side| rim(side).map_or(&[][..], Vec::as_slice);
                    (&found.landmarks, Side::BOTH.map(points))
                }),
            };
            if let Some((landmarks, rims)) = found {
                write_markups(landmarks, rims, draft)?;
            }
        }
        let made = made.map_err(E::into)?;
        write_specimen(&made.specimen, &self.out)?;
        tell(&made, &self.out, common);
        Ok(Exit::Complete)
    }
}

impl Target {
    /// As [`Shared::check`].
    pub fn check(&self) -> Result<(), Failure> {
        self.shared.check()
    }

    /// Makes the specimen, writes it and tells about it.
    pub fn finish(&self, read: Read, known: Known, common: &Common) -> Result<Exit, Failure> {
        let shared = &self.shared;
        let (mut landmarks, mut notes) = (read.landmarks, read.notes);
        let overrides = shared.landmarks(&mut notes)?;
        landmarks.set_all(&overrides.landmarks);
        let flag = |flag: &Option<String>, known: String| flag.clone().unwrap_or(known);
        let import = CtImport {
            ct: read.ct,
            structures: read.structures,
            given: Given {
                landmarks,
                rims: overrides.rims,
            },
            origin: CtOrigin {
                kind: known.kind,
                name: flag(&shared.name, folder_name(&shared.out)),
                sex: flag(&shared.sex, known.sex),
                licence: flag(&shared.licence, known.licence),
                from: flag(&shared.from, known.from),
            },
            notes,
        };
        let parameters = CtImportParameters {
            voxel_mm: self.voxel_mm,
            ..Default::default()
        };
        shared.finish(specimen_from_ct(import, &parameters), unfound, common)
    }
}

fn unfound(error: &CtImportError) -> Option<&Unfound> {
    match error {
        CtImportError::Landmarks(unfound) => Some(unfound),
        _ => None,
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

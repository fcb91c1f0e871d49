//! What all importers share: where the specimen goes, and what people know about it.

use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::output::say;
use crate::cli::specimen::check::{as_json, exit, findings};
use crate::cli::specimen::check_ending;
use pao_sim::anatomy::check::Check;
use pao_sim::anatomy::detect::{Given, Unfound};
use pao_sim::anatomy::import::{
    CtImport, CtImportError, CtImportParameters, CtOrigin, Imported, Note, specimen_from_ct,
};
use pao_sim::anatomy::landmark_files::{
    LandmarkOverrides, PointsFileError, read_landmark_overrides, write_markups,
};
use pao_sim::anatomy::{
    Landmarks, SEXES, Side, Specimen, SpecimenError, StructureLabels, is_specimen_name,
    write_specimen,
};
use pao_sim::volume::{Volume, read_dicom_series_of, read_volume};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;

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
    /// What can be refused before the work: a draft or folder that is there, a name that no study takes, an unknown
    /// sex.
    pub fn check(&self) -> Result<(), Failure> {
        if let Some(draft) = &self.draft_landmarks {
            check_ending("--draft-landmarks", draft, ".mrk.json")?;
            if draft.exists() {
                return Err(PointsFileError::Exists(draft.clone()).into());
            }
        }
        let name = folder_name(&self.out);
        for (flag, name) in [("--out", Some(&name)), ("--name", self.name.as_ref())] {
            if let Some(name) = name
                && !is_specimen_name(name)
            {
                return Err(Failure::Usage(format!(
                    "{flag} names the specimen '{name}'; expected letters, digits and '-' only: it goes into the \
                     keys of registrations"
                )));
            }
        }
        if let Some(sex) = &self.sex
            && !SEXES.contains(&sex.as_str())
        {
            return Err(Failure::Usage(format!(
                "--sex is {sex}; expected {}",
                SEXES.join(", ")
            )));
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

    /// Writes the specimen, checks it and tells about it; what was found for 3D Slicer first, also where that
    /// is not all. Ends with [`Exit::Error`] where a check says that the specimen is wrong.
    pub fn finish<E: Into<Failure>>(
        &self,
        made: Result<Imported, E>,
        unfound: impl Fn(&E) -> Option<&Unfound>,
        common: &Common,
    ) -> Result<Exit, Failure> {
        let draft = self.write_draft(&made, unfound)?;
        if made.is_err() && !common.json {
            draft.iter().for_each(|line| eprintln!("{line}"));
        }
        let Imported { specimen, notes } = made.map_err(E::into)?;
        write_specimen(&specimen, &self.out)?;
        let mut notes: Vec<String> = notes.iter().map(ToString::to_string).collect();
        notes.extend(draft);
        let folder = folder_name(&self.out);
        if specimen.name != folder {
            notes.push(format!(
                "its name is {}, but a study calls it {folder}, by its folder",
                specimen.name
            ));
        }
        let specimen = Arc::new(specimen);
        let (findings, checks) = findings(&specimen);
        tell(&specimen, &self.out, &notes, (&findings, checks), common);
        Ok(exit(&findings))
    }

    /// A line that says what was written.
    fn write_draft<E>(
        &self,
        made: &Result<Imported, E>,
        unfound: impl Fn(&E) -> Option<&Unfound>,
    ) -> Result<Option<String>, Failure> {
        let Some(draft) = &self.draft_landmarks else {
            return Ok(None);
        };
        let (landmarks, rims, missing) = match made {
            Ok(Imported { specimen, .. }) => {
                let rims = Side::BOTH.map(|side| specimen.rim(side));
                (&specimen.landmarks, rims, vec![])
            }
            Err(error) => {
                let Some(found) = unfound(error) else {
                    return Ok(None);
                };
                let rim = |side: Side| found.rims[side.index()].as_deref();
                let points = |side| rim(side).map_or(&[][..], Vec::as_slice);
                let missing = found.missing.iter().map(|missing| missing.name());
                (&found.landmarks, Side::BOTH.map(points), missing.collect())
            }
        };
        write_markups(landmarks, rims, draft)?;
        let missing = match missing.as_slice() {
            [] => String::new(),
            names => format!("; to be placed: {}", names.join(", ")),
        };
        let draft = draft.display();
        Ok(Some(format!("{draft} holds landmarks and rims{missing}")))
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

/// The name of a file or folder, also of `.` and `..`.
pub fn folder_name(path: &Path) -> String {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let whole = whole.canonicalize().unwrap_or(whole);
    let name = whole.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Prints what was made, every note, and what the specimen's checks found.
fn tell(
    specimen: &Specimen,
    folder: &Path,
    notes: &[String],
    (findings, checks): (&[Check], usize),
    common: &Common,
) {
    let [i, j, k] = specimen.ct.grid.dims;
    let mm = specimen.ct.grid.spacing[0];
    if common.json {
        let findings: Vec<Value> = findings.iter().map(as_json).collect();
        say!(
            "{}",
            json!({"specimen": specimen.name, "folder": folder, "dims": [i, j, k], "voxel_mm": mm,
                "notes": notes, "checks": checks, "findings": findings})
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
    match findings.len() {
        0 => say!("{checks} checks, all ok"),
        found => {
            say!("{checks} checks, of which {found} are not ok (specimen check tells all of them):")
        }
    }
    for check in findings {
        let verdict = check.verdict.name();
        say!(
            "- {verdict}: {}: {}; expected {}. {}",
            check.what,
            check.found,
            check.expected,
            check.advice
        );
    }
}

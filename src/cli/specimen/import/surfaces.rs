//! From closed surfaces of the bones.

use super::common::{check_free, folder_name, given, tell};
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::specimen::source::Bodies;
use pao_sim::anatomy::import::Note;
use pao_sim::anatomy::surfaces::{SurfacesOrigin, read_bone_surfaces, specimen_from_surfaces};
use pao_sim::anatomy::{Side, Specimen, write_specimen};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder of the surfaces; its surfaces.toml, if it has one, says sex, licence, origin and frame
    dir: PathBuf,
    /// The specimen's folder; it must not be there yet
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
    /// The specimen's name: letters, digits and -. It also keys the texture of its bone. Default:
    /// the name of the surfaces' folder
    #[arg(long)]
    name: Option<String>,
    /// male, female or unknown; default as surfaces.toml says, or unknown
    #[arg(long)]
    sex: Option<String>,
    /// Licence of the surfaces; default as surfaces.toml says
    #[arg(long)]
    licence: Option<String>,
    /// Where the surfaces come from; default as surfaces.toml says
    #[arg(long, value_name = "TEXT")]
    from: Option<String>,
    /// Landmarks and rims that people placed (.fcsv, .mrk.json, .csv); they replace those found by rule
    #[arg(long, value_name = "FILE")]
    landmarks: Option<PathBuf>,
    #[command(flatten)]
    bodies: Bodies,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    // What takes a minute is not begun for a folder that cannot be written.
    check_free(&arguments.out)?;
    let mut notes = Vec::new();
    let given = given(arguments.landmarks.as_deref(), &mut notes)?;
    let mut specimen = specimen(arguments)?;
    let mut names = Vec::new();
    for (landmark, side, point) in given.landmarks.iter() {
        specimen.landmarks.set(landmark, side, point);
        names.push(landmark.key(side));
    }
    for (side, rim) in Side::BOTH.into_iter().zip(given.rims) {
        if let Some(rim) = rim {
            specimen.rims[side.index()] = rim.into();
            names.push(format!("{side} rim"));
        }
    }
    if !names.is_empty() {
        notes.push(Note::Overridden(names.join(", ")));
    }
    write_specimen(&specimen, &arguments.out)?;
    tell(&specimen, &arguments.out, &notes, common);
    Ok(Exit::Complete)
}

fn specimen(arguments: &Arguments) -> Result<Specimen, Failure> {
    let population = arguments.bodies.population()?;
    let bones = read_bone_surfaces(&arguments.dir)?;
    let name = match &arguments.name {
        Some(name) => name.clone(),
        None => folder_name(&arguments.dir),
    };
    let mut origin = SurfacesOrigin::of_folder(&arguments.dir, &name)?;
    for (value, given) in [
        (&mut origin.sex, &arguments.sex),
        (&mut origin.licence, &arguments.licence),
        (&mut origin.from, &arguments.from),
    ] {
        if let Some(given) = given {
            value.clone_from(given);
        }
    }
    Ok(specimen_from_surfaces(
        &bones,
        &origin,
        &population.surface_bodies,
    )?)
}

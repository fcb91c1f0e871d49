//! From closed surfaces of the bones.

use super::common::{Given, folder_name};
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::specimen::source::Bodies;
use pao_sim::anatomy::Specimen;
use pao_sim::anatomy::import::{Imported, Note};
use pao_sim::anatomy::surfaces::{SurfacesOrigin, read_bone_surfaces, specimen_from_surfaces};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder of the surfaces; its surfaces.toml, if it has one, says sex, licence, origin and frame
    dir: PathBuf,
    #[command(flatten)]
    given: Given,
    #[command(flatten)]
    bodies: Bodies,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    arguments.given.check()?;
    let mut notes = Vec::new();
    let overrides = arguments.given.landmarks(&mut notes)?;
    let mut specimen = specimen(arguments)?;
    let names = overrides.names();
    if !names.is_empty() {
        notes.push(Note::Overridden(names.join(", ")));
    }
    specimen.landmarks.set_all(&overrides.landmarks);
    for (rim, given) in specimen.rims.iter_mut().zip(overrides.rims) {
        if let Some(points) = given {
            *rim = points.into();
        }
    }
    let made = Imported { specimen, notes };
    arguments.given.write(&made, common)
}

fn specimen(arguments: &Arguments) -> Result<Specimen, Failure> {
    let population = arguments.bodies.population()?;
    let bones = read_bone_surfaces(&arguments.dir)?;
    let given = &arguments.given;
    let name = match &given.name {
        Some(name) => name.clone(),
        None => folder_name(&arguments.dir),
    };
    let mut origin = SurfacesOrigin::of_folder(&arguments.dir, &name)?;
    for (value, flag) in [
        (&mut origin.sex, &given.sex),
        (&mut origin.licence, &given.licence),
        (&mut origin.from, &given.from),
    ] {
        if let Some(flag) = flag {
            value.clone_from(flag);
        }
    }
    Ok(specimen_from_surfaces(
        &bones,
        &origin,
        &population.surface_bodies,
    )?)
}

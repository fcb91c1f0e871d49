//! From closed surfaces of the bones.

use super::common::{Shared, folder_name};
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::specimen::source::Bodies;
use pao_sim::anatomy::detect::{Given, Unfound};
use pao_sim::anatomy::landmark_files::LandmarkOverrides;
use pao_sim::anatomy::surfaces::{
    ImportError, SurfacesOrigin, read_bone_surfaces, specimen_from_surfaces_with,
};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Folder of the surfaces; its surfaces.toml, if it has one, says sex, licence, origin and frame
    dir: PathBuf,
    #[command(flatten)]
    shared: Shared,
    #[command(flatten)]
    bodies: Bodies,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let shared = &arguments.shared;
    shared.check()?;
    let mut notes = Vec::new();
    let LandmarkOverrides {
        landmarks, rims, ..
    } = shared.landmarks(&mut notes)?;
    let population = arguments.bodies.population()?;
    let bones = read_bone_surfaces(&arguments.dir)?;
    let made = specimen_from_surfaces_with(
        &bones,
        &origin(arguments)?,
        &population.surface_bodies,
        &Given { landmarks, rims },
    );
    let made = made.map(|mut made| {
        made.notes.splice(0..0, notes);
        made
    });
    shared.finish(made, unfound, common)
}

fn unfound(error: &ImportError) -> Option<&Unfound> {
    match error {
        ImportError::Landmarks(unfound) => Some(unfound),
        _ => None,
    }
}

/// What is known of the surfaces: by the flags, by their `surfaces.toml`.
fn origin(arguments: &Arguments) -> Result<SurfacesOrigin, Failure> {
    let shared = &arguments.shared;
    let name = match &shared.name {
        Some(name) => name.clone(),
        None => folder_name(&arguments.dir),
    };
    let mut origin = SurfacesOrigin::of_folder(&arguments.dir, &name)?;
    for (value, flag) in [
        (&mut origin.sex, &shared.sex),
        (&mut origin.licence, &shared.licence),
        (&mut origin.from, &shared.from),
    ] {
        if let Some(flag) = flag {
            value.clone_from(flag);
        }
    }
    Ok(origin)
}

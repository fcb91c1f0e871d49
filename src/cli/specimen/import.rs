//! `pao-sim specimen import`: a specimen's folder from other data.

use super::source::Bodies;
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::output::say;
use clap::Subcommand;
use pao_sim::anatomy::surfaces::{SurfacesOrigin, read_bone_surfaces, specimen_from_surfaces};
use pao_sim::anatomy::{Specimen, SpecimenError, write_specimen};
use serde_json::json;
use std::path::{Path, PathBuf};

#[derive(Debug, Subcommand)]
pub enum From {
    /// From closed surfaces of the bones (.ply, .stl, .vtk or .obj; mm): Sacrum, Hip_L, Hip_R, Femur_L
    /// and Femur_R. Landmarks and rims are found by rule, densities assigned.
    Surfaces(Surfaces),
}

#[derive(Debug, clap::Args)]
pub struct Surfaces {
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
    #[command(flatten)]
    bodies: Bodies,
}

pub fn main(from: &From, common: &Common) -> Result<Exit, Failure> {
    let From::Surfaces(arguments) = from;
    let specimen = of_surfaces(arguments)?;
    write_specimen(&specimen, &arguments.out)?;
    tell(&specimen, &arguments.out, common);
    Ok(Exit::Complete)
}

fn of_surfaces(arguments: &Surfaces) -> Result<Specimen, Failure> {
    // What takes a minute is not begun for a folder that cannot be written.
    if arguments.out.exists() {
        return Err(SpecimenError::Exists(arguments.out.clone()).into());
    }
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

/// The name of a folder, also of `.` and `..`.
fn folder_name(dir: &Path) -> String {
    let whole = dir.canonicalize().unwrap_or_else(|_| dir.to_owned());
    let name = whole.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn tell(specimen: &Specimen, folder: &Path, common: &Common) {
    let [i, j, k] = specimen.ct.grid.dims;
    let mm = specimen.ct.grid.spacing[0];
    if common.json {
        say!(
            "{}",
            json!({"specimen": specimen.name, "folder": folder, "dims": [i, j, k], "voxel_mm": mm})
        );
    } else {
        say!(
            "{}: specimen {}, {i} x {j} x {k} voxels of {mm} mm",
            folder.display(),
            specimen.name
        );
    }
}

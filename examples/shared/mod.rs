//! What the examples about surgery share: specimens by name.

use pao_sim::anatomy::disk::read_specimen;
use pao_sim::anatomy::phantom::{PhantomParameters, phantom};
use pao_sim::anatomy::surfaces::{
    SurfacesOrigin, SurfacesParameters, read_bone_surfaces, specimen_from_surfaces,
};
use pao_sim::anatomy::{Specimen, write_specimen};
use std::error::Error;
use std::path::Path;

/// A phantom by its number, a specimen's folder, or a folder of bone surfaces.
///
/// Surfaces become voxels once: with `cache` the specimen is written there and read from there the
/// next time.
pub fn specimen(name: &str, cache: Option<&Path>) -> Result<Specimen, Box<dyn Error>> {
    if let Ok(number) = name.parse() {
        return Ok(phantom(number, &PhantomParameters::default()));
    }
    let folder = Path::new(name);
    if folder.join("specimen.toml").is_file() {
        return Ok(read_specimen(folder)?);
    }
    let own_name = folder.file_name().ok_or("a folder has a name")?;
    let own_name = own_name.to_string_lossy().into_owned();
    let kept = cache.map(|folder| folder.join(&own_name));
    if let Some(kept) = kept.as_ref().filter(|kept| kept.is_dir()) {
        return Ok(read_specimen(kept)?);
    }
    let origin = SurfacesOrigin::of_folder(folder, &own_name)?;
    let bones = read_bone_surfaces(folder)?;
    let made = specimen_from_surfaces(&bones, &origin, &SurfacesParameters::default())?;
    if let Some(kept) = kept {
        write_specimen(&made, &kept)?;
    }
    Ok(made)
}

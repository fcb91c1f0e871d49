//! Which data a study's rows come from.
//!
//! A row's key names a specimen, not its data. So that rows of other data are not put beside it under
//! one name, every attempt records a fingerprint of each specimen's files.

use super::config::{PopulationSection, SpecimenSource};
use super::folder::{StudyError, io};
use crate::anatomy::disk::SPECIMEN_FILES;
use crate::anatomy::surfaces::{ORIGIN_FILE, bone_files};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

/// BLAKE3 of every specimen's files, by the specimen's name. Phantoms have none: they follow from
/// configuration and program, which are compared anyway.
///
/// # Errors
/// When a file is missing or cannot be read.
pub fn fingerprints(
    population: &PopulationSection,
) -> Result<BTreeMap<String, String>, StudyError> {
    let mut found = BTreeMap::new();
    for source in population.sources() {
        let fingerprint = match &source {
            SpecimenSource::Phantom(_) => continue,
            SpecimenSource::Folder(dir) => of_files(dir, &SPECIMEN_FILES, &[])?,
            SpecimenSource::Surfaces(dir) => {
                let files = bone_files(dir)?;
                let names = files.each_ref().map(|file| {
                    let name = file.file_name().and_then(|name| name.to_str());
                    name.expect("files of bones have names of plain letters")
                });
                of_files(dir, &names, &[ORIGIN_FILE])?
            }
        };
        found.insert(source.name(), fingerprint);
    }
    Ok(found)
}

/// Of files that must be there, and of those others that are.
fn of_files(dir: &Path, needed: &[&str], optional: &[&str]) -> Result<String, StudyError> {
    let mut hasher = blake3::Hasher::new();
    let there = optional.iter().filter(|name| dir.join(name).exists());
    for name in needed.iter().chain(there) {
        let path = dir.join(name);
        let mut of_file = blake3::Hasher::new();
        File::open(&path)
            .and_then(|file| of_file.update_reader(file).map(|_| ()))
            .map_err(io("read", &path))?;
        hasher.update(name.as_bytes());
        hasher.update(of_file.finalize().as_bytes());
    }
    Ok(hasher.finalize().to_hex().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::surfaces::BONES;

    #[test]
    fn every_file_counts_and_none_may_miss() {
        let folder = tempfile::tempdir().unwrap();
        let dir = folder.path().join("z1");
        std::fs::create_dir(&dir).unwrap();
        for (n, name) in BONES.iter().enumerate() {
            std::fs::write(dir.join(format!("{name}.ply")), [n as u8]).unwrap();
        }
        let population = PopulationSection {
            surfaces: vec![dir.clone()],
            ..Default::default()
        };
        let of = || fingerprints(&population).map(|all| all["z1"].clone());
        let first = of().unwrap();
        assert_eq!(of().unwrap(), first);
        std::fs::write(dir.join(ORIGIN_FILE), "sex = \"male\"").unwrap();
        let second = of().unwrap();
        assert_ne!(first, second);
        std::fs::write(dir.join("Femur_L.ply"), "other").unwrap();
        let third = of().unwrap();
        assert_ne!(third, second);
        std::fs::rename(dir.join("Femur_L.ply"), dir.join("Femur_L.stl")).unwrap();
        assert_ne!(of().unwrap(), third);
        std::fs::remove_file(dir.join("Femur_L.stl")).unwrap();
        assert!(of().unwrap_err().to_string().contains("Femur_L"));
    }
}

//! Whose anatomy a study is made of: kept with every attempt, so that a report tells it without the data.

use super::config::{PopulationSection, SpecimenSource};
use crate::anatomy::Source;
use crate::anatomy::disk::read_source;
use crate::anatomy::phantom::phantom_source;
use crate::anatomy::surfaces::{SurfacesOrigin, surfaces_source};
use std::collections::BTreeMap;

/// The source of each specimen, by its name. One whose source cannot be read is left out: its cases
/// tell why.
pub fn specimen_list(population: &PopulationSection) -> BTreeMap<String, Source> {
    let mut list = BTreeMap::new();
    for source in population.sources() {
        let name = source.name();
        let found = match &source {
            SpecimenSource::Phantom(number) => Ok(phantom_source(*number, &population.phantom)),
            SpecimenSource::Folder(dir) => read_source(dir).map_err(|cause| cause.to_string()),
            SpecimenSource::Surfaces(dir) => SurfacesOrigin::of_folder(dir, &name)
                .map(|origin| surfaces_source(&origin, &population.surface_bodies, &[]))
                .map_err(|cause| cause.to_string()),
        };
        match found {
            Ok(source) => {
                list.insert(name, source);
            }
            Err(cause) => tracing::warn!("the source of the specimen {name} is not known: {cause}"),
        }
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::phantom::{PhantomParameters, phantom};

    #[test]
    fn a_phantom_is_listed_as_it_is_made() {
        let population = PopulationSection {
            phantoms: vec![3],
            phantom: PhantomParameters {
                voxel_mm: 6.0,
                ..Default::default()
            },
            ..Default::default()
        };
        let list = specimen_list(&population);
        assert_eq!(list["phantom-3"], phantom(3, &population.phantom).source);
        assert_eq!(list["phantom-3"].sex, "female");
    }
}

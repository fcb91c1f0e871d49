//! One specimen of the file.

use super::image::read_image;
use super::landmarks::read_landmarks;
use super::structures::read_structures;
use crate::anatomy::import::{CtImportError, Note};
use crate::anatomy::{Landmarks, StructureLabels};
use crate::volume::Volume;
use hdf5_pure::{File, Group};
use std::path::Path;

/// The group that is no specimen.
const PROJECTION_PARAMETERS: &str = "proj-params";

/// What the file holds of one specimen.
#[derive(Clone, Debug)]
pub struct DeepFluoro {
    /// The specimen's group, `17-1882` for instance.
    pub id: String,
    /// Hounsfield units.
    pub ct: Volume<i16>,
    pub structures: StructureLabels,
    /// The annotated landmarks: all but AIIS.
    pub landmarks: Landmarks,
    pub notes: Vec<Note>,
}

/// Reads one specimen. `id` may be left out where the file holds one only.
///
/// # Errors
/// When the file is no HDF5 file of this layout, or does not hold the specimen; the message lists those
/// it holds.
pub fn read_deepfluoro(path: &Path, id: Option<&str>) -> Result<DeepFluoro, CtImportError> {
    let source = Source { path };
    // The parts are read as they are asked for: the whole file has 2.5 GB.
    let file = File::open_streaming(path).map_err(|error| match error {
        hdf5_pure::Error::Io(source) => CtImportError::Io {
            path: path.into(),
            source,
        },
        other => source.problem(format!("is not a readable HDF5 file: {other}")),
    })?;
    let mut ids = source.parts(file.root().groups(), "its groups")?;
    ids.retain(|name| name != PROJECTION_PARAMETERS);
    ids.sort();
    let id = match (id, ids.as_slice()) {
        (Some(id), _) if ids.iter().any(|name| name == id) => id.to_owned(),
        (Some(id), _) => {
            return Err(
                source.problem(format!("has no specimen '{id}'; it holds {}", listed(&ids)))
            );
        }
        (None, [one]) => one.clone(),
        (None, _) => {
            return Err(source.problem(format!("holds {}; say which", listed(&ids))));
        }
    };
    let group = |name: &str| {
        let name = format!("{id}/{name}");
        let found = file.group(&name);
        source.parts(found, &name).map(|group| (name, group))
    };
    let ct = read_image::<i16>(&source, group("vol")?)?;
    let map = read_image::<u8>(&source, group("vol-seg/image")?)?;
    let names = file.group(&format!("{id}/vol-seg/labels-def")).ok();
    let (structures, mut notes) = read_structures(&source, &map, names.as_ref())?;
    let (landmarks, more) = read_landmarks(&source, group("vol-landmarks")?)?;
    notes.extend(more);
    Ok(DeepFluoro {
        id,
        ct,
        structures,
        landmarks,
        notes,
    })
}

fn listed(ids: &[String]) -> String {
    match ids {
        [] => "no specimen".to_owned(),
        ids => ids.join(", "),
    }
}

/// A group and its name in the file.
pub(super) type Named = (String, Group);

/// The file, for messages and limits.
pub(super) struct Source<'a> {
    pub path: &'a Path,
}

impl Source<'_> {
    pub fn problem(&self, reason: String) -> CtImportError {
        CtImportError::File {
            path: self.path.into(),
            reason,
        }
    }

    /// What HDF5 gave, or the error with the name of the part.
    pub fn parts<T>(
        &self,
        result: Result<T, hdf5_pure::Error>,
        name: &str,
    ) -> Result<T, CtImportError> {
        result.map_err(|error| {
            self.problem(format!(
                "cannot read {name}: {error}; expected the full-resolution layout of DeepFluoro"
            ))
        })
    }

    /// Bytes of the file.
    pub fn bytes(&self) -> u64 {
        std::fs::metadata(self.path).map_or(0, |m| m.len())
    }
}

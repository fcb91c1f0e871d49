//! CT and segmentation of a subject.

use super::folder::VsdFiles;
use crate::anatomy::import::{CtImportError, LabelMeaning, Note};
use crate::anatomy::{Structure, StructureLabels};
use crate::volume::nrrd::Segmentation;
use crate::volume::{Volume, read_volume};
use std::path::Path;

/// What is read of a subject.
#[derive(Clone, Debug)]
pub struct Vsd {
    /// Hounsfield units.
    pub ct: Volume<i16>,
    /// On the segmentation's own grid, which Slicer may have cropped.
    pub structures: StructureLabels,
    pub notes: Vec<Note>,
}

/// Reads a subject's CT and segmentation.
///
/// # Errors
/// When a file cannot be read or a bone is not in the segmentation.
pub fn read_vsd(files: &VsdFiles) -> Result<Vsd, CtImportError> {
    let (structures, notes) = read_segmentation(&files.segmentation)?;
    Ok(Vsd {
        ct: read_volume(&files.ct)?,
        structures,
        notes,
    })
}

/// Reads the five bones of a segmentation by 3D Slicer (`.seg.nrrd`) by their segments' names
/// ([`LabelMeaning::recognized`]). Where segments overlap, the first bone in the order of
/// [`Structure::ALL`] has the voxel.
///
/// # Errors
/// When the file is none, is broken, or does not name all five bones.
pub fn read_segmentation(path: &Path) -> Result<(StructureLabels, Vec<Note>), CtImportError> {
    let problem = |reason: String| CtImportError::File {
        path: path.into(),
        reason,
    };
    let segmentation = Segmentation::open(path)?;
    // (structure, layer, label) of the bones, in the order in which they have voxels.
    let mut bones: Vec<(Structure, usize, u8)> = Vec::new();
    for segment in &segmentation.segments {
        if let Some(LabelMeaning::One(structure)) = LabelMeaning::recognized(&segment.name) {
            bones.push((structure, segment.layer, segment.label));
        }
    }
    bones.sort_unstable();
    let missing: Vec<&str> = Structure::ALL
        .into_iter()
        .filter(|&s| bones.iter().all(|bone| bone.0 != s))
        .map(Structure::name)
        .collect();
    if !missing.is_empty() {
        let names = segmentation.segments.iter().map(|s| s.name.as_str());
        let names: Vec<&str> = names.collect();
        let found = match names.as_slice() {
            [] => "it names none; expected a segmentation saved by 3D Slicer (.seg.nrrd)".into(),
            names => format!("it has {}", names.join(", ")),
        };
        return Err(problem(format!(
            "has no segment of the name {}; {found}",
            missing.join(", ")
        )));
    }
    let mut map = Vec::new();
    let mut overlaps = [[0usize; 6]; 6];
    let grid = segmentation.grid.clone();
    segmentation.for_each_voxel(|labels| {
        let mut there = bones
            .iter()
            .filter(|&&(_, layer, label)| labels[layer] == label);
        let first = there.next().map(|bone| bone.0);
        if let Some(first) = first
            && let Some(second) = there.map(|bone| bone.0).find(|&s| s != first)
        {
            overlaps[usize::from(first.value())][usize::from(second.value())] += 1;
        }
        map.push(first.map_or(0, Structure::value));
    })?;
    let mut notes = Vec::new();
    for first in Structure::ALL {
        for second in Structure::ALL {
            let voxels = overlaps[usize::from(first.value())][usize::from(second.value())];
            if voxels > 0 {
                notes.push(Note::Overlap {
                    first,
                    second,
                    voxels,
                });
            }
        }
    }
    let structures = StructureLabels::new(Volume::new(grid, map));
    match structures.absent().as_slice() {
        [] => Ok((structures, notes)),
        absent => Err(problem(format!("has no voxel of the {}", absent[0]))),
    }
}

//! One mask a structure.

use super::super::masks::MaskJoin;
use crate::anatomy::import::{CtImportError, Note};
use crate::anatomy::{Structure, StructureLabels};
use crate::volume::read_volume;
use std::path::{Path, PathBuf};

/// What a mask's file may end with.
const ENDS: [&str; 4] = [".nii.gz", ".nii", ".nrrd", ".mha"];

/// Reads `sacrum`, `hip_left`, `hip_right`, `femur_left` and `femur_right` of a folder.
pub(super) fn read(dir: &Path) -> Result<(StructureLabels, Vec<Note>), CtImportError> {
    let file = |structure: Structure| -> Option<PathBuf> {
        ENDS.iter()
            .map(|end| dir.join(format!("{}{end}", structure.name())))
            .find(|path| path.is_file())
    };
    let missing: Vec<String> = Structure::ALL
        .into_iter()
        .filter(|&s| file(s).is_none())
        .map(|s| format!("{}.nii.gz", s.name()))
        .collect();
    if !missing.is_empty() {
        return Err(CtImportError::File {
            path: dir.into(),
            reason: format!(
                "lacks {}; run TotalSegmentator's task total, or with --roi_subset {}",
                missing.join(", "),
                Structure::ALL.map(Structure::name).join(" ")
            ),
        });
    }
    let mut join: Option<MaskJoin> = None;
    for structure in Structure::ALL {
        let Some(path) = file(structure) else {
            continue;
        };
        let mask = read_volume::<u8>(&path)?;
        let value = mask.data.iter().copied().find(|&v| v != 0);
        let other = mask.data.iter().find(|&&v| v != 0 && Some(v) != value);
        if let (Some(a), Some(b)) = (value, other) {
            return Err(CtImportError::File {
                path,
                reason: format!(
                    "holds the values {a} and {b}; expected a mask of 0 and one other. A file of all \
                     structures is given by its own name, not its folder's"
                ),
            });
        }
        let join = join.get_or_insert_with(|| MaskJoin::new(&mask.grid));
        join.add(structure, &mask, |v| v != 0, &path)?;
    }
    match join {
        Some(join) => Ok(join.finish()),
        None => unreachable!("there are five structures"),
    }
}

//! One mask a bone to one map of bones.

use super::error::CtImportError;
use super::grid::{same_grid, span};
use super::note::Note;
use crate::anatomy::{Structure, StructureLabels};
use crate::volume::{Grid, Volume};
use std::path::Path;

/// Masks that are being joined: where several claim a voxel, the first in the order of
/// [`Structure::ALL`] has it, whatever the order of joining, and their number is told.
#[derive(Debug)]
pub(super) struct MaskJoin {
    map: Volume<u8>,
    /// [first][second]
    overlaps: [[usize; 6]; 6],
}

impl MaskJoin {
    pub fn new(grid: &Grid) -> Self {
        Self {
            map: Volume::filled(grid.clone(), 0),
            overlaps: [[0; 6]; 6],
        }
    }

    /// Adds the voxels for which `inside` is true to a bone.
    pub fn add<T: Copy>(
        &mut self,
        structure: Structure,
        mask: &Volume<T>,
        inside: impl Fn(T) -> bool,
        path: &Path,
    ) -> Result<(), CtImportError> {
        if !same_grid(&self.map.grid, &mask.grid) {
            return Err(CtImportError::File {
                path: path.into(),
                reason: format!(
                    "lies on another grid ({:?} voxels, {}) than the masks before it ({:?}, {}); \
                     expected masks of one segmentation",
                    mask.grid.dims,
                    span(&mask.grid),
                    self.map.grid.dims,
                    span(&self.map.grid)
                ),
            });
        }
        let value = structure.value();
        for (there, &v) in self.map.data.iter_mut().zip(&mask.data) {
            if !inside(v) || *there == value {
                continue;
            }
            if *there == 0 {
                *there = value;
            } else {
                let (first, second) = ((*there).min(value), (*there).max(value));
                self.overlaps[usize::from(first)][usize::from(second)] += 1;
                *there = first;
            }
        }
        Ok(())
    }

    pub fn finish(self) -> (StructureLabels, Vec<Note>) {
        let mut notes = Vec::new();
        for first in Structure::ALL {
            for second in Structure::ALL {
                let at = |s: Structure| usize::from(s.value());
                let voxels = self.overlaps[at(first)][at(second)];
                if voxels > 0 {
                    notes.push(Note::Overlap {
                        first,
                        second,
                        voxels,
                    });
                }
            }
        }
        (StructureLabels::new(self.map), notes)
    }
}

//! Segmentation noise: loose pieces and enclosed holes.

use super::note::Note;
use crate::anatomy::structure::largest;
use crate::anatomy::{Structure, StructureLabels};
use crate::volume::components::components;
use crate::volume::{Grid, Volume};

/// Each bone's largest piece (voxels that share a face), with what it encloses. Enclosed voxels of
/// other bones stay theirs.
pub(super) fn clean(labels: &StructureLabels) -> (StructureLabels, Vec<Note>) {
    let mut result = labels.volume().clone();
    let mut notes = Vec::new();
    for structure in Structure::ALL {
        let value = structure.value();
        let Some((min, max)) = result.bounds(|v| v == value) else {
            continue;
        };
        let bone = result.cropped(min, max).map(|v| v == value);
        let found = components(&bone);
        let main = largest(&found, 1)[0];
        let voxels = found.sizes.iter().sum::<usize>() - found.sizes[main as usize - 1];
        if voxels > 0 {
            notes.push(Note::Dropped {
                structure,
                voxels,
                pieces: found.sizes.len() - 1,
            });
        }
        let mut filled = 0;
        let enclosed = enclosed(&found.mask(main));
        for (offset, &hole) in enclosed.data.iter().enumerate() {
            let [i, j, k] = enclosed.grid.voxel(offset);
            let at = result.grid.offset(i + min[0], j + min[1], k + min[2]);
            if bone.data[offset] && found.labels.data[offset] != main {
                result.data[at] = 0;
            }
            if hole && result.data[at] == 0 {
                result.data[at] = value;
                filled += usize::from(!bone.data[offset]);
            }
        }
        if filled > 0 {
            notes.push(Note::Filled {
                structure,
                voxels: filled,
            });
        }
    }
    (StructureLabels::new(result), notes)
}

/// The voxels outside a mask from which no way along faces leads out of its box.
fn enclosed(mask: &Volume<bool>) -> Volume<bool> {
    let dims = mask.grid.dims;
    // With a border all around, what is outside is one piece and has the first voxel.
    let wide = Grid {
        dims: dims.map(|n| n + 2),
        ..mask.grid.clone()
    };
    let mut free = Volume::filled(wide.clone(), true);
    for (offset, &inside) in mask.data.iter().enumerate() {
        let [i, j, k] = mask.grid.voxel(offset);
        free.data[wide.offset(i + 1, j + 1, k + 1)] = !inside;
    }
    let found = components(&free);
    let hole = |offset: usize| {
        let [i, j, k] = mask.grid.voxel(offset);
        found.labels.at(i + 1, j + 1, k + 1) > 1
    };
    Volume::new(mask.grid.clone(), (0..mask.grid.len()).map(hole).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Side;
    use crate::geometry::Point;

    #[test]
    fn loose_pieces_go_and_enclosed_holes_are_filled() {
        let grid = Grid::axis_aligned([12, 9, 9], 1.0, Point::origin());
        let mut map = Volume::filled(grid.clone(), 0u8);
        let (hip, femur) = (Structure::Hip(Side::Left), Structure::Femur(Side::Left));
        // A shell of 5 x 5 x 5 with another bone's voxel and a loose one of its own inside, open
        // nowhere, and a loose piece outside.
        for offset in 0..map.data.len() {
            let v = grid.voxel(offset);
            let shell =
                v.iter().all(|&n| (2..=6).contains(&n)) && v.iter().any(|&n| n == 2 || n == 6);
            if shell {
                map.data[offset] = hip.value();
            }
        }
        map.data[grid.offset(4, 4, 4)] = femur.value();
        map.data[grid.offset(3, 3, 3)] = 0;
        map.data[grid.offset(5, 5, 5)] = 0;
        map.data[grid.offset(9, 4, 4)] = hip.value();
        map.data[grid.offset(10, 4, 4)] = hip.value();
        let (clean, notes) = clean(&StructureLabels::new(map));
        assert_eq!(clean.volume().at(9, 4, 4), 0);
        assert_eq!(clean.volume().at(4, 4, 4), femur.value());
        assert_eq!(clean.count(hip), 124);
        assert_eq!(
            notes,
            [
                Note::Dropped {
                    structure: hip,
                    voxels: 2,
                    pieces: 1
                },
                Note::Filled {
                    structure: hip,
                    voxels: 26
                }
            ]
        );
        // A hole that is open to one side is none.
        let mut open = clean.volume().clone();
        open.data[grid.offset(2, 4, 4)] = 0;
        open.data[grid.offset(3, 4, 4)] = 0;
        let open = StructureLabels::new(open);
        assert_eq!(super::clean(&open), (open, vec![]));
    }
}

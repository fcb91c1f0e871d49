//! The segmentation's bones.

use super::contents::Source;
use crate::anatomy::import::{CtImportError, LabelMeaning, Note};
use crate::anatomy::{Side, Structure, StructureLabels};
use crate::volume::Volume;
use hdf5_pure::{DType, Group, VlenStringReadOptions};

/// The data set's labels; 3 is vertebrae. The sacrum is in two parts, the lower one in some specimens.
const LABELS: [(u8, Structure); 6] = [
    (1, Structure::Hip(Side::Left)),
    (2, Structure::Hip(Side::Right)),
    (4, Structure::Sacrum),
    (5, Structure::Femur(Side::Left)),
    (6, Structure::Femur(Side::Right)),
    (7, Structure::Sacrum),
];

/// No label has a longer name.
const MOST_NAME_BYTES: usize = 256;

/// Turns label values to bones: by the names in `labels-def` where there are some, else by the numbers
/// that the data set documents.
pub(super) fn read_structures(
    source: &Source,
    map: &Volume<u8>,
    names: Option<&Group>,
) -> Result<(StructureLabels, Vec<Note>), CtImportError> {
    let mut of = [0u8; 256];
    let mut notes = Vec::new();
    let named = names.map_or_else(Vec::new, named);
    if named.is_empty() {
        for (value, structure) in LABELS {
            of[usize::from(value)] = structure.value();
        }
        notes.push(Note::Reader(
            "the file does not name its labels; read by the data set's numbers".into(),
        ));
    }
    for (value, structure) in named {
        of[usize::from(value)] = structure.value();
    }
    let structures = StructureLabels::new(map.map(|v| of[usize::from(v)]));
    match structures.absent() {
        absent if absent.is_empty() => Ok((structures, notes)),
        absent => {
            let names: Vec<&str> = absent.into_iter().map(Structure::name).collect();
            Err(source.problem(format!("vol-seg has no voxel of {}", names.join(", "))))
        }
    }
}

/// The values whose names are a bone's; those of unreadable names are left out.
fn named(group: &Group) -> Vec<(u8, Structure)> {
    let mut values: Vec<(u8, Structure)> = group
        .datasets()
        .unwrap_or_default()
        .iter()
        .filter_map(|part| {
            let value = part.parse().ok()?;
            match LabelMeaning::recognized(&name_of(group, part)?)? {
                LabelMeaning::One(structure) => Some((value, structure)),
                _ => None,
            }
        })
        .collect();
    values.sort_unstable();
    values
}

/// One text of a dataset, whichever of HDF5's two kinds of strings it is.
fn name_of(group: &Group, part: &str) -> Option<String> {
    let data = group.dataset(part).ok()?;
    let alone = data.shape().ok()?.iter().all(|&n| n == 1);
    let names = match data.dtype().ok()? {
        DType::VariableLengthString if alone => data.read_vlen_strings(
            VlenStringReadOptions::new()
                .with_max_elements(1)
                .with_max_payload_bytes(MOST_NAME_BYTES),
        ),
        DType::String if alone && data.element_size().ok()? <= MOST_NAME_BYTES as u64 => {
            data.read_string()
        }
        _ => return None,
    };
    Some(names.ok()?.first()?.trim_matches(['\0', ' ']).to_owned())
}

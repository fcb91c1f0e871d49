//! One file of all structures.

use super::class_map::TotalsegVersion;
use super::label_names::named_values;
use crate::anatomy::import::{CtImportError, Note};
use crate::anatomy::{Structure, StructureLabels};
use crate::volume::read_volume;
use std::path::Path;

pub(super) fn read(
    path: &Path,
    version: Option<TotalsegVersion>,
) -> Result<(StructureLabels, Vec<Note>), CtImportError> {
    let file = |reason: String| CtImportError::File {
        path: path.into(),
        reason,
    };
    let map = read_volume::<u8>(path)?;
    let mut there = [false; 256];
    for &v in &map.data {
        there[usize::from(v)] = true;
    }
    let named = named_values(path)?.filter(|names| !names.is_empty());
    let mut notes = Vec::new();
    let mut values = [0u8; 5];
    if let Some(names) = named {
        for (n, structure) in Structure::ALL.into_iter().enumerate() {
            let named = names.get(&structure).copied();
            let value = named.and_then(|v| u8::try_from(v).ok()).filter(|&v| v != 0);
            values[n] = value.ok_or_else(|| {
                file(format!(
                    "names no value for {} in its header's label table; it was made by another task than total",
                    structure.name()
                ))
            })?;
        }
        if let Some(version) = version
            && values != Structure::ALL.map(|s| version.value(s))
        {
            return Err(file(format!(
                "names its values in its header ({}), and they are not those of version {}; leave the version out",
                listed(&values),
                version.number()
            )));
        }
    } else {
        let version = match version {
            Some(version) => version,
            None => by_values(&there).map_err(file)?,
        };
        values = Structure::ALL.map(|s| version.value(s));
        let most = (0..=u8::MAX).rev().find(|&v| there[usize::from(v)]);
        if let Some(most) = most.filter(|&v| v > version.classes()) {
            return Err(file(format!(
                "holds the value {most}; class map {} ends at {}",
                version.number(),
                version.classes()
            )));
        }
        notes.push(Note::Reader(format!(
            "the segmentation does not name its values; read by class map {} ({})",
            version.number(),
            listed(&values)
        )));
    }
    let absent: Vec<String> = Structure::ALL
        .into_iter()
        .zip(values)
        .filter(|(_, v)| !there[usize::from(*v)])
        .map(|(s, v)| format!("{} ({v})", s.name()))
        .collect();
    if !absent.is_empty() {
        return Err(file(format!(
            "has no voxel of {}; the scan does not show it, or the class map is another version's",
            absent.join(", ")
        )));
    }
    let mut of = [0u8; 256];
    for (structure, value) in Structure::ALL.into_iter().zip(values) {
        of[usize::from(value)] = structure.value();
    }
    Ok((StructureLabels::new(map.map(|v| of[usize::from(v)])), notes))
}

/// The only version of which all bones are there.
fn by_values(there: &[bool; 256]) -> Result<TotalsegVersion, String> {
    let fits = |version: &TotalsegVersion| {
        let bones = Structure::ALL.map(|s| version.value(s));
        let most = (0..256).rev().find(|&v| there[v]).unwrap_or(0);
        bones.iter().all(|&v| there[usize::from(v)]) && most <= usize::from(version.classes())
    };
    let fitting: Vec<TotalsegVersion> = TotalsegVersion::ALL.into_iter().filter(fits).collect();
    match fitting.as_slice() {
        [one] => Ok(*one),
        [] => Err(format!(
            "does not name its values, and holds the bones of no class map: version 1 has {}, version 2 has {}",
            listed(&Structure::ALL.map(|s| TotalsegVersion::V1.value(s))),
            listed(&Structure::ALL.map(|s| TotalsegVersion::V2.value(s)))
        )),
        _ => Err("does not name its values, and they fit class maps 1 and 2; say which version of TotalSegmentator made it".into()),
    }
}

fn listed(values: &[u8; 5]) -> String {
    let pairs = Structure::ALL.iter().zip(values);
    let texts: Vec<String> = pairs.map(|(s, v)| format!("{} {v}", s.name())).collect();
    texts.join(", ")
}

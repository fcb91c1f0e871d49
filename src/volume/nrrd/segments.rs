//! What a segmentation's header says of its segments.

use super::header::Header;
use crate::volume::VolumeFileError;
use std::collections::BTreeMap;

/// One segment: the voxels that have `label` in `layer`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Segment {
    pub name: String,
    /// 1 to 255
    pub label: u8,
    /// From 0.
    pub layer: usize,
}

/// The segments of a file with so many layers, by their number, from keys like `Segment12_Name`. Before
/// labels and layers were written, every segment had a layer of ones for itself, in its order.
///
/// # Errors
/// When one has no name, no label from 1 to 255, or a layer that is not there.
pub(super) fn segments_of(header: &Header, layers: usize) -> Result<Vec<Segment>, VolumeFileError> {
    let keys = keys_by_number(&header.segment_keys);
    let own_layers = layers > 1 || keys.len() == 1;
    let mut segments = Vec::new();
    for (place, (number, keys)) in keys.iter().enumerate() {
        let wrong = |key: &str, expected: &str| {
            let found = keys.get(key).copied().unwrap_or("missing");
            header.fields.wrong(format!(
                "its Segment{number}_{key} is {found}; expected {expected} (save the segmentation again with \
                 a new Slicer)"
            ))
        };
        let name = keys.get("Name").ok_or_else(|| {
            header
                .fields
                .wrong(format!("its header has no Segment{number}_Name"))
        })?;
        let label: Option<u8> = match keys.get("LabelValue") {
            Some(text) => text.parse().ok(),
            None => own_layers.then_some(1),
        };
        let label = label
            .filter(|&label| label > 0)
            .ok_or_else(|| wrong("LabelValue", "1 to 255"))?;
        let layer: Option<usize> = match keys.get("Layer") {
            Some(text) => text.parse().ok(),
            None if layers > 1 => Some(place),
            None => Some(0),
        };
        let layer = layer
            .filter(|&layer| layer < layers)
            .ok_or_else(|| wrong("Layer", &format!("0 to {}", layers - 1)))?;
        segments.push(Segment {
            name: (*name).to_owned(),
            label,
            layer,
        });
    }
    Ok(segments)
}

/// What follows `Segment12_`, with its value, by the number.
fn keys_by_number(keys: &BTreeMap<String, String>) -> BTreeMap<u32, BTreeMap<&str, &str>> {
    let mut numbers: BTreeMap<u32, BTreeMap<&str, &str>> = BTreeMap::new();
    for (key, value) in keys {
        let numbered = key
            .strip_prefix("Segment")
            .and_then(|rest| rest.split_once('_'))
            .and_then(|(number, what)| Some((number.parse().ok()?, what)));
        if let Some((number, what)) = numbered {
            numbers
                .entry(number)
                .or_default()
                .insert(what, value.trim());
        }
    }
    numbers
}

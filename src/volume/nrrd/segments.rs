//! The names of a segmentation's labels.

use super::header::Header;
use crate::volume::{VolumeFileError, source};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// What a header says of one segment.
#[derive(Debug, Default)]
struct Segment {
    name: Option<String>,
    label: Option<String>,
    layer: Option<String>,
}

/// The labels of a segmentation by Slicer with their segments' names, in the order of its segments;
/// empty for an NRRD file that is no segmentation. Voxels are not read.
///
/// # Errors
/// When the file is no NRRD file, its segments overlap (lie in several layers), or a segment has no name
/// or no label from 1 to 255.
pub fn nrrd_segment_names(path: &Path) -> Result<Vec<(u8, String)>, VolumeFileError> {
    let header = Header::read(&mut source::open(path)?, path)?;
    let segments = segments(&header.segment_keys);
    let layers: BTreeSet<_> = segments.values().flat_map(|s| &s.layer).collect();
    if layers.len() > 1 {
        return Err(header.wrong(format!(
            "its segments overlap: they lie in {} layers and a label map has one; in Slicer, export \
             the segments that are needed as one label map",
            layers.len()
        )));
    }
    let alone = segments.len() == 1;
    let mut names = Vec::new();
    for (number, segment) in segments {
        let label = match segment.label.as_deref().map(str::trim) {
            Some(label) => label,
            // Before labels were written, every segment had a layer of ones for itself.
            None if alone => "1",
            None => "missing",
        };
        let label: u8 = label.parse().ok().filter(|&l| l > 0).ok_or_else(|| {
            header.wrong(format!(
                "its Segment{number}_LabelValue is {label}; expected 1 to 255 (save the segmentation again \
                 with a new Slicer)"
            ))
        })?;
        let name = segment
            .name
            .ok_or_else(|| header.wrong(format!("its header has no Segment{number}_Name")))?;
        if names.iter().any(|&(other, _)| other == label) {
            return Err(header.wrong(format!("two of its segments have the label {label}")));
        }
        names.push((label, name));
    }
    Ok(names)
}

/// Segments by their number, from keys like `Segment12_Name`.
fn segments(keys: &BTreeMap<String, String>) -> BTreeMap<u32, Segment> {
    let mut segments: BTreeMap<u32, Segment> = BTreeMap::new();
    for (key, value) in keys {
        let Some((number, what)) = key
            .strip_prefix("Segment")
            .and_then(|rest| rest.split_once('_'))
        else {
            continue;
        };
        let Ok(number) = number.parse() else {
            continue;
        };
        let segment = segments.entry(number).or_default();
        match what {
            "Name" => segment.name = Some(value.clone()),
            "LabelValue" => segment.label = Some(value.clone()),
            "Layer" => segment.layer = Some(value.clone()),
            _ => {}
        }
    }
    segments
}

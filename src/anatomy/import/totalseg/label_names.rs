//! The names of a multi-label file's classes, in its header's extension.

use crate::anatomy::Structure;
use crate::volume::VolumeFileError;
use crate::volume::nifti::read_nifti_extensions;
use std::collections::BTreeMap;
use std::path::Path;

/// The bones' values that a file's own label table names (`CaretExtension`, `LabelTable`), or `None`
/// if there is no such table: older versions wrote none, and other programs drop it.
pub(super) fn named_values(
    path: &Path,
) -> Result<Option<BTreeMap<Structure, i64>>, VolumeFileError> {
    let name = path.to_string_lossy().to_lowercase();
    if !(name.ends_with(".nii") || name.ends_with(".nii.gz")) {
        return Ok(None);
    }
    let extensions = read_nifti_extensions(path)?;
    Ok(extensions.iter().find_map(|extension| {
        let text = String::from_utf8_lossy(&extension.data);
        table(text.trim_matches(['\0', ' ', '\n', '\r', '\t']))
    }))
}

/// `None` for what is no label table.
fn table(xml: &str) -> Option<BTreeMap<Structure, i64>> {
    let document = roxmltree::Document::parse(xml).ok()?;
    let labels = document
        .descendants()
        .find(|n| n.has_tag_name("LabelTable"))?;
    let mut values = BTreeMap::new();
    for label in labels.children().filter(|n| n.has_tag_name("Label")) {
        let key = label
            .attribute("Key")
            .and_then(|key| key.trim().parse().ok());
        let text = label.text().unwrap_or_default().trim();
        let structure = Structure::ALL.into_iter().find(|s| s.name() == text);
        if let (Some(key), Some(structure)) = (key, structure) {
            values.insert(structure, key);
        }
    }
    Some(values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Side;

    #[test]
    fn a_table_gives_the_bones_and_other_text_gives_none() {
        let xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?> <CaretExtension> <VolumeInformation Index=\"0\"> \
            <LabelTable><Label Key=\"1\" Red=\"1.0\"><![CDATA[spleen]]></Label>\n\
            <Label Key=\"25\"><![CDATA[sacrum]]></Label><Label Key=\"77\">hip_left</Label>\
            </LabelTable></VolumeInformation></CaretExtension>";
        let values = table(xml).unwrap();
        let expected = [(Structure::Sacrum, 25), (Structure::Hip(Side::Left), 77)];
        assert_eq!(values, BTreeMap::from(expected));
        assert_eq!(table("{\"json\": 1}"), None);
        assert_eq!(table("<AFNI_attributes/>"), None);
    }
}

//! Whose anatomy a study is made of.

use super::table::Table;
use crate::anatomy::Source;

/// Every specimen with what is known of it; none for studies that did not record it.
pub fn specimens(list: &[(String, Source)]) -> Option<Table> {
    let row = |(name, source): &(String, Source)| {
        let density = match source.assigned_density {
            true => "assigned by rule",
            false => "measured",
        };
        [
            name,
            &source.kind,
            &source.sex,
            &source.licence,
            density,
            &source.description,
        ]
        .map(String::from)
        .to_vec()
    };
    (!list.is_empty()).then(|| Table {
        name: "specimens".into(),
        title: "Specimens".into(),
        header: [
            "specimen",
            "kind",
            "sex",
            "licence",
            "density",
            "description",
        ]
        .map(String::from)
        .to_vec(),
        rows: list.iter().map(row).collect(),
        notes: Vec::new(),
    })
}

//! What tests of the built binary read of a study's rows.

use pao_sim::report::Rows;
use pao_sim::store::{Kind, Role, SCHEMA};
use std::path::Path;

/// Every promised column of every row, numbers by their bits.
pub fn promised(table: &Path) -> Vec<(String, Vec<String>)> {
    let rows = Rows::read(table).unwrap();
    assert_ne!(rows.len(), 0);
    let columns = SCHEMA
        .columns
        .iter()
        .filter(|c| c.role != Role::Measurement);
    columns
        .map(|column| {
            let values = match column.kind {
                Kind::Text => rows.text(&column.name).to_vec(),
                _ => {
                    let numbers = rows.numbers(&column.name).iter();
                    numbers
                        .map(|number| format!("{:x}", number.to_bits()))
                        .collect()
                }
            };
            (column.name.clone(), values)
        })
        .collect()
}

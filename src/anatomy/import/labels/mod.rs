//! A label map of one's own with a table that says what its values are.

mod halves;
mod split;
mod table;

pub use split::structures_of_labels;
pub use table::{LabelTable, read_label_table};

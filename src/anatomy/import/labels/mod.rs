//! A label map of one's own with a table that says what its values are, or with names of its own.

mod halves;
mod split;
mod table;

pub use split::structures_of_labels;
pub use table::{LabelTable, label_table_of_segments, read_label_table};

//! Tables, figures and the page that a study ends in.

pub mod canvas;
pub mod errors_table;
pub mod histograms;
pub mod offsets_table;
pub mod reference;
pub mod rows;
pub mod table;
pub mod tests_table;

pub use rows::Rows;
pub use table::Table;

//! Tables, figures and the page that a study ends in.

pub mod canvas;
pub mod effort_table;
pub mod errors_table;
pub mod histograms;
pub mod html;
pub mod numbers;
pub mod offsets_table;
pub mod picture;
pub mod reference;
pub mod rows;
pub mod sampling_table;
pub mod specimen;
pub mod specimens_table;
pub mod table;
pub mod tests_table;
pub mod write;

pub use picture::{Picture, PictureError};
pub use rows::{Rows, RowsError};
pub use table::Table;
pub use write::{About, Group, ReportError, write};

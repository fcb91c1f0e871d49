//! Landmarks and rim traces that people placed: points by name from files of 3D Slicer and CSV, and
//! the one file that is written for correcting them in Slicer.
//!
//! | file | frame |
//! |---|---|
//! | `.fcsv` (Slicer 4.3 to 5.x) | its header's `CoordinateSystem` |
//! | `.mrk.json` (Slicer Markups, schema 1.x) | each markup's `coordinateSystem` |
//! | `.csv` | the names of its columns |
//!
//! A file that does not say its frame is refused. [`names`] is the rule by which a name means a
//! landmark.

mod csv_table;
mod error;
mod fcsv;
mod markups;
pub mod names;
mod overrides;
mod points;
#[cfg(test)]
mod tests;
mod write_markups;

pub use error::PointsFileError;
pub use overrides::{LandmarkOverrides, read_landmark_overrides};
pub use points::{NamedCurve, NamedPoint, PointsFile, read_points};
pub use write_markups::write_markups;

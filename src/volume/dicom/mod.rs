//! CT volumes as DICOM series: one file a slice.
//!
//! `folder` finds the files of one series, `data_set` takes the attributes out of a file (`meta`,
//! `walk`), `slice` checks them, `stack` puts the slices in order, `pixels` (with `rle` and `jpeg`)
//! decodes them and `read` does all of it. A DICOM world is LPS in mm, as ours is.
//!
//! dicom-parser goes through a file and allocates what an element claims to need. `walk` compares
//! every length with the file's before a value is read, keeps the two dozen attributes that matter
//! and skips the rest. dicom-object and dicom-pixeldata, the layers above, have no place for such
//! a check; the latter's decoder of RLE allocates 14 GB for a broken file of a kilobyte.

mod data_set;
mod folder;
mod jpeg;
mod meta;
mod pixels;
mod problem;
mod read;
mod rle;
mod slice;
mod stack;
mod syntax;
mod walk;

pub use problem::{DicomProblem, SeriesSummary};
pub use read::{read_dicom_series, read_dicom_series_of};

//! CT volumes as DICOM series: one file a slice.
//!
//! `folder` finds the files of one series, `data_set` takes the attributes out of a file, `slice`
//! checks them, `stack` puts the slices in order, `pixels` (with `rle` and `jpeg`) decodes them and
//! `read` does all of it. A DICOM world is LPS in mm, as ours is.
//!
//! dicom-parser reads element by element and allocates what an element claims to need, so
//! `data_set` compares every length with the file's before a value is read, keeps the two dozen
//! attributes that matter and skips the rest. No image library sits between the file and the
//! voxels: dicom-pixeldata's decoders panic on broken RLE and JPEG streams, and what it adds
//! (windows, colours) is not wanted here.

mod data_set;
mod folder;
mod jpeg;
mod pixels;
mod problem;
mod read;
mod rle;
mod slice;
mod stack;
mod syntax;

pub use problem::{DicomProblem, SeriesSummary};
pub use read::{read_dicom_series, read_dicom_series_of};

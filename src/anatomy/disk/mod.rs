//! A specimen as a folder.
//!
//! | file | what |
//! |---|---|
//! | `specimen.toml` | format version, name and source |
//! | `ct.nii.gz` | Hounsfield units |
//! | `labels.nii.gz` | 0 background, 1 pelvis, 2 left femur, 3 right femur, on the CT's grid |
//! | `landmarks.csv` | `name,x_lps_mm,y_lps_mm,z_lps_mm`, a row for each landmark and side (`ASIS_l`) |
//! | `rims.csv` | `side,x_lps_mm,y_lps_mm,z_lps_mm`, each rim's points in their order round the rim |
//!
//! Both tables may go on with `found,uncertainty_mm`: detected, given or picked, and a standard
//! deviation in mm ([`Provenance`](super::Provenance)).
//!
//! Points are in the world of the CT: LPS (x to the patient's left, y posterior, z superior), mm.
//! Lines that start with `#` are comments.

mod error;
mod header;
mod points;
mod read;
mod write;

pub use error::SpecimenError;
pub use header::FORMAT_VERSION;
pub use read::{read_source, read_specimen};
pub use write::write_specimen;

/// The file that makes a folder a specimen.
pub const HEADER_FILE: &str = "specimen.toml";
const CT_FILE: &str = "ct.nii.gz";
const LABELS_FILE: &str = "labels.nii.gz";
const LANDMARKS_FILE: &str = "landmarks.csv";
const RIMS_FILE: &str = "rims.csv";

/// Every file of a specimen's folder.
pub const SPECIMEN_FILES: [&str; 5] =
    [HEADER_FILE, CT_FILE, LABELS_FILE, LANDMARKS_FILE, RIMS_FILE];

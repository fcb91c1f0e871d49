//! Specimens: CT, labels, landmarks, rims; their anatomical frames; where they come from.

pub mod check;
pub mod detect;
pub mod disk;
pub mod frame;
pub mod import;
pub mod label;
pub mod landmark;
pub mod landmark_files;
pub mod lce;
pub mod mirror;
mod patient_frame;
pub mod phantom;
pub mod problem;
pub mod provenance;
pub mod rim;
pub mod side;
pub mod specimen;
pub mod structure;
pub mod surfaces;

pub use disk::{SpecimenError, read_specimen, write_specimen};
pub use frame::Hip;
pub use label::Label;
pub use landmark::{Landmark, Landmarks};
pub use lce::{LceApex, lce_angle};
pub use mirror::mirror;
pub use patient_frame::PatientFrame;
pub use phantom::{PhantomParameters, phantom, phantom_structures};
pub use problem::{SEXES, SpecimenProblem, is_specimen_name, specimen_problems};
pub use provenance::{Confidence, Found, Provenance};
pub use rim::Rim;
pub use side::Side;
pub use specimen::{Source, Specimen};
pub use structure::{Structure, StructureLabels};

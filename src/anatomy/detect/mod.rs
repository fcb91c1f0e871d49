//! Landmarks and rims found by geometric rules on bone surfaces.
//!
//! The rules use directions of the pelvis and sizes of the bones themselves, so they hold for any
//! position of the patient in the scanner. The order: pelvic frame, femoral heads, bony
//! prominences, symphysis, foramen and notch, rim.

mod bones;
mod closed_curve;
mod error;
mod foramen;
mod head;
mod landmarks;
mod local;
mod marks;
mod missing;
mod notch;
mod outline;
mod pelvic_frame;
mod prominence;
mod rim;
mod spot;
mod symphysis;

pub use bones::BoneSurfaces;
pub use error::DetectError;
pub use head::Head;
pub(in crate::anatomy) use head::femoral_head;
pub use landmarks::{Detected, Extra, detect, detect_with};
pub(in crate::anatomy) use local::Local;
pub use marks::{Given, Marks, Unfound};
pub(in crate::anatomy) use marks::{by_reason, by_rule_but};
pub use missing::{Missing, Place};

//! Specimens: CT, labels, landmarks, rims; their anatomical frames; where they come from.

pub mod frame;
pub mod label;
pub mod landmark;
pub mod lce;
pub mod side;
pub mod specimen;

pub use frame::Hip;
pub use label::Label;
pub use landmark::{Landmark, Landmarks};
pub use lce::{LceApex, lce_angle};
pub use side::Side;
pub use specimen::{Source, Specimen};

//! Estimates the fragment's shape from cut lines in the images.

pub mod annotation;
pub mod estimate;
pub mod plane_fit;
pub mod reconstruct;

pub use annotation::{Crossing, CutAnnotation};
pub use estimate::{EstimatedCuts, ShapeInput, estimate_cuts};
pub use plane_fit::RansacParameters;
pub use reconstruct::RegisteredView;

//! Estimates the fragment's shape from cut lines in the images.

pub mod annotation;

pub use annotation::{Crossing, CutAnnotation};

//! Simulation studies of X-ray navigation for periacetabular osteotomy (PAO).
//!
//! The modules form one direction: each uses only those listed after it (ARCHITECTURE.md).

pub mod anatomy;
#[cfg(feature = "fail-points")]
pub mod fail_point;
#[cfg(not(feature = "fail-points"))]
mod fail_point;
pub mod geometry;
pub mod image;
pub mod objective;
pub mod optimize;
pub mod random;
pub mod registration;
pub mod report;
pub mod shape_estimation;
pub mod simd;
pub mod simulation;
pub mod statistics;
pub mod store;
pub mod study;
pub mod surgery;
pub mod volume;
pub mod xray;

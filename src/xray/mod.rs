//! The X-ray imaging chain: camera, attenuation, projection, image pyramid and photon noise.

pub mod attenuation;
pub mod body;
pub mod bone;
pub mod camera;
pub mod footprint;
mod kernel;
pub mod projector;
pub mod pyramid;
mod rays;
pub mod reference;
mod slice;

pub use crate::simd::SimdLevel;
pub use attenuation::AttenuationParameters;
pub use body::BodyVolume;
pub use bone::BoneVolume;
pub use camera::{Camera, Orbit};
pub use footprint::PixelRect;
pub use projector::{Projector, ProjectorParameters, RayCast, SliceResampling};

#[cfg(test)]
mod closed_form_tests;
#[cfg(test)]
mod projection_tests;
#[cfg(test)]
mod slice_tests;

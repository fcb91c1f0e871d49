//! The X-ray imaging chain: camera, attenuation, projection, image pyramid and photon noise.

pub mod bone;
pub mod camera;

pub use bone::BoneVolume;
pub use camera::{Camera, Orbit};

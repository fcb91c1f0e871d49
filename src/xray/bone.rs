//! A bone's attenuation volume, prepared for projection.

use crate::volume::Volume;

/// One object of a registration: linear attenuation per mm, zero outside the bone, with a border
/// of one zero voxel, in the world of the specimen's CT.
#[derive(Clone, Debug)]
pub struct BoneVolume {
    /// Attenuation per mm.
    pub attenuation: Volume<f32>,
}

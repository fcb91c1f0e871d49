//! The bones that a specimen is made of.

use crate::anatomy::Side;
use crate::volume::Surface;

/// Closed surfaces of the bones of a pelvis and both hips, in the specimen's world (LPS, mm),
/// triangles anticlockwise as seen from outside.
#[derive(Clone, Debug)]
pub struct BoneSurfaces {
    pub sacrum: Surface,
    /// By [`Side::index`].
    pub hips: [Surface; 2],
    /// By [`Side::index`].
    pub femurs: [Surface; 2],
}

impl BoneSurfaces {
    /// The hip bone of one side.
    pub fn hip(&self, side: Side) -> &Surface {
        &self.hips[side.index()]
    }

    /// The femur of one side.
    pub fn femur(&self, side: Side) -> &Surface {
        &self.femurs[side.index()]
    }
}

//! Closed surfaces of the bones of a segmentation.

use crate::anatomy::detect::BoneSurfaces;
use crate::anatomy::{Side, Structure, StructureLabels};
use crate::volume::{Surface, SurfaceParameters};

impl StructureLabels {
    /// The surface of each bone's voxels, in the world (LPS, mm).
    pub fn surfaces(&self, parameters: &SurfaceParameters) -> BoneSurfaces {
        let surface = |structure: Structure| {
            let value = structure.value();
            Surface::from_mask(self.volume(), |v| v == value, parameters)
        };
        BoneSurfaces {
            sacrum: surface(Structure::Sacrum),
            hips: Side::BOTH.map(|side| surface(Structure::Hip(side))),
            femurs: Side::BOTH.map(|side| surface(Structure::Femur(side))),
        }
    }
}

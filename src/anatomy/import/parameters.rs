//! How a specimen is made from a CT.

use crate::volume::SurfaceParameters;

/// How a specimen is made from a CT and a segmentation.
#[derive(Clone, Debug, PartialEq)]
pub struct CtImportParameters {
    /// Edge of the specimen's voxels (mm), 0.4 to 3. A CT of such voxels along the world's axes is
    /// taken as it is.
    pub voxel_mm: f64,
    /// The specimen ends this far below the lower femoral head (mm).
    pub below_heads_mm: f64,
    /// And this far above the highest voxel of sacrum and hip bones (mm).
    pub above_bones_mm: f64,
    /// The surfaces on which landmarks are sought.
    pub surface: SurfaceParameters,
}

impl Default for CtImportParameters {
    /// A study needs femora of 150 mm below the heads (DESIGN section 1); the 2 mm more leave it them
    /// when a head is found a little lower.
    fn default() -> Self {
        Self {
            voxel_mm: 1.0,
            below_heads_mm: 152.0,
            above_bones_mm: 40.0,
            surface: SurfaceParameters::default(),
        }
    }
}

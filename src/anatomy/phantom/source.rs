//! What a phantom body is, for people.

use super::build::Build;
use super::parameters::PhantomParameters;
use crate::anatomy::Source;

/// The source of the phantom body `number`, without making the body.
pub fn phantom_source(number: u32, parameters: &PhantomParameters) -> Source {
    Source {
        kind: "phantom".to_owned(),
        description: format!(
            "built-in phantom {number} of population {}, voxels of {} mm",
            parameters.seed, parameters.voxel_mm
        ),
        licence: "none".to_owned(),
        sex: Build::draw(number, parameters).sex.name().to_owned(),
        assigned_density: true,
    }
}

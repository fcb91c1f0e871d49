//! Hounsfield values of the body outside the bones.

use super::body::Body;
use super::noise::GaussianField;
use super::parameters::SurfacesParameters;
use crate::random::Stream;
use crate::volume::distance::squared_distance;
use crate::volume::{Grid, Volume};

/// Air outside the body (HU).
const AIR_HU: f32 = -1000.0;

/// Thickness of the skin (mm) and its value, which air lowers in the outermost voxel (HU).
const SKIN_MM: f32 = 1.5;
const SKIN_HU: f32 = -20.0;

/// Scale of fat lobes and of the sheets of fat between muscles (mm).
const LOBE_MM: f64 = 7.0;

/// Scale over which the fat under the skin grows thicker or thinner (mm).
const FAT_LAYER_MM: f64 = 40.0;

/// Half the width, in the random field's units, of the sheets of fat between muscles.
const SHEET: f32 = 0.05;

/// The field's level above which the contents of the pelvis are fat: about a quarter of them.
const PELVIC_FAT_LEVEL: f32 = 0.65;

/// Muscles touch bone: no sheet of fat nearer than this (mm).
const MUSCLE_MM: f32 = 6.0;

/// The whole body as if it had no bones: skin, a layer of fat, muscles with sheets of fat between
/// them, and the contents of the pelvis where hip bones and sacrum lie on either side.
pub(super) fn soft_tissue(
    body: &Body,
    bones: &Volume<bool>,
    pelvis: &Volume<bool>,
    p: &SurfacesParameters,
    stream: &mut Stream,
) -> Volume<f32> {
    let grid = &bones.grid;
    let outside = Volume::new(
        grid.clone(),
        (0..grid.len())
            .map(|o| !body.contains(&grid.center(grid.voxel(o))))
            .collect(),
    );
    let at_bone = squared_distance(bones).map(|d| d < MUSCLE_MM * MUSCLE_MM);
    let mut hu = squared_distance(&outside);
    let cavity = pelvic_cavity(pelvis);
    let (low, high) = (grid.center([0; 3]), grid.center(grid.dims.map(|n| n - 1)));
    let mut field = |sigma_mm| GaussianField::new(stream, &low, &high, sigma_mm, p.voxel_mm);
    let (lobes, sheets, layer) = (field(LOBE_MM), field(LOBE_MM), field(FAT_LAYER_MM));
    let tissue = |offset: usize, below_skin: f32| {
        let depth = below_skin.sqrt();
        if outside.data[offset] {
            return AIR_HU;
        }
        if depth <= SKIN_MM {
            return SKIN_HU;
        }
        let muscle = p.muscle_hu as f32;
        if at_bone.data[offset] {
            return muscle;
        }
        let at = grid.center(grid.voxel(offset));
        let fat = p.fat_hu as f32;
        let thickness = p.fat_mm as f32 * (1.0 + 0.25 * layer.at(&at)).clamp(0.4, 1.6);
        if depth < thickness {
            return fat;
        }
        if cavity[offset] {
            return if lobes.at(&at) > PELVIC_FAT_LEVEL {
                fat
            } else {
                p.organ_hu as f32
            };
        }
        let between = (-(sheets.at(&at) / SHEET).powi(2)).exp();
        muscle + (fat - muscle) * between
    };
    // Where the squared distance stood: a volume fewer in memory.
    for (offset, value) in hu.data.iter_mut().enumerate() {
        *value = tissue(offset, *value);
    }
    hu
}

/// Voxels that have pelvic bone on their left and on their right in the same row.
fn pelvic_cavity(pelvis: &Volume<bool>) -> Vec<bool> {
    let Grid {
        dims: [ni, nj, nk], ..
    } = pelvis.grid;
    let mut inside = vec![false; ni * nj * nk];
    for row in 0..nj * nk {
        let line = &pelvis.data[row * ni..(row + 1) * ni];
        let first = line.iter().position(|&b| b);
        let last = line.iter().rposition(|&b| b);
        if let (Some(first), Some(last)) = (first, last) {
            inside[row * ni + first..row * ni + last].fill(true);
        }
    }
    inside
}

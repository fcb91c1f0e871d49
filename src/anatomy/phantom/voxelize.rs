//! From shapes to a specimen: CT, labels, landmarks and rims.

use super::PhantomParameters;
use super::bone_density::BoneDensity;
use super::distance::smooth_step;
use super::noise::Noise;
use super::skeleton::{Bone, Skeleton, sided};
use super::soft_tissue::SoftTissue;
use super::source::phantom_source;
use crate::anatomy::{Landmark, Landmarks, Side, Specimen, Structure, StructureLabels};
use crate::geometry::Point;
use crate::random::{Purpose, stream};
use crate::volume::{Grid, Volume};
use rayon::prelude::*;

/// The femora end this far below the head's centre (DESIGN section 1).
const FEMUR_END_MM: f64 = 150.0;
/// Room above the iliac crests and around the skin.
const ABOVE_CREST_MM: f64 = 32.0;
const AROUND_SKIN_MM: f64 = 10.0;
/// Half the width over which the scanner blurs an edge, at 1 mm voxels and finer.
const BLUR_MM: f64 = 1.4;
/// Standard deviation of [`Noise::at`].
const NOISE_SD: f64 = 0.37;

/// Body `number` (from 1) of the phantom population, named `phantom-<number>`. Numbers divisible
/// by three are women. The world is LPS mm with the grid along its axes.
///
/// It is a pure function of `number` and `parameters`; the number of threads changes nothing.
pub fn phantom(number: u32, parameters: &PhantomParameters) -> Specimen {
    phantom_structures(number, parameters).0
}

/// The same body, with the map of its bones before sacrum and hip bones become one label: what a
/// segmentation of its CT would be.
pub fn phantom_structures(
    number: u32,
    parameters: &PhantomParameters,
) -> (Specimen, StructureLabels) {
    let skeleton = Skeleton::draw(number, parameters);
    let name = format!("phantom-{number}");
    let mut texture = stream(parameters.seed, Purpose::PhantomTexture, &name);
    let soft = SoftTissue::new(&skeleton, &mut texture);
    let bone = BoneDensity::new(&mut texture);
    let noise = Noise::new(&mut texture);
    let landmarks = landmarks(&skeleton);
    let grid = grid(&skeleton, &soft, parameters.voxel_mm);
    let (ct, structures) = fill(&grid, &skeleton, &soft, &bone, &noise, parameters);
    let world = skeleton.build.world_from_pelvis;
    let rims = Side::BOTH.map(|side| {
        let rim = skeleton.hips[side.index()].rim();
        rim.iter().map(|p| world * sided(p, side)).collect()
    });
    let structures = StructureLabels::new(Volume::new(grid.clone(), structures));
    let specimen = Specimen {
        name,
        source: phantom_source(number, parameters),
        ct: Volume::new(grid, ct),
        labels: structures.labels(),
        landmarks,
        rims,
    };
    (specimen, structures)
}

fn landmarks(skeleton: &Skeleton) -> Landmarks {
    let mut all = Landmarks::default();
    for side in Side::BOTH {
        for landmark in Landmark::ALL {
            let p = skeleton.hips[side.index()].landmark(landmark);
            let world = skeleton.build.world_from_pelvis * sided(&p, side);
            all.set(landmark, side, world);
        }
    }
    all
}

/// From above the crests to the femora's ends, the whole body wide.
fn grid(skeleton: &Skeleton, soft: &SoftTissue, voxel_mm: f64) -> Grid {
    let world = skeleton.build.world_from_pelvis;
    let mut top = f64::NEG_INFINITY;
    let mut bottom = f64::INFINITY;
    for side in Side::BOTH {
        let hip = &skeleton.hips[side.index()];
        top = top.max((world * sided(&hip.crest(), side)).z);
        bottom = bottom.min((world * sided(&hip.acetabulum.center, side)).z);
    }
    let (min, max) = soft.bounds();
    let low = [
        min[0] - AROUND_SKIN_MM,
        min[1] - AROUND_SKIN_MM,
        bottom - FEMUR_END_MM,
    ];
    let high = [
        max[0] + AROUND_SKIN_MM,
        max[1] + AROUND_SKIN_MM,
        top + ABOVE_CREST_MM,
    ];
    // Multiples of 1/8 mm are exact in binary, so that a mirror image of the grid is exact too.
    let origin = low.map(|v| (v * 8.0).floor() / 8.0);
    let dims = std::array::from_fn(|a| ((high[a] - low[a]) / voxel_mm).ceil() as usize + 1);
    Grid::axis_aligned(dims, voxel_mm, Point::from(origin))
}

fn fill(
    grid: &Grid,
    skeleton: &Skeleton,
    soft: &SoftTissue,
    bone: &BoneDensity,
    noise: &Noise,
    parameters: &PhantomParameters,
) -> (Vec<i16>, Vec<u8>) {
    let slice = grid.dims[0] * grid.dims[1];
    let mut ct = vec![0i16; grid.len()];
    let mut structures = vec![0u8; grid.len()];
    let pelvis_from_world = skeleton.build.world_from_pelvis.inverse();
    let blur = BLUR_MM.max(0.5 * parameters.voxel_mm);
    let femur_end = Side::BOTH.map(|side| {
        let head = sided(&skeleton.hips[side.index()].acetabulum.center, side);
        (skeleton.build.world_from_pelvis * head).z - FEMUR_END_MM
    });
    ct.par_chunks_mut(slice)
        .zip(structures.par_chunks_mut(slice))
        .enumerate()
        .for_each(|(k, (ct, structures))| {
            for j in 0..grid.dims[1] {
                for i in 0..grid.dims[0] {
                    let world = grid.center([i, j, k]);
                    let p = pelvis_from_world * world;
                    let mut nearest = (f64::INFINITY, Bone::Spine);
                    let mut hip = f64::INFINITY;
                    let skin = soft.skin(&world);
                    if skin < 0.0 {
                        for candidate in Bone::ALL {
                            let d = skeleton.distance(candidate, &p);
                            if d < nearest.0 {
                                nearest = (d, candidate);
                            }
                            if matches!(candidate, Bone::Hip(_) | Bone::Sacrum) {
                                hip = hip.min(d);
                            }
                        }
                    }
                    let (d, which) = nearest;
                    let around = if d < -blur {
                        0.0
                    } else {
                        soft.hu(skeleton, &world, &p, hip, skin)
                    };
                    let hu = if d < blur {
                        let b = bone.hu(skeleton, which, &p, -d, blur);
                        b + (around - b) * smooth_step(-blur, blur, d)
                    } else {
                        around
                    };
                    let hu = hu + noise.at(&world, 1.7) * (parameters.noise_hu / NOISE_SD);
                    ct[j * grid.dims[0] + i] = hu.round().clamp(-1024.0, 3071.0) as i16;
                    if d <= 0.0 {
                        structures[j * grid.dims[0] + i] = match which {
                            Bone::Hip(side) => Structure::Hip(side).value(),
                            Bone::Sacrum => Structure::Sacrum.value(),
                            Bone::Femur(side) if world.z >= femur_end[side.index()] => {
                                Structure::Femur(side).value()
                            }
                            Bone::Femur(_) | Bone::Spine => 0,
                        };
                    }
                }
            }
        });
    (ct, structures)
}

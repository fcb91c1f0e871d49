//! The CT of the moved anatomy, as attenuation (paper, section "Simulation Study" and its supplement;
//! facts 2.15).

use crate::anatomy::{Hip, Label};
use crate::geometry::{Rigid, Vector};
use crate::random::Stream;
use crate::volume::cubic::cubic;
use crate::volume::{Grid, Volume};
use crate::xray::AttenuationParameters;
use nalgebra::{Matrix3x4, Vector4};
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What fills the voxels that bone has left.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WarpParameters {
    /// Mean intensity of the air in the cuts (HU).
    pub air_mean_hu: f64,
    /// SD of the air's intensity from voxel to voxel (HU).
    pub air_sd_hu: f64,
    /// Range of the muscle's mean intensity alpha, drawn uniformly once a movement (HU).
    pub muscle_mean_hu: [f64; 2],
    /// SD of the muscle's intensity from voxel to voxel (HU).
    pub muscle_sd_hu: f64,
}

impl Default for WarpParameters {
    fn default() -> Self {
        Self {
            air_mean_hu: -1000.0,
            air_sd_hu: 10.0,
            muscle_mean_hu: [35.0, 55.0],
            muscle_sd_hu: 20.0,
        }
    }
}

impl WarpParameters {
    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        let mut check = |field: &str, value: f64, min: f64, max: f64| {
            if !(min..=max).contains(&value) {
                let message = format!("is {value}; expected {min} to {max} HU");
                problems.push((field.to_string(), message));
            }
        };
        check("air_mean_hu", self.air_mean_hu, -1100.0, 500.0);
        check("air_sd_hu", self.air_sd_hu, 0.0, 500.0);
        check("muscle_mean_hu[0]", self.muscle_mean_hu[0], -1100.0, 500.0);
        check(
            "muscle_mean_hu[1]",
            self.muscle_mean_hu[1],
            self.muscle_mean_hu[0],
            500.0,
        );
        check("muscle_sd_hu", self.muscle_sd_hu, 0.0, 500.0);
        problems
    }
}

/// The anatomy after a movement.
#[derive(Clone, Debug)]
pub struct MovedAnatomy {
    /// Linear attenuation per mm on the specimen's grid.
    pub attenuation: Volume<f32>,
    /// The muscle's mean intensity alpha that was drawn (HU).
    pub muscle_mean_hu: f64,
    /// Voxels where moved bone falls on the pelvis or the other femur, which stay as they are. The
    /// collision test lets few through; many say that the movement was not free of collision.
    pub overlap_voxels: usize,
}

/// The CT after fragment and ipsilateral femur moved, as attenuation.
///
/// `labels` is the surgery's map on the CT's grid; `fragment` and `femur` are the movements in the
/// hip's APP. In this order:
/// 1. cut voxels become air, each N(-1000, 10) HU;
/// 2. voxels that fragment or femur left, and where no bone now lies, become muscle, each
///    N(alpha, 20) HU with one alpha of U[35, 55] HU;
/// 3. moved bone overwrites what was there, fragment first, then femur. A voxel belongs to a moved
///    bone when its centre, moved back, has the bone's label as nearest; its intensity is interpolated
///    with cubic (Catmull-Rom) splines in the CT, uncut, so that the edge of a cut is as sharp as the
///    label map. Pelvis and contralateral femur are never overwritten.
///
/// Everything else keeps the intensity of the CT. Voxels are drawn in ascending order of memory, so
/// the result depends on nothing but the inputs.
///
/// # Panics
/// When `labels` is not on the CT's grid.
pub fn moved_attenuation(
    hip: &Hip,
    labels: &Volume<u8>,
    fragment: &Rigid,
    femur: &Rigid,
    parameters: &WarpParameters,
    attenuation: &AttenuationParameters,
    stream: &mut Stream,
) -> MovedAnatomy {
    let ct = &hip.specimen.ct;
    assert_eq!(ct.grid, labels.grid, "the labels lie on the CT's grid");
    let femur_label = Label::femur(hip.side);
    let fixed = [Label::Pelvis, Label::femur(hip.side.opposite())].map(Label::value);
    let [fragment_voxels, femur_voxels, cut_voxels] =
        offsets_of(labels, [Label::Fragment, femur_label, Label::Cut]);

    let mut volume = Volume::new(
        ct.grid.clone(),
        ct.data
            .par_iter()
            .map(|&hu| attenuation.mu(f32::from(hu)))
            .collect(),
    );
    let mut occupied = vec![false; volume.data.len()];
    let mut overlap_voxels = 0;
    let mut moved = Vec::new();
    for (label, movement, voxels) in [
        (Label::Fragment, fragment, &fragment_voxels),
        (femur_label, femur, &femur_voxels),
    ] {
        let world_motion = hip.app_from_volume.inverse() * movement * hip.app_from_volume;
        for (offset, hu) in moved_voxels(ct, labels, label, voxels, &world_motion) {
            if fixed.contains(&labels.data[offset]) {
                overlap_voxels += 1;
            } else {
                occupied[offset] = true;
                moved.push((offset, attenuation.mu(hu)));
            }
        }
    }

    let [low, high] = parameters.muscle_mean_hu;
    let muscle_mean_hu = low + (high - low) * stream.random::<f64>();
    let mut noisy = |mean: f64, sd: f64| {
        let normal: f64 = StandardNormal.sample(stream);
        attenuation.mu((mean + sd * normal) as f32)
    };
    for offset in cut_voxels {
        volume.data[offset] = noisy(parameters.air_mean_hu, parameters.air_sd_hu);
    }
    for offset in fragment_voxels.into_iter().chain(femur_voxels) {
        if !occupied[offset] {
            volume.data[offset] = noisy(muscle_mean_hu, parameters.muscle_sd_hu);
        }
    }
    for (offset, mu) in moved {
        volume.data[offset] = mu;
    }
    MovedAnatomy {
        attenuation: volume,
        muscle_mean_hu,
        overlap_voxels,
    }
}

/// Memory offsets, ascending, of the voxels of each of three labels.
fn offsets_of(labels: &Volume<u8>, wanted: [Label; 3]) -> [Vec<usize>; 3] {
    let slice = labels.grid.dims[0] * labels.grid.dims[1];
    let wanted = wanted.map(Label::value);
    let found: Vec<[Vec<usize>; 3]> = labels
        .data
        .par_chunks(slice.max(1))
        .enumerate()
        .map(|(k, values)| {
            let mut offsets = [const { Vec::new() }; 3];
            for (i, value) in values.iter().enumerate() {
                if let Some(which) = wanted.iter().position(|w| w == value) {
                    offsets[which].push(k * slice + i);
                }
            }
            offsets
        })
        .collect();
    std::array::from_fn(|which| {
        let parts: Vec<&[usize]> = found.iter().map(|part| part[which].as_slice()).collect();
        parts.concat()
    })
}

/// The voxels that `label` covers once `motion` (of the world) has moved it, with their intensities
/// (HU): memory offsets, ascending. `voxels` are those it covers before.
fn moved_voxels(
    ct: &Volume<i16>,
    labels: &Volume<u8>,
    label: Label,
    voxels: &[usize],
    motion: &Rigid,
) -> Vec<(usize, f32)> {
    let grid = &ct.grid;
    let Some((min, max)) = moved_box(grid, voxels, motion) else {
        return Vec::new();
    };
    let back = grid.index_from_world()
        * nalgebra::convert::<Rigid, nalgebra::Affine3<f64>>(motion.inverse())
        * grid.world_from_index();
    let back: Matrix3x4<f64> = back.matrix().fixed_view::<3, 4>(0, 0).into_owned();
    let slices: Vec<Vec<(usize, f32)>> = (min[2]..=max[2])
        .into_par_iter()
        .map(|k| {
            let mut found = Vec::new();
            for j in min[1]..=max[1] {
                for i in min[0]..=max[0] {
                    let source = back * Vector4::new(i as f64, j as f64, k as f64, 1.0);
                    if nearest(labels, &source) == Some(label.value()) {
                        found.push((grid.offset(i, j, k), cubic(ct, &source)));
                    }
                }
            }
            found
        })
        .collect();
    slices.concat()
}

/// The box of voxels (both ends included) that can hold the moved voxels, or `None` when there are
/// none or all of them leave the grid.
fn moved_box(grid: &Grid, voxels: &[usize], motion: &Rigid) -> Option<([usize; 3], [usize; 3])> {
    let (mut low, mut high) = ([usize::MAX; 3], [0; 3]);
    for &offset in voxels {
        let voxel = grid.voxel(offset);
        for axis in 0..3 {
            low[axis] = low[axis].min(voxel[axis]);
            high[axis] = high[axis].max(voxel[axis]);
        }
    }
    if low[0] == usize::MAX {
        return None;
    }
    let (mut min, mut max) = (Vector::repeat(f64::MAX), Vector::repeat(f64::MIN));
    for corner in 0..8 {
        let end = |axis: usize| match corner >> axis & 1 {
            0 => low[axis] as f64,
            _ => high[axis] as f64,
        };
        let moved = grid.index(&(motion * grid.point(end(0), end(1), end(2))));
        min = min.inf(&moved);
        max = max.sup(&moved);
    }
    // A voxel belongs to the bone when it comes back within half a voxel of one of its centres.
    let (mut first, mut last) = ([0; 3], [0; 3]);
    for axis in 0..3 {
        let end = grid.dims[axis] as f64 - 1.0;
        let (from, to) = (min[axis].floor() - 1.0, max[axis].ceil() + 1.0);
        if to < 0.0 || from > end {
            return None;
        }
        first[axis] = from.max(0.0) as usize;
        last[axis] = to.min(end) as usize;
    }
    Some((first, last))
}

/// The value of the voxel nearest to a continuous index, or `None` outside.
fn nearest(labels: &Volume<u8>, index: &Vector) -> Option<u8> {
    let mut voxel = [0; 3];
    for axis in 0..3 {
        let rounded = (index[axis] + 0.5).floor();
        if !(rounded >= 0.0 && rounded < labels.grid.dims[axis] as f64) {
            return None;
        }
        voxel[axis] = rounded as usize;
    }
    Some(labels.at(voxel[0], voxel[1], voxel[2]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Side;
    use crate::geometry::Point;
    use crate::random::{Purpose, stream};
    use crate::simulation::testing;

    const DIMS: [usize; 3] = [60, 50, 40];

    /// Blocks of bone around the left femoral head at world (88, -10, 0): a pelvis block with a
    /// fragment below it, a cut of one voxel between the two, a femur lateral, the other femur far
    /// away. Intensities in bone are linear in the voxel's index, soft tissue is 20 HU.
    fn blocks() -> (Hip, Volume<u8>) {
        let rotation = nalgebra::Rotation3::from_euler_angles(0.2, -0.1, 0.3);
        let grid = Grid {
            dims: DIMS,
            spacing: [1.0; 3],
            origin: Point::new(70.0, -30.0, -20.0),
            direction: *rotation.matrix(),
        };
        let mut labels = Volume::filled(grid.clone(), 0);
        let mut fill = |label: Label, from: [usize; 3], to: [usize; 3]| {
            for k in from[2]..to[2] {
                for j in from[1]..to[1] {
                    for i in from[0]..to[0] {
                        let offset = labels.grid.offset(i, j, k);
                        labels.data[offset] = label.value();
                    }
                }
            }
        };
        fill(Label::Pelvis, [10, 10, 30], [30, 35, 38]);
        fill(Label::Cut, [10, 10, 25], [30, 35, 26]);
        fill(Label::Fragment, [10, 10, 12], [30, 35, 25]);
        fill(Label::FemurLeft, [36, 10, 12], [48, 35, 25]);
        fill(Label::FemurRight, [2, 2, 2], [6, 45, 8]);
        let ct = (0..grid.len())
            .map(|offset| match labels.data[offset] {
                0 => 20,
                _ => bone(&grid.voxel(offset)),
            })
            .collect();
        let hip = testing::hip_with(Side::Left, Volume::new(grid, ct), labels.clone());
        (hip, labels)
    }

    fn bone(voxel: &[usize; 3]) -> i16 {
        500 + 7 * voxel[0] as i16 + 3 * voxel[1] as i16 + 11 * voxel[2] as i16
    }

    fn mu(hu: f32) -> f32 {
        AttenuationParameters::default().mu(hu)
    }

    /// A movement in the APP that moves the grid by whole voxels.
    fn by_voxels(hip: &Hip, voxels: Vector) -> Rigid {
        let in_world = hip.specimen.ct.grid.direction * voxels;
        let motion = Rigid::translation(in_world.x, in_world.y, in_world.z);
        hip.app_from_volume * motion * hip.app_from_volume.inverse()
    }

    fn warp(hip: &Hip, labels: &Volume<u8>, fragment: &Rigid, femur: &Rigid) -> MovedAnatomy {
        moved_attenuation(
            hip,
            labels,
            fragment,
            femur,
            &WarpParameters::default(),
            &AttenuationParameters::default(),
            &mut stream(5, Purpose::MuscleFill, "test"),
        )
    }

    #[test]
    fn without_movement_only_the_cut_changes() {
        let (hip, labels) = blocks();
        let still = Rigid::identity();
        let result = warp(&hip, &labels, &still, &still);
        assert_eq!(result.overlap_voxels, 0);
        for (offset, &value) in result.attenuation.data.iter().enumerate() {
            let expected = match labels.data[offset] {
                v if v == Label::Cut.value() => 0.0,
                _ => mu(f32::from(hip.specimen.ct.data[offset])),
            };
            assert!((value - expected).abs() < 1e-7, "{offset}");
        }
    }

    #[test]
    fn a_shift_by_whole_voxels_carries_the_bone_and_leaves_muscle() {
        let (hip, labels) = blocks();
        // The fragment moves through the cut by 3 voxels, the femur by 8 into where the fragment
        // was not.
        let fragment = by_voxels(&hip, Vector::new(0.0, 0.0, 3.0));
        let femur = by_voxels(&hip, Vector::new(8.0, -2.0, 0.0));
        let result = warp(&hip, &labels, &fragment, &femur);
        assert_eq!(result.overlap_voxels, 0);
        assert!((35.0..55.0).contains(&result.muscle_mean_hu));
        let mut muscle = Vec::new();
        for (offset, &value) in result.attenuation.data.iter().enumerate() {
            let [i, j, k] = labels.grid.voxel(offset);
            let from = |label: Label, i: usize, j: usize, k: usize| {
                (i < DIMS[0] && j < DIMS[1] && k < DIMS[2] && labels.at(i, j, k) == label.value())
                    .then(|| f32::from(bone(&[i, j, k])))
            };
            let arrived = from(Label::FemurLeft, i.wrapping_sub(8), j + 2, k).or(from(
                Label::Fragment,
                i,
                j,
                k.wrapping_sub(3),
            ));
            let own = labels.data[offset];
            if let Some(hu) = arrived {
                // Interpolation in whole voxels returns the voxel, up to rounding.
                assert!((value - mu(hu)).abs() < 1e-6, "bone at {i} {j} {k}");
            } else if own == Label::Cut.value() {
                assert_eq!(value, 0.0);
            } else if own == Label::Fragment.value() || own == Label::FemurLeft.value() {
                muscle.push(f64::from(value) / 2.68275e-5 - 130.0);
            } else {
                assert_eq!(value, mu(f32::from(hip.specimen.ct.data[offset])));
            }
        }
        // Three layers of the fragment and 8 x 25 + 2 x 4 columns of the femur were left.
        assert_eq!(muscle.len(), 3 * 20 * 25 + (8 * 25 + 2 * 4) * 13);
        let n = muscle.len() as f64;
        let mean = muscle.iter().sum::<f64>() / n;
        let sd = (muscle.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / n).sqrt();
        assert!(
            (mean - result.muscle_mean_hu).abs() < 5.0 * 20.0 / n.sqrt(),
            "{mean}"
        );
        assert!((sd - 20.0).abs() < 5.0 * 20.0 / (2.0 * n).sqrt(), "{sd}");
    }

    #[test]
    fn a_turned_bone_has_the_intensity_of_where_it_came_from() {
        let (hip, labels) = blocks();
        let grid = &labels.grid;
        let movement = Rigid::new(Vector::new(1.3, -0.7, 2.1), Vector::new(0.1, -0.06, 0.15));
        let still = Rigid::identity();
        let result = warp(&hip, &labels, &movement, &still);
        let world = hip.app_from_volume.inverse() * movement * hip.app_from_volume;
        let mut checked = 0;
        for offset in 0..grid.len() {
            let source = grid.index(&(world.inverse() * grid.center(grid.voxel(offset))));
            // Well inside the fragment, where all 64 voxels of the spline are bone.
            let inside = (0..3).all(|a| {
                let (from, to) = ([10.0, 10.0, 12.0][a], [29.0, 34.0, 24.0][a]);
                source[a] >= from + 1.0 && source[a] <= to - 1.0
            });
            let own = labels.data[offset];
            let fixed = own == Label::Pelvis.value() || own == Label::FemurLeft.value();
            if inside && !fixed {
                let hu = 500.0 + 7.0 * source.x + 3.0 * source.y + 11.0 * source.z;
                let error = result.attenuation.data[offset] - mu(hu as f32);
                assert!(error.abs() < 1e-6, "{offset}: {error}");
                checked += 1;
            }
        }
        assert!(checked > 3000, "{checked}");
    }

    #[test]
    fn pelvis_and_the_other_femur_stay_and_overlaps_are_counted() {
        let (hip, labels) = blocks();
        let fragment = by_voxels(&hip, Vector::new(0.0, 0.0, 7.0));
        let result = warp(&hip, &labels, &fragment, &Rigid::identity());
        // The top two layers of the moved fragment fall into the pelvis.
        assert_eq!(result.overlap_voxels, 2 * 20 * 25);
        for (offset, &label) in labels.data.iter().enumerate() {
            if label == Label::Pelvis.value() || label == Label::FemurRight.value() {
                let expected = mu(f32::from(hip.specimen.ct.data[offset]));
                assert_eq!(result.attenuation.data[offset], expected);
            }
        }
    }

    #[test]
    fn bone_that_moves_into_a_vacated_place_is_not_muscle() {
        let (hip, labels) = blocks();
        // The femur moves into where the fragment was; the fragment leaves the grid.
        let fragment = by_voxels(&hip, Vector::new(0.0, 0.0, -80.0));
        let femur = by_voxels(&hip, Vector::new(-20.0, 0.0, 0.0));
        let result = warp(&hip, &labels, &fragment, &femur);
        for (offset, &value) in result.attenuation.data.iter().enumerate() {
            let [i, j, k] = labels.grid.voxel(offset);
            if (16..28).contains(&i) && (10..35).contains(&j) && (12..25).contains(&k) {
                assert!((value - mu(f32::from(bone(&[i + 20, j, k])))).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn threads_change_nothing() {
        let (hip, labels) = blocks();
        let movement = Rigid::new(Vector::new(1.0, 2.0, 1.0), Vector::new(0.1, 0.2, 0.0));
        let one = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        let a = one.install(|| warp(&hip, &labels, &movement, &movement));
        let b = warp(&hip, &labels, &movement, &movement);
        assert_eq!(a.attenuation, b.attenuation);
        assert_eq!(a.muscle_mean_hu, b.muscle_mean_hu);
    }
}

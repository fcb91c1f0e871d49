//! The fragment that four cuts free: the label map of the paper's section "Preoperative Processing
//! and Planning".

use super::ranges::out_of_range;
use super::{Cut, CutPlanes};
use crate::anatomy::{Hip, Label, Landmark, frame::FrameError};
use crate::geometry::{Plane, Point, Vector};
use crate::volume::components::components;
use crate::volume::{Grid, Volume};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How cuts become a label map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FragmentParameters {
    /// Width of the virtual chisel in mm: bone of the fragment's side less than this from a cut
    /// plane is removed. 1 in the paper; 0 removes nothing.
    pub chisel_width_mm: f64,
    /// Distance in mm from the femoral head's centre, laterally, of the sagittal plane that closes
    /// the hull of the cuts there. It has to lie lateral of all bone below the ilium cut.
    pub lateral_limit_mm: f64,
}

impl Default for FragmentParameters {
    fn default() -> Self {
        Self {
            chisel_width_mm: 1.0,
            lateral_limit_mm: 80.0,
        }
    }
}

impl FragmentParameters {
    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        out_of_range(&[
            ("chisel_width_mm", self.chisel_width_mm, 0.0..=10.0, " mm"),
            (
                "lateral_limit_mm",
                self.lateral_limit_mm,
                30.0..=300.0,
                " mm",
            ),
        ])
    }
}

/// Why cuts give no fragment.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FragmentError {
    #[error(transparent)]
    Frame(#[from] FrameError),
    #[error(
        "the {} cut leaves the femoral head outside of the fragment (signed distance {distance_mm:.1} mm, expected below 0); turn its normal out of the fragment or move it off the acetabulum",
        .cut.name()
    )]
    HeadOutside { cut: Cut, distance_mm: f64 },
    #[error(
        "no pelvis voxel of {hip} lies inside the cuts; check that the planes are in this hip's APP and that the label map holds the pelvis as 1"
    )]
    NoBone { hip: String },
    #[error(
        "the chisel of {chisel_width_mm} mm removes all {voxels} voxels between the cuts of {hip}; move the cuts apart"
    )]
    NothingLeft {
        hip: String,
        voxels: usize,
        chisel_width_mm: f64,
    },
    #[error(
        "the {} cut of {hip} does not touch the fragment, so it has no middle to turn about; move it onto the bone",
        .cut.name()
    )]
    CutMissesBone { hip: String, cut: Cut },
}

/// The voxels that a surgery changes: enough to rebuild its label map, at a hundredth of the size.
#[derive(Clone, Debug, PartialEq)]
pub struct Carving {
    /// Memory offsets, ascending, of the voxels that become [`Label::Fragment`].
    pub fragment: Vec<usize>,
    /// Memory offsets, ascending, of the voxels that become [`Label::Cut`].
    pub cut: Vec<usize>,
    /// The smallest box of voxels (min, max, both included) that holds all of them.
    pub bounds: ([usize; 3], [usize; 3]),
}

/// A specimen's label map after the osteotomies.
#[derive(Clone, Debug, PartialEq)]
pub struct SurgeryMap {
    /// [`Label`] values on the specimen's whole grid, fragment and cut included. One byte a voxel
    /// (35 MB for a whole pelvis at 1 mm): keep a [`Carving`] where many are kept.
    pub labels: Volume<u8>,
    /// The cuts that made it.
    pub cuts: CutPlanes,
    /// Number of voxels of [`Label::Fragment`].
    pub fragment_voxels: usize,
    /// Number of voxels of [`Label::Cut`].
    pub cut_voxels: usize,
    /// The smallest box of voxels (min, max, both included) that holds fragment and cut; outside of
    /// it the map is the specimen's own.
    pub bounds: ([usize; 3], [usize; 3]),
}

impl SurgeryMap {
    /// Volume of the fragment in cm^3, without the cuts.
    pub fn fragment_cm3(&self) -> f64 {
        self.fragment_voxels as f64 * self.labels.grid.spacing.iter().product::<f64>() / 1000.0
    }
}

impl Carving {
    /// The fragment (without the cuts) as a mask on the box [`Carving::bounds`] of the specimen's
    /// grid.
    pub fn fragment_mask(&self, grid: &Grid) -> Volume<bool> {
        mask_of(grid, self.bounds, &self.fragment)
    }

    /// The label map: a copy of the specimen's with the carved voxels set.
    pub fn into_map(self, hip: &Hip, cuts: &CutPlanes) -> SurgeryMap {
        let mut labels = hip.specimen.labels.clone();
        for &offset in &self.fragment {
            labels.data[offset] = Label::Fragment.value();
        }
        for &offset in &self.cut {
            labels.data[offset] = Label::Cut.value();
        }
        SurgeryMap {
            labels,
            cuts: *cuts,
            fragment_voxels: self.fragment.len(),
            cut_voxels: self.cut.len(),
            bounds: self.bounds,
        }
    }
}

/// The label map that `cuts` make of the hip's specimen (facts 2.13).
///
/// Pelvis voxels whose centres lie inside the hull of the four cuts, the mid-sagittal plane and a
/// lateral one are candidates. Their largest 6-connected component stays, the others revert to
/// pelvis. Of what stays, voxels less than the chisel's width from a cut plane become
/// [`Label::Cut`] and the rest [`Label::Fragment`]: the chisel takes bone of the fragment's side
/// only. It does not act along the two helper planes, which are no cuts.
///
/// # Errors
/// When a cut has the femoral head on its outer side, when a landmark of the frame is missing, or
/// when no bone is left between the cuts.
pub fn cut_fragment(
    hip: &Hip,
    cuts: &CutPlanes,
    parameters: &FragmentParameters,
) -> Result<SurgeryMap, FragmentError> {
    Ok(carve(hip, cuts, parameters)?.into_map(hip, cuts))
}

/// As [`cut_fragment`], but gives the changed voxels only.
///
/// # Errors
/// As [`cut_fragment`].
pub fn carve(
    hip: &Hip,
    cuts: &CutPlanes,
    parameters: &FragmentParameters,
) -> Result<Carving, FragmentError> {
    for cut in Cut::ALL {
        let distance_mm = cuts.get(cut).signed_distance(&Point::origin());
        if distance_mm >= 0.0 {
            return Err(FragmentError::HeadOutside { cut, distance_mm });
        }
    }
    let labels = &hip.specimen.labels;
    let volume_from_app = hip.app_from_volume.inverse();
    let in_index = |plane: &Plane| {
        IndexPlane::new(
            &plane.transformed(&volume_from_app),
            &hip.specimen.labels.grid,
        )
    };
    let chiselled = Cut::ALL.map(|cut| in_index(cuts.get(cut)));
    let [medial, lateral] = helper_planes(hip, parameters)?.map(|plane| in_index(&plane));
    let hull: Vec<IndexPlane> = chiselled.iter().copied().chain([medial, lateral]).collect();
    let candidates = candidates(labels, &hull);
    if candidates.is_empty() {
        return Err(FragmentError::NoBone { hip: hip.key() });
    }
    let kept = largest_of(&labels.grid, &candidates);
    let (cut, fragment): (Vec<usize>, Vec<usize>) = kept.iter().partition(|&&offset| {
        let [i, j, k] = labels.grid.voxel(offset);
        chiselled
            .iter()
            .any(|plane| plane.distance(i, j, k) > ON_PLANE_MM - parameters.chisel_width_mm)
    });
    if fragment.is_empty() {
        return Err(FragmentError::NothingLeft {
            hip: hip.key(),
            voxels: kept.len(),
            chisel_width_mm: parameters.chisel_width_mm,
        });
    }
    Ok(Carving {
        bounds: bounds_of(&labels.grid, &kept),
        fragment,
        cut,
    })
}

/// The APP's x of the mid-sagittal plane, which passes through the middle of both ASIS.
pub(super) fn midline(hip: &Hip) -> Result<f64, FrameError> {
    let other_side = hip.side.opposite();
    let own = hip.landmark(Landmark::Asis)?;
    let other = hip.specimen.landmarks.get(Landmark::Asis, other_side);
    let other = other.ok_or_else(|| FrameError::Missing(Landmark::Asis.key(other_side)))?;
    Ok((hip.app_from_volume * nalgebra::center(&own, &other)).x)
}

/// The mid-sagittal plane and the lateral one, in the APP, normals out of the hull.
pub(super) fn helper_planes(
    hip: &Hip,
    parameters: &FragmentParameters,
) -> Result<[Plane; 2], FrameError> {
    let lateral = hip.lateral();
    let medial = Plane::through(&Point::new(midline(hip)?, 0.0, 0.0), &-lateral);
    let outermost = Point::from(lateral * parameters.lateral_limit_mm);
    Ok([medial, Plane::through(&outermost, &lateral)])
}

/// Room for rounding in mm: a centre on a plane lies inside it, and one that is exactly the
/// chisel's width inside is not removed.
const ON_PLANE_MM: f64 = 1e-6;

/// A plane's signed distance in mm as a linear function of the voxel index.
#[derive(Clone, Copy)]
struct IndexPlane {
    per_voxel: Vector,
    at_origin: f64,
}

impl IndexPlane {
    fn new(plane: &Plane, grid: &Grid) -> Self {
        let along = grid.direction.transpose() * plane.normal;
        Self {
            per_voxel: along.component_mul(&Vector::from(grid.spacing)),
            at_origin: plane.signed_distance(&grid.origin),
        }
    }

    fn distance(&self, i: usize, j: usize, k: usize) -> f64 {
        self.at_origin
            + self.per_voxel.x * i as f64
            + self.per_voxel.y * j as f64
            + self.per_voxel.z * k as f64
    }

    /// A range of i that holds every voxel of row (j, k) inside the plane, and at most one voxel
    /// more at its ends.
    fn inner_range(&self, j: usize, k: usize, length: usize) -> (usize, usize) {
        let slope = self.per_voxel.x;
        let start = self.distance(0, j, k) - ON_PLANE_MM;
        let crossing = -start / slope;
        let last = length as f64;
        if !crossing.is_finite() {
            return if start < 0.0 { (0, length) } else { (0, 0) };
        }
        if slope > 0.0 {
            (0, (crossing.ceil() + 1.0).clamp(0.0, last) as usize)
        } else {
            ((crossing.floor() - 1.0).clamp(0.0, last) as usize, length)
        }
    }
}

/// Memory offsets, ascending, of the pelvis voxels inside all planes. Only the part of each row that
/// can lie inside is looked at.
fn candidates(labels: &Volume<u8>, hull: &[IndexPlane]) -> Vec<usize> {
    let [ni, nj, nk] = labels.grid.dims;
    let slices: Vec<Vec<usize>> = (0..nk)
        .into_par_iter()
        .map(|k| {
            let mut found = Vec::new();
            for j in 0..nj {
                let (mut from, mut to) = (0, ni);
                for plane in hull {
                    let (a, b) = plane.inner_range(j, k, ni);
                    (from, to) = (from.max(a), to.min(b));
                }
                for i in from..to {
                    let offset = labels.grid.offset(i, j, k);
                    if labels.data[offset] == Label::Pelvis.value()
                        && hull.iter().all(|p| p.distance(i, j, k) < ON_PLANE_MM)
                    {
                        found.push(offset);
                    }
                }
            }
            found
        })
        .collect();
    slices.concat()
}

/// The voxels of the largest 6-connected component, ascending.
fn largest_of(grid: &Grid, candidates: &[usize]) -> Vec<usize> {
    let bounds = bounds_of(grid, candidates);
    let all = components(&mask_of(grid, bounds, candidates));
    let largest = all.largest();
    let number = |offset| Some(all.labels.data[place_in(grid, bounds, offset)]);
    candidates
        .iter()
        .copied()
        .filter(|&offset| number(offset) == largest)
        .collect()
}

/// A mask on a box (min, max, both included) of `grid` that is true at `offsets`.
fn mask_of(grid: &Grid, bounds: ([usize; 3], [usize; 3]), offsets: &[usize]) -> Volume<bool> {
    let mut mask = Volume::filled(grid.cropped(bounds.0, bounds.1), false);
    for &offset in offsets {
        mask.data[place_in(grid, bounds, offset)] = true;
    }
    mask
}

/// Where a voxel of `grid` lies in the memory of a box of it.
fn place_in(grid: &Grid, (min, max): ([usize; 3], [usize; 3]), offset: usize) -> usize {
    let [i, j, k] = grid.voxel(offset);
    let (ni, nj) = (max[0] - min[0] + 1, max[1] - min[1] + 1);
    ((k - min[2]) * nj + (j - min[1])) * ni + (i - min[0])
}

/// The smallest box that holds all of `offsets`, which must not be empty.
fn bounds_of(grid: &Grid, offsets: &[usize]) -> ([usize; 3], [usize; 3]) {
    let (mut min, mut max) = ([usize::MAX; 3], [0; 3]);
    for &offset in offsets {
        let voxel = grid.voxel(offset);
        for axis in 0..3 {
            min[axis] = min[axis].min(voxel[axis]);
            max[axis] = max[axis].max(voxel[axis]);
        }
    }
    (min, max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::{Landmarks, Side, Source, Specimen};
    use crate::geometry::Rigid;
    use nalgebra::Matrix3;
    use std::sync::Arc;

    /// A block of bone, labels given by a rule on APP coordinates. The APP's axes are those of the
    /// world (LPS: x left, y posterior, z superior) as x, z, -y, with the head at the world's
    /// origin, which is a voxel's centre.
    fn block(side: Side, label: impl Fn(&Point) -> u8) -> Hip {
        let grid = Grid {
            dims: [161, 121, 121],
            spacing: [1.0; 3],
            origin: Point::new(-80.0, -60.0, -60.0),
            direction: Matrix3::identity(),
        };
        let mut landmarks = Landmarks::default();
        let s = side.lateral_sign();
        let middle = -70.0 * s;
        for other in Side::BOTH {
            let x = middle + 100.0 * other.lateral_sign();
            landmarks.set(Landmark::Asis, other, Point::new(x, -30.0, 80.0));
            landmarks.set(Landmark::Ips, other, Point::new(middle, -30.0, -50.0));
        }
        landmarks.set(Landmark::Fh, side, Point::origin());
        let mut labels = Volume::filled(grid.clone(), 0);
        for offset in 0..labels.data.len() {
            let p = grid.center(grid.voxel(offset));
            labels.data[offset] = label(&Point::new(p.x, p.z, -p.y));
        }
        let specimen = Specimen {
            name: "block".into(),
            source: Source {
                kind: "test".into(),
                description: String::new(),
                licence: "none".into(),
                sex: "unknown".into(),
                assigned_density: true,
            },
            ct: Volume::filled(grid, 0),
            labels,
            landmarks,
            rims: Default::default(),
        };
        Hip::new(Arc::new(specimen), side).unwrap()
    }

    /// Axis-aligned cuts at the given distances from the head.
    fn box_cuts(side: Side, ilium: f64, ischium: f64, posterior: f64, pubis: f64) -> CutPlanes {
        let plane = |normal: Vector, distance| Plane {
            normal,
            offset_mm: distance,
        };
        CutPlanes::new([
            plane(Vector::y(), ilium),
            plane(-Vector::y(), ischium),
            plane(-Vector::z(), posterior),
            plane(-Vector::x() * side.lateral_sign(), pubis),
        ])
    }

    /// Bone within 30 mm laterally and in front, endless elsewhere.
    fn in_reach(p: &Point, side: Side) -> u8 {
        u8::from(p.x * side.lateral_sign() <= 30.0 && p.z <= 30.0)
    }

    #[test]
    fn a_block_cut_by_planes_has_the_expected_voxels() {
        for side in Side::BOTH {
            let hip = block(side, |p| in_reach(p, side));
            let cuts = box_cuts(side, 20.0, 15.0, 10.0, 25.0);
            let map = cut_fragment(&hip, &cuts, &FragmentParameters::default()).unwrap();
            // Candidates have centres from -25 to 30, -15 to 20 and -10 to 30 mm: 56 x 36 x 41.
            // The chisel takes the centres ON each plane (distance 0 > -1), and not those 1 mm
            // inside.
            assert_eq!(map.fragment_voxels, 55 * 34 * 40, "{side}");
            assert_eq!(map.cut_voxels, 56 * 36 * 41 - 55 * 34 * 40, "{side}");
            let count = |label: Label| {
                map.labels
                    .data
                    .iter()
                    .filter(|&&v| v == label.value())
                    .count()
            };
            assert_eq!(count(Label::Fragment), map.fragment_voxels);
            assert_eq!(count(Label::Cut), map.cut_voxels);
            assert_eq!(
                Some(map.bounds),
                map.labels
                    .bounds(|v| v == Label::Fragment.value() || v == Label::Cut.value())
            );
            assert!((map.fragment_cm3() - 74.8).abs() < 1e-9);
        }
    }

    #[test]
    fn the_chisel_takes_bone_of_the_fragments_side_only() {
        let side = Side::Left;
        let hip = block(side, |p| in_reach(p, side));
        let cuts = box_cuts(side, 20.25, 15.25, 10.25, 25.25);
        let map = cut_fragment(
            &hip,
            &cuts,
            &FragmentParameters {
                chisel_width_mm: 2.5,
                ..Default::default()
            },
        )
        .unwrap();
        let app = |superior: f64| {
            Point::from(hip.app_from_volume.inverse() * Point::new(0.0, superior, 0.0))
        };
        let at = |superior| map.labels.nearest(&app(superior)).unwrap();
        assert_eq!(at(21.0), Label::Pelvis.value());
        assert_eq!(at(20.0), Label::Cut.value());
        assert_eq!(at(18.0), Label::Cut.value());
        assert_eq!(at(17.0), Label::Fragment.value());
    }

    #[test]
    fn smaller_pieces_between_the_cuts_revert_to_pelvis() {
        let side = Side::Right;
        // A second piece, lateral of the first, that touches it along an edge only.
        let hip = block(side, |p| {
            let x = -p.x;
            u8::from(
                x <= 20.0 && p.z <= 20.0
                    || (21.0..=25.0).contains(&x) && (21.0..=25.0).contains(&p.z),
            )
        });
        let cuts = box_cuts(side, 20.0, 15.0, 10.0, 25.0);
        let map = cut_fragment(&hip, &cuts, &FragmentParameters::default()).unwrap();
        assert_eq!(map.fragment_voxels, 45 * 34 * 30);
        let piece = hip.app_from_volume.inverse() * Point::new(-23.0, 0.0, 23.0);
        assert_eq!(map.labels.nearest(&piece), Some(Label::Pelvis.value()));
    }

    #[test]
    fn the_hull_ends_at_the_helper_planes_without_a_kerf() {
        let side = Side::Left;
        let hip = block(side, |_| 1);
        // The pubis cut lies beyond the mid-sagittal plane, 70 mm medial of the head.
        let cuts = box_cuts(side, 20.0, 15.0, 10.0, 75.0);
        let parameters = FragmentParameters {
            lateral_limit_mm: 40.0,
            ..Default::default()
        };
        let map = cut_fragment(&hip, &cuts, &parameters).unwrap();
        assert_eq!(map.fragment_voxels, 111 * 34 * (60 + 10));
    }

    #[test]
    fn an_oblique_grid_gives_the_label_of_each_centre() {
        // The whole world is moved; the APP moves with it, and so do the cuts.
        let side = Side::Left;
        let still = block(side, |p| in_reach(p, side));
        let motion = Rigid::new(Vector::new(11.0, -7.0, 5.0), Vector::new(0.2, -0.5, 0.4));
        let mut specimen = (*still.specimen).clone();
        specimen.labels.grid.origin = motion * specimen.labels.grid.origin;
        specimen.labels.grid.direction =
            motion.rotation.to_rotation_matrix().matrix() * specimen.labels.grid.direction;
        let mut landmarks = Landmarks::default();
        for (landmark, side, point) in still.specimen.landmarks.iter() {
            landmarks.set(landmark, side, motion * point);
        }
        specimen.landmarks = landmarks;
        let moved = Hip::new(Arc::new(specimen), side).unwrap();
        // No centre lies within rounding of a plane or of the chisel's edge.
        let tilted = Plane::through(&Point::new(0.0, 20.3, 0.0), &Vector::new(0.31, 1.0, -0.23));
        let cuts = box_cuts(side, 20.3, 15.3, 10.3, 25.3).with(Cut::Ilium, tilted);
        let parameters = FragmentParameters::default();
        let a = carve(&still, &cuts, &parameters).unwrap();
        let b = carve(&moved, &cuts, &parameters).unwrap();
        assert_eq!(a, b);
    }

    #[test]
    fn impossible_cuts_are_refused_with_their_reason() {
        let side = Side::Left;
        let parameters = FragmentParameters::default();
        let bone = block(side, |_| 1);
        let flipped = box_cuts(side, 20.0, 15.0, 10.0, -3.0);
        let error = carve(&bone, &flipped, &parameters).unwrap_err();
        assert!(
            error.to_string().starts_with("the pubis cut leaves"),
            "{error}"
        );
        let cuts = box_cuts(side, 20.0, 15.0, 10.0, 25.0);
        let empty = block(side, |_| 0);
        assert!(matches!(
            carve(&empty, &cuts, &parameters),
            Err(FragmentError::NoBone { .. })
        ));
        let slabs = box_cuts(side, 0.4, 0.4, 0.4, 25.0);
        assert!(matches!(
            carve(&bone, &slabs, &parameters),
            Err(FragmentError::NothingLeft { .. })
        ));
    }
}

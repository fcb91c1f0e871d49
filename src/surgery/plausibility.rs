//! Which cuts make a plausible fragment: the rules that stand for the paper's "manually verified"
//! (DESIGN section 3).

use super::acetabulum::Acetabulum;
use super::fragment::{Carving, FragmentError, FragmentParameters, carve, helper_planes};
use super::posterior_column::column_holds;
use super::ranges::out_of_range;
use super::site::OsteotomySite;
use super::{Cut, CutPlanes};
use crate::anatomy::frame::FrameError;
use crate::anatomy::{Hip, Label, Landmark};
use crate::geometry::{Point, Vector};
use crate::volume::Volume;
use crate::volume::components::components;
use serde::{Deserialize, Serialize};

/// What a plausible fragment is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlausibilityParameters {
    /// Smallest distance in mm of each cut to the acetabular rim and the articular surface.
    pub clearance_mm: f64,
    /// Smallest volume of the fragment in cm^3.
    pub smallest_cm3: f64,
    /// Largest volume of the fragment in cm^3.
    pub largest_cm3: f64,
    /// Smallest part of the fragment's voxels that hang together: the chisel may leave crumbs in
    /// sharp corners.
    pub connected_fraction: f64,
    /// Smallest part of the articular surface that the fragment holds: single voxels of a label map
    /// may be loose.
    pub held_fraction: f64,
    /// Smallest thickness in mm of the bone that connects ischium and ilium behind the posterior
    /// cut.
    pub column_mm: f64,
}

impl Default for PlausibilityParameters {
    fn default() -> Self {
        Self {
            clearance_mm: 4.0,
            smallest_cm3: 30.0,
            largest_cm3: 160.0,
            connected_fraction: 0.99,
            held_fraction: 0.98,
            column_mm: 4.0,
        }
    }
}

impl PlausibilityParameters {
    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = out_of_range(&[
            ("clearance_mm", self.clearance_mm, 0.0..=20.0, " mm"),
            ("smallest_cm3", self.smallest_cm3, 0.0..=500.0, " cm^3"),
            ("largest_cm3", self.largest_cm3, 1.0..=1000.0, " cm^3"),
            ("connected_fraction", self.connected_fraction, 0.5..=1.0, ""),
            ("held_fraction", self.held_fraction, 0.5..=1.0, ""),
            ("column_mm", self.column_mm, 0.0..=20.0, " mm"),
        ]);
        if self.smallest_cm3 >= self.largest_cm3 {
            let message = format!(
                "is {} cm^3; expected less than largest_cm3, {} cm^3",
                self.smallest_cm3, self.largest_cm3
            );
            problems.push(("smallest_cm3".into(), message));
        }
        problems
    }
}

/// Why a fragment is not plausible: the first rule, in this order, that it breaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Rejection {
    /// A cut comes too close to the rim or the articular surface, or runs through the joint.
    TooClose(Cut),
    /// A landmark used for registration or planning lies inside the cuts. (AIIS and FH may: they
    /// belong to the fragment and to the femur. The paper's section "Preoperative Processing and
    /// Planning".)
    HoldsLandmark(Landmark),
    /// No bone is left between the cuts.
    NoBone,
    /// The volume is below the range.
    TooSmall,
    /// The volume is above the range.
    TooLarge,
    /// The fragment falls into pieces.
    InPieces,
    /// The fragment is not all of the joint: part of the rim or the articular surface is not in it.
    JointLost,
    /// The bone is not cut through: the fragment reaches the mid-sagittal or the lateral helper
    /// plane.
    NotFree,
    /// The posterior column behind the posterior cut no longer connects ischium and ilium.
    RingBroken,
}

impl std::fmt::Display for Rejection {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::TooClose(cut) => write!(f, "{} cut too close to the acetabulum", cut.name()),
            Self::HoldsLandmark(landmark) => write!(f, "holds {}", landmark.name()),
            Self::NoBone => f.write_str("no bone"),
            Self::TooSmall => f.write_str("too small"),
            Self::TooLarge => f.write_str("too large"),
            Self::InPieces => f.write_str("in pieces"),
            Self::JointLost => f.write_str("lacks part of the joint"),
            Self::NotFree => f.write_str("not cut free"),
            Self::RingBroken => f.write_str("pelvic ring broken"),
        }
    }
}

/// Landmarks that must stay on the main pelvis, as far as the specimen has them.
const KEPT_LANDMARKS: [Landmark; 6] = [
    Landmark::Asis,
    Landmark::Sps,
    Landmark::Ips,
    Landmark::Mof,
    Landmark::Iof,
    Landmark::Gsn,
];

/// Carves the fragment and holds it to the rules: the voxels of a plausible one, or the first rule
/// that it breaks.
///
/// # Errors
/// When an ASIS is missing (not when the fragment is implausible).
pub fn plausible_fragment(
    hip: &Hip,
    site: &OsteotomySite,
    cuts: &CutPlanes,
    fragment: &FragmentParameters,
    rules: &PlausibilityParameters,
) -> Result<Result<Carving, Rejection>, FrameError> {
    if let Some(rejection) = check_planes(hip, &site.acetabulum, cuts, rules) {
        return Ok(Err(rejection));
    }
    let carving = match carve_whole_joint(hip, &site.acetabulum, cuts, fragment, rules)? {
        Ok(carving) => carving,
        Err(rejection) => return Ok(Err(rejection)),
    };
    if !column_holds(hip, site, cuts, &carving, rules.column_mm)? {
        return Ok(Err(Rejection::RingBroken));
    }
    Ok(Ok(carving))
}

/// Carves the fragment of cuts of which some are estimated, and holds it to the rules that an
/// estimate can keep. It is off by a millimetre or two, so its cuts may come as close to the joint as
/// they like, but not run through it. Nor must landmarks lie outside: a true pubis cut and a planned
/// ischium cut may enclose IOF without freeing the bone there. The ring is the planned posterior
/// cut's matter.
///
/// # Errors
/// When an ASIS is missing (not when the fragment is implausible).
pub fn plausible_estimate(
    hip: &Hip,
    acetabulum: &Acetabulum,
    cuts: &CutPlanes,
    fragment: &FragmentParameters,
    rules: &PlausibilityParameters,
) -> Result<Result<Carving, Rejection>, FrameError> {
    if let Some(cut) = too_close(acetabulum, cuts, 0.0) {
        return Ok(Err(Rejection::TooClose(cut)));
    }
    carve_whole_joint(hip, acetabulum, cuts, fragment, rules)
}

/// Carves the fragment and holds it to the rules on the bone itself.
fn carve_whole_joint(
    hip: &Hip,
    acetabulum: &Acetabulum,
    cuts: &CutPlanes,
    fragment: &FragmentParameters,
    rules: &PlausibilityParameters,
) -> Result<Result<Carving, Rejection>, FrameError> {
    let carving = match carve(hip, cuts, fragment) {
        Ok(carving) => carving,
        Err(FragmentError::Frame(error)) => return Err(error),
        Err(FragmentError::HeadOutside { cut, .. } | FragmentError::CutMissesBone { cut, .. }) => {
            return Ok(Err(Rejection::TooClose(cut)));
        }
        Err(FragmentError::NoBone { .. } | FragmentError::NothingLeft { .. }) => {
            return Ok(Err(Rejection::NoBone));
        }
    };
    let rejection = check_bone(hip, acetabulum, &carving, fragment, rules)?;
    Ok(rejection.map_or(Ok(carving), Err))
}

/// A cut that comes closer to the rim or the articular surface than `clearance_mm`.
fn too_close(acetabulum: &Acetabulum, cuts: &CutPlanes, clearance_mm: f64) -> Option<Cut> {
    let close = |cut: &Cut| acetabulum.clearance_mm(cuts.get(*cut)) < clearance_mm;
    Cut::ALL.into_iter().find(close)
}

/// The rules that need the planes only.
fn check_planes(
    hip: &Hip,
    acetabulum: &Acetabulum,
    cuts: &CutPlanes,
    rules: &PlausibilityParameters,
) -> Option<Rejection> {
    if let Some(cut) = too_close(acetabulum, cuts, rules.clearance_mm) {
        return Some(Rejection::TooClose(cut));
    }
    for landmark in KEPT_LANDMARKS {
        let Some(p) = hip.specimen.landmarks.get(landmark, hip.side) else {
            continue;
        };
        let p = hip.app_from_volume * p;
        if Cut::ALL
            .iter()
            .all(|&cut| cuts.get(cut).signed_distance(&p) < 0.0)
        {
            return Some(Rejection::HoldsLandmark(landmark));
        }
    }
    None
}

/// The rules on the fragment itself.
fn check_bone(
    hip: &Hip,
    acetabulum: &Acetabulum,
    carving: &Carving,
    fragment: &FragmentParameters,
    rules: &PlausibilityParameters,
) -> Result<Option<Rejection>, FrameError> {
    let grid = &hip.specimen.labels.grid;
    let voxel_cm3 = grid.spacing.iter().product::<f64>() / 1000.0;
    let volume_cm3 = carving.fragment.len() as f64 * voxel_cm3;
    if volume_cm3 < rules.smallest_cm3 {
        return Ok(Some(Rejection::TooSmall));
    }
    if volume_cm3 > rules.largest_cm3 {
        return Ok(Some(Rejection::TooLarge));
    }
    let mask = carving.fragment_mask(grid);
    let pieces = components(&mask);
    let largest = pieces.sizes.iter().max().copied().unwrap_or(0);
    if (largest as f64) < rules.connected_fraction * carving.fragment.len() as f64 {
        return Ok(Some(Rejection::InPieces));
    }
    if !holds_joint(hip, acetabulum, &mask, rules.held_fraction) {
        return Ok(Some(Rejection::JointLost));
    }
    let voxel_mm = grid.spacing.iter().copied().fold(0.0, f64::max);
    let helpers = helper_planes(hip, fragment)?;
    let touches_helper = carving.fragment.iter().any(|&offset| {
        let p = hip.app_from_volume * grid.center(grid.voxel(offset));
        helpers
            .iter()
            .any(|plane| plane.signed_distance(&p) > -voxel_mm)
    });
    Ok(touches_helper.then_some(Rejection::NotFree))
}

/// True if enough of the rim lies on the fragment's bone (within [`RIM_MM`]) and enough of the
/// articular surface is part of it. Rim points that have no bone of the whole pelvis near them
/// don't count: a trace may bridge the acetabular notch.
fn holds_joint(
    hip: &Hip,
    acetabulum: &Acetabulum,
    fragment: &Volume<bool>,
    held_fraction: f64,
) -> bool {
    let volume_from_app = hip.app_from_volume.inverse();
    let held = |p: &Point| fragment.nearest(&(volume_from_app * p)) == Some(true);
    let labels = &hip.specimen.labels;
    let bone = |p: &Point| labels.nearest(&(volume_from_app * p)) == Some(Label::Pelvis.value());
    let near = ball_of_points(RIM_MM);
    let on = |p: &Point, is_bone: &dyn Fn(&Point) -> bool| near.iter().any(|d| is_bone(&(p + d)));
    let rim: Vec<&Point> = acetabulum.rim.iter().filter(|p| on(p, &bone)).collect();
    let rim_held = rim.iter().filter(|p| on(p, &held)).count();
    let surface_held = acetabulum.surface.iter().filter(|p| held(p)).count();
    let enough = |held: usize, all: usize| held as f64 >= held_fraction * all as f64;
    enough(rim_held, rim.len()) && enough(surface_held, acetabulum.surface.len())
}

/// How far a rim point, traced by a person or a rule, may lie from the bone, in mm.
const RIM_MM: f64 = 4.0;

/// Offsets 1 mm apart that fill a ball.
fn ball_of_points(radius_mm: f64) -> Vec<Vector> {
    let n = radius_mm as i32;
    let axis = || (-n..=n).map(f64::from);
    axis()
        .flat_map(|x| axis().flat_map(move |y| axis().map(move |z| Vector::new(x, y, z))))
        .filter(|d| d.norm() <= radius_mm)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Side;
    use crate::geometry::Plane;
    use crate::surgery::block_hip::{LANDMARKS, block_hip, block_hip_without};
    use crate::surgery::nominal_cuts::{NominalCutParameters, nominal_cuts};

    fn nominal(side: Side) -> CutPlanes {
        nominal_cuts(&block_hip(side), &NominalCutParameters::default()).unwrap()
    }

    fn verdict(hip: &Hip, cuts: &CutPlanes, rules: &PlausibilityParameters) -> Option<Rejection> {
        let site = OsteotomySite::of(hip).unwrap();
        let fragment = FragmentParameters::default();
        plausible_fragment(hip, &site, cuts, &fragment, rules)
            .unwrap()
            .err()
    }

    /// A cut moved along its normal, out of the fragment where `mm` is positive.
    fn shifted(cuts: &CutPlanes, cut: Cut, mm: f64) -> CutPlanes {
        let plane = *cuts.get(cut);
        let offset_mm = plane.offset_mm + mm;
        cuts.with(cut, Plane { offset_mm, ..plane })
    }

    #[test]
    fn the_nominal_fragment_is_plausible_and_is_what_is_returned() {
        let rules = PlausibilityParameters::default();
        let fragment = FragmentParameters::default();
        for side in Side::BOTH {
            let (hip, cuts) = (block_hip(side), nominal(side));
            let site = OsteotomySite::of(&hip).unwrap();
            let found = plausible_fragment(&hip, &site, &cuts, &fragment, &rules);
            assert_eq!(
                found.unwrap().unwrap(),
                carve(&hip, &cuts, &fragment).unwrap(),
                "{side}"
            );
        }
    }

    #[test]
    fn each_rule_rejects_with_its_reason() {
        let side = Side::Left;
        let (hip, cuts) = (block_hip(side), nominal(side));
        let rules = PlausibilityParameters::default();
        for cut in Cut::ALL {
            let clearance = Acetabulum::of(&hip).unwrap().clearance_mm(cuts.get(cut));
            let near = shifted(&cuts, cut, 3.9 - clearance);
            assert_eq!(verdict(&hip, &near, &rules), Some(Rejection::TooClose(cut)));
            let far_enough = shifted(&cuts, cut, 4.1 - clearance);
            assert_eq!(verdict(&hip, &far_enough, &rules), None, "{cut:?}");
        }
        let high = shifted(&cuts, Cut::Ilium, 40.0);
        let asis = Rejection::HoldsLandmark(Landmark::Asis);
        assert_eq!(verdict(&hip, &high, &rules), Some(asis));
        let back = shifted(&cuts, Cut::Posterior, 9.0);
        assert_eq!(verdict(&hip, &back, &rules), Some(Rejection::RingBroken));
        let large = PlausibilityParameters {
            smallest_cm3: 400.0,
            largest_cm3: 500.0,
            ..rules.clone()
        };
        assert_eq!(verdict(&hip, &cuts, &large), Some(Rejection::TooSmall));
        let small = PlausibilityParameters {
            smallest_cm3: 0.0,
            largest_cm3: 1.0,
            ..rules
        };
        assert_eq!(verdict(&hip, &cuts, &small), Some(Rejection::TooLarge));
    }

    #[test]
    fn a_fragment_that_reaches_the_midline_is_not_free() {
        let side = Side::Right;
        let mut hip = block_hip(side);
        // Without the landmarks of the pubis only the bone itself tells.
        let mut specimen = (*hip.specimen).clone();
        specimen.landmarks = Default::default();
        for (landmark, side, p) in hip.specimen.landmarks.iter() {
            if !matches!(landmark, Landmark::Sps | Landmark::Mof) {
                specimen.landmarks.set(landmark, side, p);
            }
        }
        hip.specimen = std::sync::Arc::new(specimen);
        let wide = shifted(&nominal(side), Cut::Pubis, 60.0);
        let rules = PlausibilityParameters::default();
        assert_eq!(verdict(&hip, &wide, &rules), Some(Rejection::NotFree));
    }

    #[test]
    fn a_loose_part_of_the_joint_is_noticed() {
        // One layer of voxels is missing, which cuts the front third of the shell off.
        let hip = block_hip_without(Side::Left, |_, _, z| (10.0..11.0).contains(&z));
        let rules = PlausibilityParameters::default();
        let cuts = nominal(Side::Left);
        assert_eq!(verdict(&hip, &cuts, &rules), Some(Rejection::JointLost));
    }

    #[test]
    fn crumbs_are_allowed_and_pieces_are_not() {
        let side = Side::Left;
        let (hip, cuts) = (block_hip(side), nominal(side));
        let acetabulum = Acetabulum::of(&hip).unwrap();
        let fragment = FragmentParameters::default();
        let mut carving = carve(&hip, &cuts, &fragment).unwrap();
        let grid = &hip.specimen.labels.grid;
        let all = carving.fragment.len();
        let rules = PlausibilityParameters::default();
        let without_layer = |carving: &Carving, at: usize| {
            let keep = |&o: &usize| grid.voxel(o)[2] != at;
            Carving {
                fragment: carving.fragment.iter().copied().filter(keep).collect(),
                ..carving.clone()
            }
        };
        // Layers of constant height: one below the top leaves a crumb above it, one in the middle
        // two large pieces.
        let crumb = without_layer(&carving, carving.bounds.1[2] - 3);
        let found = check_bone(&hip, &acetabulum, &crumb, &fragment, &rules).unwrap();
        assert_eq!(found, None);
        let middle = (carving.bounds.0[2] + carving.bounds.1[2]) / 2;
        carving = without_layer(&carving, middle);
        assert!(carving.fragment.len() > all * 9 / 10);
        let found = check_bone(&hip, &acetabulum, &carving, &fragment, &rules).unwrap();
        assert_eq!(found, Some(Rejection::InPieces));
    }

    #[test]
    fn the_landmarks_of_the_block_hip_are_all_kept() {
        let cuts = nominal(Side::Left);
        for (landmark, [u, y, z]) in LANDMARKS {
            let p = Point::new(u, y, z);
            let inside = Cut::ALL
                .iter()
                .all(|&c| cuts.get(c).signed_distance(&p) < 0.0);
            assert_eq!(inside, landmark == Landmark::Aiis, "{landmark:?}");
        }
    }

    #[test]
    fn an_empty_volume_range_is_a_problem() {
        let rules = PlausibilityParameters {
            smallest_cm3: 200.0,
            ..Default::default()
        };
        let problems = rules.problems();
        assert_eq!(problems.len(), 1);
        assert!(problems[0].1.contains("160"), "{problems:?}");
    }
}

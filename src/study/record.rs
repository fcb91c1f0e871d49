//! Compares what a strategy found with the truth, and writes both into a row.

use super::case_worker::SimulatedCase;
use super::{Failure, Scenario};
use crate::anatomy::{LceApex, lce, lce_angle};
use crate::geometry::pose_error::{PoseError, fragment_movement};
use crate::geometry::{Point, Rigid};
use crate::registration::{Outcome, ShapeOutcome};
use crate::simulation::Pick;
use crate::store::Row;
use crate::surgery::{Cut, CutPlanes};

/// The truth of a case.
///
/// # Errors
/// When the rim has no LCE angle.
pub fn truth(case: &SimulatedCase, apex: LceApex, row: &mut Row) -> Result<(), Failure> {
    let (truth, specimen) = (&case.case.truth, &case.fragment.hip.hip.specimen);
    row.set("specimen_kind", specimen.source.kind.as_str());
    row.set("assigned_density", specimen.source.assigned_density);
    let movement = &truth.movement;
    let of_fragment = PoseError::of(&movement.fragment);
    row.set("true_rotation_deg", of_fragment.rotation_deg);
    row.set("true_translation_mm", of_fragment.translation_mm);
    components("true_", "", &of_fragment, row);
    components("true_femur_", "", &PoseError::of(&movement.femur), row);
    let before = lce_deg(case, &Rigid::identity(), &Rigid::identity(), apex)?;
    row.set("preoperative_lce_deg", before);
    let after = lce_deg(case, &movement.fragment, &movement.femur, apex)?;
    row.set("true_lce_deg", after);
    for (view, angle) in [2, 3].into_iter().zip(truth.views.orbital_angles) {
        row.set(
            &format!("true_orbital_angle_{view}_deg"),
            angle.to_degrees(),
        );
    }
    row.set("fragment_rejections", count(case.fragment.rejections));
    row.set("movement_rejections", i64::from(case.movement_rejections));
    row.set("overlap_voxels", count(truth.overlap_voxels));
    Ok(())
}

/// How far the noisy pick is from the landmark.
pub fn pick(case: &SimulatedCase, pick: &Pick, row: &mut Row) {
    let truth = &case.case.truth;
    row.set("pick_point_offset_mm", (pick.point - truth.landmark).norm());
    row.set(
        "pick_pixel_offset_px",
        (pick.pixel - truth.landmark_pixel).norm(),
    );
}

/// What the strategy found, and its errors.
///
/// # Errors
/// When the rim has no LCE angle.
pub fn outcome(
    case: &SimulatedCase,
    scenario: Scenario,
    outcome: &Outcome,
    apex: LceApex,
    row: &mut Row,
) -> Result<(), Failure> {
    let truth = &case.case.truth;
    let estimated = &outcome.fragment_movement;
    components("estimated_", "", &PoseError::of(estimated), row);
    let app_from_volume = case.fragment.hip.hip.app_from_volume;
    let femur = fragment_movement(
        &app_from_volume,
        &outcome.camera_from_pelvis,
        &outcome.camera_from_femur,
    );
    let lce = lce_deg(case, estimated, &femur, apex)?;
    row.set("estimated_lce_deg", lce);
    if let Some(truth) = row.number("true_lce_deg") {
        row.set("lce_error_deg", lce - truth);
    }
    for (view, angle) in [2, 3].into_iter().zip(outcome.orbital_angles) {
        row.set(
            &format!("estimated_orbital_angle_{view}_deg"),
            angle.to_degrees(),
        );
    }
    let error = PoseError::between(estimated, &truth.movement.fragment);
    row.set("rotation_error_deg", error.rotation_deg);
    row.set("translation_error_mm", error.translation_mm);
    components("", "error_", &error, row);

    let first = &truth.views.camera_from_volume[0];
    for (phase, camera_from_pelvis) in [
        ("initialization", &outcome.initial_camera_from_pelvis),
        ("single_view", &outcome.single_view_camera_from_pelvis[0]),
        ("multi_view", &outcome.camera_from_pelvis),
    ] {
        let offset = pelvis_offset(&app_from_volume, first, camera_from_pelvis);
        row.set(&format!("pelvis_{phase}_rotation_deg"), offset.rotation_deg);
        row.set(
            &format!("pelvis_{phase}_translation_mm"),
            offset.translation_mm,
        );
    }
    shape(case, scenario, &outcome.shape, row);
    for stage in &outcome.stages {
        let name = stage.stage;
        row.set(&format!("{name}_cost"), stage.cost);
        row.set(
            &format!("{name}_evaluations"),
            i64::try_from(stage.evaluations).unwrap_or(i64::MAX),
        );
        row.set(&format!("{name}_capped"), stage.capped);
        row.set(&format!("{name}_seconds"), stage.seconds);
    }
    Ok(())
}

/// Offset of a pose of the pelvis from the true one, as a movement of the pelvis in the APP.
pub fn pelvis_offset(app_from_volume: &Rigid, truth: &Rigid, estimated: &Rigid) -> PoseError {
    let moved = app_from_volume * truth.inverse() * estimated * app_from_volume.inverse();
    PoseError::of(&moved)
}

fn shape(case: &SimulatedCase, scenario: Scenario, shape: &ShapeOutcome, row: &mut Row) {
    let assumed = case.fragment.assumed_cuts(scenario);
    let used = match shape {
        ShapeOutcome::Given => &assumed,
        ShapeOutcome::Estimated {
            cuts,
            ilium_fallback,
            pubis_fallback,
            seconds,
        } => {
            row.set("shape_seconds", *seconds);
            let fallbacks = [("ilium", ilium_fallback), ("pubis", pubis_fallback)];
            for (cut, fallback) in fallbacks {
                if let Some(reason) = fallback {
                    row.set(&format!("{cut}_fallback"), reason.as_str());
                }
            }
            cuts
        }
    };
    for cut in [Cut::Ilium, Cut::Pubis] {
        let (angle_deg, offset_mm) = plane_error(used, case.fragment.true_cuts(), cut);
        row.set(&format!("{}_angle_error_deg", cut.name()), angle_deg);
        row.set(&format!("{}_offset_error_mm", cut.name()), offset_mm);
    }
}

/// Angle (deg) and outward offset (mm) of a used plane against the true one: the offset is taken at
/// the foot of the perpendicular from the femoral head, the APP's origin, to the true plane.
fn plane_error(used: &CutPlanes, truth: &CutPlanes, cut: Cut) -> (f64, f64) {
    let (used, truth) = (used.get(cut), truth.get(cut));
    let angle = used
        .normal
        .cross(&truth.normal)
        .norm()
        .atan2(used.normal.dot(&truth.normal));
    let foot = truth.project(&Point::origin());
    // Normals point out of the fragment, so a point inside of the used plane has a negative distance.
    (angle.to_degrees(), -used.signed_distance(&foot))
}

/// The six components of a movement or an error, in the order of the APP's axes.
fn components(prefix: &str, infix: &str, of: &PoseError, row: &mut Row) {
    for (axis, name) in ["lr", "is", "ap"].into_iter().enumerate() {
        let rotation = format!("{prefix}rotation_{infix}{name}_deg");
        row.set(&rotation, of.rotation_axes_deg[axis]);
        let translation = format!("{prefix}translation_{infix}{name}_mm");
        row.set(&translation, of.translation_axes_mm[axis]);
    }
}

fn lce_deg(
    case: &SimulatedCase,
    fragment: &Rigid,
    femur: &Rigid,
    apex: LceApex,
) -> Result<f64, Failure> {
    let hip = &case.fragment.hip.hip;
    let apex = lce::apex(apex, femur);
    lce_angle(&hip.rim_in_app(), hip.side, fragment, &apex)
        .map(f64::to_degrees)
        .map_err(|cause| Failure::new("lce", cause))
}

fn count(value: usize) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Plane, Vector};

    #[test]
    fn a_plane_moved_outward_by_2_mm_and_tilted_by_10_deg_has_these_errors() {
        let plane = |angle_deg: f64, offset: f64| {
            let angle = angle_deg.to_radians();
            let normal = Vector::new(angle.cos(), angle.sin(), 0.0);
            Plane::through(&Point::new(offset, 0.0, 0.0), &normal)
        };
        let truth = CutPlanes::new([plane(0.0, 30.0); 4]);
        let used = truth.with(Cut::Pubis, plane(10.0, 32.0));
        let (angle, offset) = plane_error(&used, &truth, Cut::Pubis);
        assert!((angle - 10.0).abs() < 1e-9, "{angle}");
        assert!(
            (offset - 2.0 * 10f64.to_radians().cos()).abs() < 1e-9,
            "{offset}"
        );
        assert_eq!(plane_error(&truth, &truth, Cut::Ilium), (0.0, 0.0));
    }

    #[test]
    fn an_offset_is_that_of_the_pelvis_in_the_app() {
        let app_from_volume =
            Rigid::new(Vector::new(-80.0, 10.0, 5.0), Vector::new(0.1, 0.2, -0.3));
        let camera_from_volume =
            Rigid::new(Vector::new(3.0, 4.0, -800.0), Vector::new(1.0, 0.5, 0.2));
        let moved = Rigid::new(Vector::new(1.0, -2.0, 2.0), Vector::new(0.0, 0.05, 0.0));
        let estimated = camera_from_volume * app_from_volume.inverse() * moved * app_from_volume;
        let offset = pelvis_offset(&app_from_volume, &camera_from_volume, &estimated);
        assert!((offset.translation_mm - 3.0).abs() < 1e-9);
        assert!((offset.rotation_deg - 0.05f64.to_degrees()).abs() < 1e-9);
    }

    #[test]
    fn components_name_columns_of_the_schema() {
        let mut row = Row::default();
        let error = PoseError::of(&Rigid::new(Vector::new(1.0, 2.0, 3.0), Vector::zeros()));
        for (prefix, infix) in [
            ("true_", ""),
            ("true_femur_", ""),
            ("estimated_", ""),
            ("", "error_"),
        ] {
            components(prefix, infix, &error, &mut row);
        }
        assert_eq!(row.number("translation_error_is_mm"), Some(2.0));
        assert_eq!(row.number("true_femur_translation_ap_mm"), Some(3.0));
    }
}

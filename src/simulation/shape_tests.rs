//! From simulated annotations to estimated cuts.

use super::annotate::{AnnotationParameters, CutLines};
use super::testing::{toy, toy_cuts};
use super::views::{ViewParameters, Views};
use crate::anatomy::{Hip, Side};
use crate::geometry::{Plane, Point, Rigid, Vector};
use crate::random::{Purpose, stream};
use crate::registration::ModelRecipe;
use crate::shape_estimation::{
    CutAnnotation, EstimatedCuts, RansacParameters, RegisteredView, ShapeInput, estimate_cuts,
};
use crate::surgery::{Cut, CutPlanes, FragmentParameters, cut_fragment};
use crate::volume::Surface;
use crate::xray::{Camera, Orbit};

struct Scene {
    hip: &'static Hip,
    pelvis: &'static Surface,
    cameras: [Camera; 3],
    poses: [Rigid; 3],
    truth: CutPlanes,
    nominal: CutPlanes,
}

fn scene(side: Side) -> Scene {
    let (hip, pelvis) = toy(side);
    let camera = Camera::cios_fusion();
    let mut s = stream(4, Purpose::Views, "estimate");
    let views = Views::sample(
        hip,
        &camera,
        &Orbit::cios_fusion(),
        &ViewParameters::default(),
        &mut s,
    );
    let truth = toy_cuts(side);
    // The plan differs by a few mm and degrees.
    let other = Rigid::new(Vector::new(3.0, -2.0, 4.0), Vector::new(0.15, 0.1, -0.1));
    let nominal = CutPlanes::new(Cut::ALL.map(|cut| truth.get(cut).transformed(&other)));
    Scene {
        hip,
        pelvis,
        cameras: [camera; 3],
        poses: views.camera_from_volume,
        truth,
        nominal,
    }
}

fn annotations(scene: &Scene, parameters: &AnnotationParameters) -> Vec<CutAnnotation> {
    let map = cut_fragment(scene.hip, &scene.truth, &FragmentParameters::default()).unwrap();
    let lines = CutLines::new(scene.hip, scene.pelvis, &map);
    (0..3)
        .flat_map(|view| {
            let mut s = stream(4, Purpose::Annotation, &format!("estimate/{view}"));
            let (camera, pose) = (&scene.cameras[view], &scene.poses[view]);
            lines.annotate(view, camera, pose, parameters, &mut s)
        })
        .collect()
}

fn estimate(scene: &Scene, annotations: &[CutAnnotation]) -> EstimatedCuts {
    let views: Vec<RegisteredView> = std::iter::zip(scene.cameras, scene.poses)
        .map(|(camera, camera_from_pelvis)| RegisteredView {
            camera,
            camera_from_pelvis,
        })
        .collect();
    let input = ShapeInput {
        hip: scene.hip,
        pelvis: scene.pelvis,
        views: &views,
        annotations,
        nominal: &scene.nominal,
    };
    let mut s = stream(4, Purpose::Ransac, "estimate");
    let recipe = ModelRecipe::default();
    estimate_cuts(&input, &RansacParameters::default(), &mut s, |cuts| {
        recipe.plausible(scene.hip, cuts)
    })
}

/// Angle in degrees, and distance in mm where the truth passes closest to a point on the bone.
fn errors(estimated: &Plane, truth: &Plane, near: &Point) -> (f64, f64) {
    let angle = estimated.normal.dot(&truth.normal).min(1.0).acos();
    let distance = estimated.signed_distance(&truth.project(near));
    (angle.to_degrees(), distance.abs())
}

fn places(side: Side) -> [(Cut, Point); 2] {
    let s = side.lateral_sign();
    [
        (Cut::Ilium, Point::new(-8.0 * s, 45.0, 0.0)),
        (Cut::Pubis, Point::new(-45.0 * s, -12.0, 20.0)),
    ]
}

#[test]
fn perfect_annotations_give_the_true_cuts() {
    for side in Side::BOTH {
        let scene = scene(side);
        let exact = AnnotationParameters {
            gaps: [0, 0],
            corner_sd_px: 0.0,
            ..Default::default()
        };
        let result = estimate(&scene, &annotations(&scene, &exact));
        assert_eq!(result.ilium_fallback, None);
        assert_eq!(result.pubis_fallback, None);
        for (cut, place) in places(side) {
            let (estimated, truth) = (result.cuts.get(cut), scene.truth.get(cut));
            let (angle, distance) = errors(estimated, truth, &place);
            assert!(
                angle < 1.0 && distance < 0.3,
                "{side} {}: {angle} {distance}",
                cut.name()
            );
            assert!(estimated.signed_distance(&Point::origin()) < 0.0);
        }
        for cut in [Cut::Ischium, Cut::Posterior] {
            assert_eq!(result.cuts.get(cut), scene.nominal.get(cut));
        }
    }
}

#[test]
fn a_persons_annotations_come_nearer_to_the_truth_than_the_plan() {
    for side in Side::BOTH {
        let scene = scene(side);
        let drawn = annotations(&scene, &AnnotationParameters::default());
        let result = estimate(&scene, &drawn);
        for (cut, place) in places(side) {
            let (angle, distance) = errors(result.cuts.get(cut), scene.truth.get(cut), &place);
            let (planned, off) = errors(scene.nominal.get(cut), scene.truth.get(cut), &place);
            // 10 pixels are 1.6 mm at the patient: much for the tilt of a bar of 16 mm, little for
            // that of a wing.
            let tilt = if cut == Cut::Ilium { planned } else { 15.0 };
            assert!(
                angle < tilt && distance < off,
                "{side} {}: {angle} of {planned} deg, {distance} of {off} mm",
                cut.name()
            );
        }
    }
}

#[test]
fn without_annotations_of_a_cut_the_plan_is_used_and_the_reason_given() {
    let scene = scene(Side::Left);
    let drawn = annotations(&scene, &AnnotationParameters::default());
    let only_ilium: Vec<_> = drawn.into_iter().filter(|a| a.cut == Cut::Ilium).collect();
    let result = estimate(&scene, &only_ilium);
    assert_eq!(result.ilium_fallback, None);
    let reason = result.pubis_fallback.unwrap();
    assert!(reason.starts_with("0 sightings are left"), "{reason}");
    assert_eq!(result.cuts.get(Cut::Pubis), scene.nominal.get(Cut::Pubis));
}

#[test]
fn a_plane_through_the_joint_is_refused() {
    let mut scene = scene(Side::Left);
    // Lines drawn through the acetabulum's roof: nothing but the joint says that they are wrong.
    let roof = Plane::through(&Point::new(0.0, 27.5, 0.0), &Vector::y());
    scene.truth = scene.truth.with(Cut::Ilium, roof);
    let result = estimate(
        &scene,
        &annotations(&scene, &AnnotationParameters::default()),
    );
    let reason = result
        .ilium_fallback
        .expect("the cut runs through the joint");
    assert!(reason.contains("ilium cut too close"), "{reason}");
    assert_eq!(result.cuts.get(Cut::Ilium), scene.nominal.get(Cut::Ilium));
}

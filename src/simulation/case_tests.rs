//! A whole case on a coarse phantom.

use super::case::{Case, CaseError, CaseParameters, Operation, pelvis_surface};
use super::movement::Movement;
use super::pick::PickParameters;
use crate::anatomy::phantom::{PhantomParameters, phantom};
use crate::anatomy::{Hip, Landmark, Side, lce_angle, mirror};
use crate::geometry::pose_error::PoseError;
use crate::geometry::{Pixel, Point, Rigid, Vector, euler};
use crate::surgery::{
    Cut, FragmentParameters, KWireParameters, NominalCutParameters, cut_fragment, nominal_cuts,
};
use crate::xray::{AttenuationParameters, Camera};
use std::sync::{Arc, OnceLock};

/// The nominal surgery on both hips of a phantom of 2 mm, and on those of its mirror image.
fn operations() -> &'static [[(Arc<Hip>, Operation); 2]; 2] {
    type Operated = [(Arc<Hip>, Operation); 2];
    static MADE: OnceLock<[Operated; 2]> = OnceLock::new();
    MADE.get_or_init(|| {
        let coarse = PhantomParameters {
            voxel_mm: 2.0,
            ..Default::default()
        };
        let body = phantom(1, &coarse);
        let reflection = mirror(&body);
        [body, reflection].map(|specimen| {
            let specimen = Arc::new(specimen);
            Side::BOTH.map(|side| {
                let hip = Arc::new(Hip::new(Arc::clone(&specimen), side).unwrap());
                let cuts = nominal_cuts(&hip, &NominalCutParameters::default()).unwrap();
                let map = cut_fragment(&hip, &cuts, &FragmentParameters::default()).unwrap();
                let pelvis = Arc::new(pelvis_surface(&hip));
                let wires = KWireParameters::default();
                let operation = Operation::new(Arc::clone(&hip), pelvis, map, &wires).unwrap();
                (hip, operation)
            })
        })
    })
}

/// The nominal surgery on a hip of a phantom of 2 mm.
fn operation(side: Side) -> &'static (Arc<Hip>, Operation) {
    &operations()[0][side.index()]
}

fn movement(side: Side) -> Movement {
    let s = side.lateral_sign();
    let angles = Vector::new(0.15, 0.05 * s, -0.2 * s);
    let shift = Vector::new(-2.0 * s, -2.0, 2.0);
    Movement {
        fragment: Rigid::from_parts(shift.into(), euler::from_xyz(&angles)),
        femur: Rigid::translation(shift.x, shift.y, shift.z),
    }
}

/// The whole field of view on a detector of an eighth of the pixels a side.
fn small() -> CaseParameters {
    CaseParameters {
        camera: Camera::centered(192, 8.0 * 0.194, 1020.0),
        ..Default::default()
    }
}

fn simulate(side: Side, parameters: &CaseParameters, key: &str) -> Result<Case, CaseError> {
    Case::simulate(&operation(side).1, &movement(side), parameters, 3, key)
}

#[test]
fn a_case_depends_on_its_key_alone() {
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let a = simulate(Side::Left, &small(), "p/left/f00/m00").unwrap();
    let b = one
        .install(|| simulate(Side::Left, &small(), "p/left/f00/m00"))
        .unwrap();
    let c = simulate(Side::Left, &small(), "p/left/f00/m01").unwrap();
    assert_eq!(a.counts(), b.counts());
    assert_eq!(a.annotations(), b.annotations());
    assert_eq!(a.truth.wires, b.truth.wires);
    assert_ne!(a.counts(), c.counts());
    assert_ne!(a.truth.wires, c.truth.wires);
    assert_ne!(a.truth.views, c.truth.views);
    let pick = |case: &Case, key: &str| case.pick(&PickParameters::default(), key);
    assert_eq!(pick(&a, "k/i0"), pick(&b, "k/i0"));
    assert_ne!(pick(&a, "k/i0"), pick(&a, "k/i1"));
}

/// The same case with wires of metal and of water: the images differ along the wires, and not
/// beside them. (Behind the first wire of a row its stream of noise has gone other ways.)
#[test]
fn wires_show_where_their_geometry_says() {
    for side in Side::BOTH {
        let (hip, metal) = operation(side);
        let water = KWireParameters {
            hu: [0.0, 0.0],
            ..Default::default()
        };
        let pelvis = Arc::new(pelvis_surface(hip));
        let water = Operation::new(Arc::clone(hip), pelvis, metal.map().clone(), &water).unwrap();
        let simulated = |operation: &Operation| {
            Case::simulate(operation, &movement(side), &small(), 3, "p/wires/f00/m00").unwrap()
        };
        let (metal, water) = (simulated(metal), simulated(&water));
        for view in 0..3 {
            let pose = &metal.truth.views.camera_from_volume[view];
            let axes = metal.truth.wires.map(|wire| {
                let end = |t: f64| {
                    small()
                        .camera
                        .project(&(pose * (wire.tip_base + wire.direction * t)))
                };
                [end(-wire.body_length_mm), end(wire.tip_length_mm)]
            });
            let (mut on, mut on_water, mut away, mut passed) = (0.0, 0.0, 0, false);
            for (offset, (&a, &b)) in
                std::iter::zip(&metal.counts()[view].data, &water.counts()[view].data).enumerate()
            {
                let pixel = Pixel::new((offset % 192) as f64, (offset / 192) as f64);
                passed &= offset % 192 > 0;
                let distance = axes
                    .iter()
                    .map(|axis| distance_to_segment(&pixel, axis))
                    .fold(f64::MAX, f64::min);
                passed |= distance <= 4.0;
                if distance < 0.5 {
                    on += f64::from(a);
                    on_water += f64::from(b);
                } else if !passed {
                    assert_eq!(a, b, "{side} view {view}: {pixel} at {distance}");
                    away += 1;
                }
            }
            assert!(on < 0.9 * on_water, "{side} view {view}: {on} {on_water}");
            assert!(away > 10_000, "{away}");
        }
    }
}

fn distance_to_segment(p: &Pixel, [a, b]: &[Pixel; 2]) -> f64 {
    let along = b - a;
    let t = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
    (p - (a + along * t)).norm()
}

/// At bones that do not move, the counts are what a walk through the CT along the ray says.
#[test]
fn the_body_lies_where_the_views_say() {
    for side in Side::BOTH {
        let hip = &operation(side).0;
        let case = simulate(side, &small(), "p/body/f00/m00").unwrap();
        let units = AttenuationParameters::default();
        for view in 0..3 {
            let volume_from_camera = case.truth.views.camera_from_volume[view].inverse();
            let expected = |x: usize, y: usize| {
                let ray = small().camera.ray(&Pixel::new(x as f64, y as f64));
                let mu = |n: u32| {
                    let at = volume_from_camera * ray.at(0.5 * f64::from(n));
                    let hu = hip.specimen.ct.nearest(&at).unwrap_or(-1000);
                    f64::from(units.mu(f32::from(hu)))
                };
                2000.0 * (-0.5 * (800..2100).map(mu).sum::<f64>()).exp()
            };
            for (landmark, other) in [Landmark::Sps, Landmark::Ips]
                .into_iter()
                .flat_map(|l| Side::BOTH.map(|s| (l, s)))
            {
                let point = hip.specimen.landmarks.get(landmark, other).unwrap();
                let pose = &case.truth.views.camera_from_volume[view];
                let pixel = small().camera.project(&(pose * point));
                let (x, y) = (pixel.x.round() as usize, pixel.y.round() as usize);
                let (mut counted, mut sum) = (0.0, 0.0);
                for (x, y) in (0..5).flat_map(|a| (0..5).map(move |b| (x + a - 2, y + b - 2))) {
                    counted += f64::from(case.counts()[view].at(x, y));
                    sum += expected(x, y);
                }
                let ratio = counted / sum;
                assert!((ratio - 1.0).abs() < 0.05, "{side} view {view}: {ratio}");
            }
        }
        assert!(
            case.truth.overlap_voxels < 500,
            "{}",
            case.truth.overlap_voxels
        );
    }
}

#[test]
fn a_landmark_out_of_the_image_is_an_error_that_says_so() {
    let mut parameters = small();
    parameters.views.superior_offset_mm = 100.0;
    parameters.views.medial_offset_mm = -80.0;
    let error = simulate(Side::Right, &parameters, "p/out").unwrap_err();
    assert!(
        matches!(error, CaseError::LandmarkOutside { .. }),
        "{error}"
    );
    assert!(error.to_string().contains("MOF_r of p/out"), "{error}");
}

/// A left hip, and the right hip of the mirror image under the same key: the same surgery, movement,
/// LCE angle, wires and pictures, mirrored. The C-arm of a right hip is turned by 180 deg, so pictures
/// are mirrored in their rows.
#[test]
fn mirrored_anatomy_gives_the_mirrored_case() {
    let key = "p/mirror/f00/m00";
    let [(hip, _), (mirrored_hip, _)] = sides();
    let simulated = sides().map(|(hip, operation)| {
        let movement = movement(hip.side);
        Case::simulate(operation, &movement, &small(), 3, key).unwrap()
    });
    let [case, mirrored] = &simulated;
    let reflected = |v: &Vector| Vector::new(-v.x, v.y, v.z);

    for cut in Cut::ALL {
        let [plane, other] = [case, mirrored].map(|case| case.truth.cuts.get(cut));
        assert!((reflected(&plane.normal) - other.normal).norm() < 1e-6);
    }
    let size = |case: &(Arc<Hip>, Operation)| case.1.map().fragment_cm3();
    let [volume, mirrored_volume] = sides().map(size);
    assert!((volume / mirrored_volume - 1.0).abs() < 1e-3);
    let lce = |hip: &Hip, movement: &Rigid| {
        lce_angle(&hip.rim_in_app(), hip.side, movement, &Point::origin()).unwrap()
    };
    let angles = [(hip, case), (mirrored_hip, mirrored)]
        .map(|(hip, case)| lce(hip, &case.truth.movement.fragment));
    assert!((angles[0] - angles[1]).abs() < 1e-9, "{angles:?}");
    let errors = [case, mirrored].map(|case| PoseError::of(&case.truth.movement.fragment));
    assert!((errors[0].rotation_deg - errors[1].rotation_deg).abs() < 1e-9);
    for (wire, other) in std::iter::zip(&case.truth.wires, &mirrored.truth.wires) {
        let [tip, other_tip] = [wire.tip_base.coords, other.tip_base.coords];
        assert!(
            (reflected(&tip) - other_tip).norm() < 0.5,
            "{tip} {other_tip}"
        );
    }
    for view in 0..3 {
        let [image, other] = [case, mirrored].map(|case| &case.counts()[view]);
        let (mut sum, mut worst) = (0.0, 0.0f64);
        for (x, y) in (0..192).flat_map(|y| (0..192).map(move |x| (x, y))) {
            let (a, b) = (f64::from(image.at(x, y)), f64::from(other.at(x, 191 - y)));
            let deviation = (a - b) / (a + b).max(1.0).sqrt();
            sum += deviation * deviation;
            worst = worst.max(deviation.abs());
        }
        // Two Poisson draws of one mean: the deviation is nearly a standard normal number.
        let mean = sum / (192.0 * 192.0);
        assert!((mean - 1.0).abs() < 0.05, "view {view}: {mean}");
        assert!(worst < 6.5, "view {view}: {worst}");
    }
}

fn sides() -> [&'static (Arc<Hip>, Operation); 2] {
    let [body, reflection] = operations();
    [&body[Side::Left.index()], &reflection[Side::Right.index()]]
}

//! Tests of whole phantom bodies, at coarse voxels.

use super::skeleton::{Bone, Skeleton, sided};
use super::{PhantomParameters, phantom};
use crate::anatomy::frame::app_from_volume;
use crate::anatomy::{Label, Landmark, Side, Specimen, mirror};
use crate::geometry::{Point, Vector};
use std::sync::LazyLock;

const FIRST: std::ops::RangeInclusive<u32> = 1..=6;

fn coarse(voxel_mm: f64) -> PhantomParameters {
    PhantomParameters {
        voxel_mm,
        ..Default::default()
    }
}

static ONE: LazyLock<Specimen> = LazyLock::new(|| phantom(1, &coarse(2.0)));
static SKELETONS: LazyLock<Vec<Skeleton>> = LazyLock::new(|| {
    FIRST
        .map(|n| Skeleton::draw(n, &PhantomParameters::default()))
        .collect()
});

fn lps(specimen: &Specimen, landmark: Landmark, side: Side) -> Point {
    specimen.landmarks.get(landmark, side).unwrap()
}

#[test]
fn landmarks_are_complete_on_bone_and_on_their_sides() {
    let s = &*ONE;
    assert_eq!(s.name, "phantom-1");
    assert!(s.landmarks.missing().is_empty());
    for landmark in Landmark::ALL {
        let (l, r) = (lps(s, landmark, Side::Left), lps(s, landmark, Side::Right));
        assert!(l.x > r.x, "{landmark:?}: left {l} is not left of right {r}");
        assert!(s.ct.grid.nearest(&l).is_some() && s.ct.grid.nearest(&r).is_some());
    }
    for skeleton in SKELETONS.iter() {
        for side in Side::BOTH {
            let hip = &skeleton.hips[side.index()];
            for landmark in Landmark::ALL {
                if landmark != Landmark::Fh {
                    let d = hip.distance(&hip.landmark(landmark));
                    assert!(d.abs() < 0.05, "{landmark:?} lies {d} mm off the bone");
                }
            }
        }
    }
}

#[test]
fn landmark_distances_are_human() {
    for (n, skeleton) in FIRST.zip(SKELETONS.iter()) {
        let at =
            |landmark, side: Side| sided(&skeleton.hips[side.index()].landmark(landmark), side);
        let width = |l| (at(l, Side::Left) - at(l, Side::Right)).norm();
        let asis = width(Landmark::Asis);
        let heads = width(Landmark::Fh);
        assert!((205.0..265.0).contains(&asis), "phantom-{n}: ASIS {asis}");
        assert!(
            (165.0..195.0).contains(&heads),
            "phantom-{n}: heads {heads}"
        );
        let r = skeleton.build.head_radius;
        assert!((22.0..=27.0).contains(&r), "phantom-{n}: head radius {r}");
        let asis = at(Landmark::Asis, Side::Left) - at(Landmark::Fh, Side::Left);
        assert!((60.0..95.0).contains(&asis.z), "phantom-{n}: {asis}");
        assert!((-65.0..-35.0).contains(&asis.y), "phantom-{n}: {asis}");
    }
}

#[test]
fn the_joint_space_is_kept_everywhere() {
    for (n, skeleton) in FIRST.zip(SKELETONS.iter()) {
        for side in Side::BOTH {
            let hip = &skeleton.hips[side.index()];
            let femur = &skeleton.femora[side.index()];
            // The femur's surface around the head and the neck, in evenly spread directions.
            let (mut on_head, mut elsewhere) = (f64::INFINITY, f64::INFINITY);
            for i in 0..4000 {
                let z = 1.0 - (f64::from(i) + 0.5) / 2000.0;
                let turn = f64::from(i) * 2.399_963_229_728_653;
                let flat = (1.0 - z * z).sqrt();
                let out = Vector::new(flat * turn.cos(), flat * turn.sin(), z);
                let d = |q: &Point| femur.distance(q);
                let found = super::distance::first_crossing(d, &femur.head, &out, 0.5, 150.0);
                if let Some(p) = found {
                    let d = hip.distance(&p);
                    if (p - femur.head).norm() < femur.head_radius + 0.2 {
                        on_head = on_head.min(d);
                    } else {
                        elsewhere = elsewhere.min(d);
                    }
                }
            }
            let space = skeleton.build.joint_space;
            assert!(
                (on_head - space).abs() < 0.3 && (2.0..4.0).contains(&space),
                "phantom-{n} {side}: joint space {on_head} mm, asked {space}"
            );
            // A lower bound: the hip bone's distance counts the hollow's border above the rim.
            assert!(elsewhere > 1.5, "phantom-{n} {side}: {elsewhere} mm");
        }
    }
}

#[test]
fn labels_are_all_there_and_femur_and_pelvis_do_not_touch() {
    let s = phantom(2, &coarse(1.5));
    let [nx, ny, _] = s.labels.grid.dims;
    let mut counts = [0usize; 4];
    for (offset, &label) in s.labels.data.iter().enumerate() {
        counts[label as usize] += 1;
        if label != Label::Pelvis.value() {
            continue;
        }
        for step in [1, nx, nx * ny] {
            for near in [offset - step, offset + step] {
                assert!(
                    s.labels.data[near] <= Label::Pelvis.value(),
                    "pelvis and femur touch at {:?}",
                    s.labels.grid.voxel(offset)
                );
            }
        }
    }
    let litres = counts.map(|c| c as f64 * 1.5f64.powi(3) / 1e6);
    assert!((0.6..1.4).contains(&litres[1]), "pelvis {} l", litres[1]);
    for femur in [litres[2], litres[3]] {
        assert!((0.12..0.35).contains(&femur), "femur {femur} l");
    }
}

#[test]
fn the_femoral_head_is_a_sphere_about_its_landmark() {
    let s = &*ONE;
    let radius = SKELETONS[0].build.head_radius;
    for side in Side::BOTH {
        let head = lps(s, Landmark::Fh, side);
        for inside in [0.0, 0.5, radius - 2.0] {
            for axis in [-Vector::x(), Vector::y(), -Vector::y(), Vector::z()] {
                let axis = Vector::new(axis.x * side.lateral_sign(), axis.y, axis.z);
                let p = head + axis * inside;
                assert_eq!(s.labels.nearest(&p), Some(Label::femur(side).value()));
            }
        }
        let up = head + Vector::z() * (radius + 1.5);
        assert_ne!(s.labels.nearest(&up), Some(Label::femur(side).value()));
    }
}

#[test]
fn one_can_look_through_the_obturator_foramen() {
    for (n, skeleton) in FIRST.zip(SKELETONS.iter()) {
        for side in Side::BOTH {
            let hip = &skeleton.hips[side.index()];
            let edge = hip.foramen_edge();
            let found = edge.len();
            assert!(
                found > 150,
                "phantom-{n} {side}: bone in {found} of 180 directions"
            );
            let middle =
                Point::from(edge.iter().map(|p| p.coords).sum::<Vector>() / edge.len() as f64);
            let normal = (edge[0] - middle).cross(&(edge[45] - middle)).normalize();
            for t in -80..=80 {
                let p = middle + normal * f64::from(t) * 0.5;
                let d = hip.distance(&p);
                assert!(d > 4.0, "phantom-{n} {side}: {d} mm at {t}");
            }
        }
    }
}

#[test]
fn the_notch_landmark_is_on_the_roof_of_the_greater_sciatic_notch() {
    for (n, skeleton) in FIRST.zip(SKELETONS.iter()) {
        for side in Side::BOTH {
            let hip = &skeleton.hips[side.index()];
            let roof = hip.landmark(Landmark::Gsn);
            assert!(hip.distance(&roof).abs() < 0.05, "phantom-{n} {side}");
            // Seen from the side: bone above and none below, the column before the notch, and the
            // ilium on as a roof, 25 mm behind, over open space.
            let bone = |y: f64, z: f64| {
                let at = |x: i32| roof + Vector::new(f64::from(2 * x), y, z);
                (-12..=12).any(|x| hip.distance(&at(x)) < 0.0)
            };
            let (low, high) = (-8.0, 12.0);
            assert!(bone(0.0, 4.0), "phantom-{n} {side}: none above");
            assert!(bone(-25.0, low), "phantom-{n} {side}: no column before");
            assert!(bone(25.0, high), "phantom-{n} {side}: no ilium behind");
            for y in [4.0, 15.0, 25.0] {
                assert!(!bone(y, low), "phantom-{n} {side}: bone {y} behind");
            }
        }
    }
}

#[test]
fn rims_are_closed_dense_and_on_the_edge() {
    for (n, skeleton) in FIRST.zip(SKELETONS.iter()) {
        for side in Side::BOTH {
            let hip = &skeleton.hips[side.index()];
            let rim = hip.rim();
            for (i, p) in rim.iter().enumerate() {
                let next = rim[(i + 1) % rim.len()];
                let gap = (next - p).norm();
                assert!(gap <= 3.0, "phantom-{n} {side}: {gap} mm at {i}");
                let r = (p - hip.acetabulum.center).norm() - hip.acetabulum.radius;
                assert!((-0.5..8.0).contains(&r), "phantom-{n} {side}: {r} at {i}");
            }
        }
    }
}

#[test]
fn center_edge_angles_are_in_the_asked_range() {
    for n in FIRST {
        let s = phantom(n, &coarse(4.0));
        for side in Side::BOTH {
            let head = lps(&s, Landmark::Fh, side);
            let app = app_from_volume(&s.landmarks, &head).unwrap();
            let sign = side.lateral_sign();
            let edge = s
                .rim(side)
                .iter()
                .map(|p| app * p)
                .max_by(|a, b| (sign * a.x).total_cmp(&(sign * b.x)))
                .unwrap();
            let lce = (sign * edge.x).atan2(edge.y).to_degrees();
            assert!((24.0..40.0).contains(&lce), "{} {side}: {lce}", s.name);
        }
    }
}

#[test]
fn without_asymmetry_the_skeleton_is_symmetric() {
    let parameters = PhantomParameters {
        asymmetry: 0.0,
        table_rotation_sd_deg: 0.0,
        ..Default::default()
    };
    let s = Skeleton::draw(4, &parameters);
    for i in 0..2000 {
        let t = f64::from(i);
        let p = Point::new(
            90.0 + 70.0 * (0.71 * t).sin(),
            20.0 + 80.0 * (0.37 * t).sin(),
            20.0 + 120.0 * (0.53 * t).cos(),
        );
        let q = Point::new(-p.x, p.y, p.z);
        for make in [Bone::Hip, Bone::Femur] {
            let (a, b) = (
                s.exact(make(Side::Left), &p),
                s.exact(make(Side::Right), &q),
            );
            assert!((a - b).abs() < 1e-9, "{a} and {b} at {p}");
        }
    }
}

#[test]
fn threads_change_nothing() {
    let parameters = coarse(4.0);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| phantom(5, &parameters))
    };
    let (a, b) = (with(1), with(3));
    assert_eq!(a.ct, b.ct);
    assert_eq!(a.labels, b.labels);
    assert_eq!(a.landmarks, b.landmarks);
    assert_eq!(a.rims, b.rims);
}

#[test]
fn the_mirror_image_of_the_mirror_image_is_the_body() {
    let s = phantom(3, &coarse(4.0));
    let once = mirror(&s);
    assert_ne!(once.ct.data, s.ct.data);
    let twice = mirror(&once);
    assert_eq!(twice.ct, s.ct);
    assert_eq!(twice.labels, s.labels);
    assert_eq!(twice.landmarks, s.landmarks);
    assert_eq!(twice.rims, s.rims);
    for side in Side::BOTH {
        let head = lps(&once, Landmark::Fh, side);
        assert_eq!(once.labels.nearest(&head), Some(Label::femur(side).value()));
    }
}

#[test]
fn bodies_differ_and_seeds_matter() {
    let distances: Vec<f64> = SKELETONS
        .iter()
        .map(|s| s.hips[0].landmark(Landmark::Asis).x)
        .collect();
    for i in 0..distances.len() {
        for j in 0..i {
            assert!((distances[i] - distances[j]).abs() > 1e-3);
        }
    }
    let women = SKELETONS.iter().filter(|s| s.build.sex.name() == "female");
    assert_eq!(women.count(), 2);
    let other = PhantomParameters {
        seed: 2,
        ..Default::default()
    };
    let again = Skeleton::draw(1, &other).hips[0].landmark(Landmark::Asis).x;
    assert!((again - distances[0]).abs() > 1e-3);
}

//! Each check turns when a body is broken in its way, and few others do.

use super::*;
use crate::anatomy::phantom::{PhantomParameters, phantom};
use crate::anatomy::{Landmark, Landmarks, mirror};
use crate::geometry::{Point, Vector};
use std::sync::LazyLock;

static BODY: LazyLock<Specimen> = LazyLock::new(|| {
    let parameters = PhantomParameters {
        voxel_mm: 2.0,
        ..Default::default()
    };
    phantom(1, &parameters)
});

fn wrong(specimen: &Specimen) -> Vec<String> {
    let wrong = |check: &Check| check.verdict == Verdict::Wrong;
    let checks = check_specimen(&Arc::new(specimen.clone()));
    checks.into_iter().filter(wrong).map(|c| c.what).collect()
}

#[test]
fn a_body_and_its_mirror_image_are_right() {
    assert_eq!(wrong(&BODY), [""; 0]);
    assert_eq!(wrong(&mirror(&BODY)), [""; 0]);
}

#[test]
fn swapped_landmarks_are_seen() {
    let mut body = BODY.clone();
    let mut swapped = Landmarks::default();
    for (landmark, side, point) in BODY.landmarks.iter() {
        swapped.set(landmark, side.opposite(), point);
    }
    body.landmarks = swapped;
    let found = wrong(&body).join("\n");
    for part in [
        "landmarks of the left",
        "left femoral head's centre",
        "APP x",
    ] {
        assert!(found.contains(part), "expected '{part}' in {found}");
    }
}

#[test]
fn swapped_femora_are_seen() {
    let mut body = BODY.clone();
    body.labels = BODY.labels.map(|v| [0, 1, 3, 2][usize::from(v)]);
    let found = wrong(&body).join("\n");
    for part in ["label of the left femur", "left femoral head's centre"] {
        assert!(found.contains(part), "expected '{part}' in {found}");
    }
}

#[test]
fn a_landmark_off_the_bone_and_a_head_off_its_centre_are_seen() {
    let mut body = BODY.clone();
    for (landmark, by) in [(Landmark::Asis, 15.0), (Landmark::Fh, 8.0)] {
        let point = BODY.landmarks.get(landmark, Side::Right).unwrap();
        let moved = point - Vector::y() * by;
        body.landmarks.set(landmark, Side::Right, moved);
    }
    let found = wrong(&body);
    assert_eq!(
        found,
        [
            "right ASIS from bone",
            "right femoral head's centre from the sphere's"
        ]
    );
}

#[test]
fn a_ct_in_other_units_or_elsewhere_is_seen() {
    let mut offset = BODY.clone();
    offset.ct = BODY.ct.map(|hu| hu + 1024);
    assert!(wrong(&offset).join("\n").contains("air"));
    let mut apart = BODY.clone();
    apart.ct.data.rotate_right(40 * BODY.ct.grid.dims[0]);
    assert!(wrong(&apart).join("\n").contains("brighter"));
}

#[test]
fn a_rim_of_the_other_side_is_seen() {
    let mut body = BODY.clone();
    body.rims.swap(0, 1);
    assert!(wrong(&body).join("\n").contains("left rim"));
    let mut flat = BODY.clone();
    flat.rims[1] = flat.rims[1]
        .iter()
        .map(|p| Point::new(p.x, p.y, p.z + 40.0))
        .collect();
    assert!(wrong(&flat).join("\n").contains("right rim"));
}

//! Each check turns when a body is broken in its way, and few others do.

use super::*;
use crate::anatomy::phantom::{PhantomParameters, phantom};
use crate::anatomy::{Landmark, Landmarks, Provenance, Rim, mirror};
use crate::geometry::{Point, Vector};
use crate::volume::morphology::dilate;
use std::sync::LazyLock;

static BODY: LazyLock<Specimen> = LazyLock::new(|| {
    let parameters = PhantomParameters {
        voxel_mm: 2.0,
        ..Default::default()
    };
    phantom(1, &parameters)
});

/// What a whole body gets at 2 mm.
static SOUND: LazyLock<Vec<String>> = LazyLock::new(|| turned(&BODY, Verdict::Doubtful));

/// Checks that come out so or worse.
fn turned(specimen: &Specimen, verdict: Verdict) -> Vec<String> {
    let checks = check_specimen(&Arc::new(specimen.clone()));
    for check in &checks {
        assert!(!check.advice.is_empty(), "{} has no advice", check.what);
    }
    let bad = checks.into_iter().filter(|check| check.verdict >= verdict);
    bad.map(|check| check.what).collect()
}

fn wrong(specimen: &Specimen) -> Vec<String> {
    turned(specimen, Verdict::Wrong)
}

/// All of `wrong` and `doubtful`, parts of checks' names, turn, and nothing but they.
fn assert_turned(body: &Specimen, wrong: &[&str], doubtful: &[&str]) {
    let mut found = turned(body, Verdict::Doubtful);
    found.retain(|what| !SOUND.contains(what));
    for part in wrong.iter().chain(doubtful) {
        assert!(
            found.iter().any(|what| what.contains(part)),
            "expected '{part}' in {found:#?}"
        );
    }
    for what in &found {
        assert!(
            wrong.iter().chain(doubtful).any(|part| what.contains(part)),
            "'{what}' turned, too: {found:#?}"
        );
    }
    let found = super::tests::wrong(body);
    for part in wrong {
        assert!(
            found.iter().any(|what| what.contains(part)),
            "expected '{part}' to be wrong in {found:#?}"
        );
    }
}

fn relabelled(change: impl Fn(&Point, u8) -> u8) -> Specimen {
    let mut body = BODY.clone();
    let grid = &BODY.labels.grid;
    for (offset, label) in body.labels.data.iter_mut().enumerate() {
        *label = change(&grid.center(grid.voxel(offset)), *label);
    }
    body
}

/// The label map moved along LPS x, as a wrong origin in its file moves it, on the CT's grid.
fn shifted(mm: f64) -> Specimen {
    relabelled(|p, _| BODY.labels.nearest(&(p - Vector::x() * mm)).unwrap_or(0))
}

fn at(landmark: Landmark, side: Side) -> Point {
    BODY.landmarks.get(landmark, side).unwrap()
}

#[test]
fn a_body_and_its_mirror_image_are_right() {
    assert_eq!(wrong(&BODY), [""; 0]);
    assert_eq!(wrong(&mirror(&BODY)), [""; 0]);
    assert_eq!(*SOUND, ["largest edge of a voxel"]);
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
    let body = relabelled(|_, label| [0, 1, 3, 2][usize::from(label)]);
    let found = wrong(&body).join("\n");
    for part in ["label of the left femur", "left femoral head's centre"] {
        assert!(found.contains(part), "expected '{part}' in {found}");
    }
}

#[test]
fn a_mirrored_label_map_is_seen() {
    let middle = nalgebra::center(
        &at(Landmark::Fh, Side::Left),
        &at(Landmark::Fh, Side::Right),
    );
    let body = relabelled(|p, _| {
        let q = Point::new(2.0 * middle.x - p.x, p.y, p.z);
        BODY.labels.nearest(&q).unwrap_or(0)
    });
    let found = wrong(&body).join("\n");
    for part in ["label of the left femur", "left femoral head's centre"] {
        assert!(found.contains(part), "expected '{part}' in {found}");
    }
}

#[test]
fn landmarks_in_ras_are_seen() {
    let mut body = BODY.clone();
    for (landmark, side, p) in BODY.landmarks.iter() {
        body.landmarks
            .set(landmark, side, Point::new(-p.x, -p.y, p.z));
    }
    let found = wrong(&body).join("\n");
    for part in ["landmarks of the left", "APP x", "left ASIS from bone"] {
        assert!(found.contains(part), "expected '{part}' in {found}");
    }
}

#[test]
fn a_label_map_half_a_voxel_off_is_seen() {
    // Half a voxel of the nearest neighbours' is a whole one; the CT is moved by interpolation.
    let mut body = BODY.clone();
    let grid = &BODY.ct.grid;
    let half = grid.spacing[0] / 2.0;
    for (offset, hu) in body.ct.data.iter_mut().enumerate() {
        let from = grid.center(grid.voxel(offset)) + Vector::new(half, half, half);
        *hu = crate::volume::cubic::cubic(&BODY.ct, &grid.index(&from)).round() as i16;
    }
    assert_turned(&body, &[], &["labels beside the CT's edges"]);
}

#[test]
fn a_label_map_three_voxels_off_is_seen() {
    assert_turned(
        &shifted(6.0),
        &[
            "labels beside the CT's edges",
            "head's centre from the sphere's",
        ],
        &["from bone", "bone beside", "brighter", "right rim on bone"],
    );
}

#[test]
fn a_landmark_off_the_bone_and_a_head_off_its_centre_are_seen() {
    let mut body = BODY.clone();
    for (landmark, by) in [(Landmark::Asis, 15.0), (Landmark::Fh, 8.0)] {
        let moved = at(landmark, Side::Right) - Vector::y() * by;
        body.landmarks.set(landmark, Side::Right, moved);
    }
    assert_turned(
        &body,
        &[
            "right ASIS from bone",
            "right femoral head's centre from the sphere's",
        ],
        &["right rim's middle"],
    );
}

#[test]
fn a_landmark_on_the_wrong_piece_of_bone_is_seen() {
    let mut body = BODY.clone();
    let crest = at(Landmark::Asis, Side::Left) + Vector::new(8.0, 30.0, 30.0);
    let labels = &BODY.labels;
    let surface = Surface::from_mask(labels, |v| v == 1, &Default::default());
    let (crest, _) = surface.closest_point(&crest).unwrap();
    body.landmarks.set(Landmark::Asis, Side::Left, crest);
    assert_turned(&body, &[], &["ASIS to FH, left and right"]);
}

#[test]
fn a_landmark_of_low_confidence_is_named() {
    let mut body = BODY.clone();
    let side = Side::Left;
    let unsure = Provenance::detected(9.0);
    body.landmarks
        .set_with(Landmark::Mof, side, at(Landmark::Mof, side), unsure);
    assert_turned(&body, &[], &["low confidence"]);
}

#[test]
fn a_ct_in_other_units_or_elsewhere_is_seen() {
    let mut offset = BODY.clone();
    offset.ct = BODY.ct.map(|hu| hu + 1024);
    assert_turned(
        &offset,
        &["air", "mean density"],
        &["dense bone", "bone beside", "body at the CT's sides"],
    );
    let mut clipped = BODY.clone();
    clipped.ct = BODY.ct.map(|hu| hu.min(500));
    assert_turned(&clipped, &[], &["dense bone"]);
    let mut apart = BODY.clone();
    apart.ct.data.rotate_right(40 * BODY.ct.grid.dims[0]);
    assert!(wrong(&apart).join("\n").contains("brighter"));
}

#[test]
fn labels_two_voxels_too_thick_and_one_too_thin_are_seen() {
    let mut thick = BODY.clone();
    for label in [1, 2, 3] {
        let grown = dilate(&BODY.labels.map(|l| l == label), 4.1);
        for (to, inside) in thick.labels.data.iter_mut().zip(grown.data) {
            if inside && *to == 0 {
                *to = label;
            }
        }
    }
    assert_turned(
        &thick,
        &["touching the pelvis"],
        &[
            "labels' surface outside",
            "head's centre from the sphere's",
            "rim on bone",
            "holes inside the pelvis",
        ],
    );
    let core = dilate(&BODY.labels.map(|l| l != 1), 2.5);
    let mut thin = BODY.clone();
    for (label, outside) in thin.labels.data.iter_mut().zip(core.data) {
        if outside && *label == 1 {
            *label = 0;
        }
    }
    assert_turned(
        &thin,
        &[],
        &[
            "bone beside the pelvis's label",
            "pelvis outside its 3",
            "left rim on bone",
        ],
    );
}

#[test]
fn a_swollen_head_is_seen() {
    let head = at(Landmark::Fh, Side::Left);
    let body = relabelled(|p, label| match label == 0 && (p - head).norm() < 27.0 {
        true => 2,
        false => label,
    });
    assert_turned(
        &body,
        &[],
        &["femoral heads' radii", "left femur touching the pelvis"],
    );
}

#[test]
fn a_hole_and_an_island_are_seen() {
    let head = at(Landmark::Fh, Side::Left);
    let hollow = relabelled(|p, label| match (p - head).norm() < 6.0 {
        true => 0,
        false => label,
    });
    let own = "left femoral head's centre";
    assert_turned(&hollow, &[own], &["holes inside the left femur"]);
    let beside = at(Landmark::Asis, Side::Right) - Vector::new(0.0, 20.0, 0.0);
    let island = relabelled(|p, label| match (p - beside).norm() < 7.0 {
        true => 1,
        false => label,
    });
    assert_turned(&island, &[], &["pelvis outside its 3 largest pieces"]);
}

#[test]
fn a_label_that_lacks_bone_is_seen() {
    // The wing of the ilium above the left ASIS.
    let asis = at(Landmark::Asis, Side::Left);
    let body = relabelled(
        |p, label| match label == 1 && p.x > 0.0 && p.z > asis.z + 5.0 {
            true => 0,
            false => label,
        },
    );
    assert_turned(
        &body,
        &[],
        &[
            "left ilium above the head's centre",
            "bone beside the pelvis's label",
        ],
    );
}

#[test]
fn short_femora_and_a_narrow_ct_are_seen() {
    let head = at(Landmark::Fh, Side::Left);
    let short = relabelled(|p, label| match label == 2 && p.z < head.z - 90.0 {
        true => 0,
        false => label,
    });
    assert_turned(&short, &[], &["left femur below the head's centre"]);
    let mut narrow = BODY.clone();
    let [ni, nj, nk] = BODY.ct.grid.dims;
    let (first, _) = BODY.labels.bounds(|l| l == 1).unwrap();
    let (low, high) = ([0, first[1], 0], [ni - 1, nj - 1, nk - 1]);
    narrow.ct = BODY.ct.cropped(low, high);
    narrow.labels = BODY.labels.cropped(low, high);
    assert_turned(
        &narrow,
        &[],
        &["body at the CT's sides", "pelvis at the CT's border"],
    );
}

#[test]
fn a_rim_of_the_other_side_is_seen() {
    let mut body = BODY.clone();
    body.rims.swap(0, 1);
    assert!(wrong(&body).join("\n").contains("left rim"));
    let moved = |by: Vector| BODY.rims[1].iter().map(|p| p + by).collect::<Rim>();
    let mut high = BODY.clone();
    high.rims[1] = moved(Vector::z() * 40.0);
    assert!(wrong(&high).join("\n").contains("right rim"));
    let head = at(Landmark::Fh, Side::Right);
    let mut wide = BODY.clone();
    wide.rims[1] = BODY.rims[1]
        .iter()
        .map(|p| head + (p - head) * 1.35)
        .collect();
    assert_turned(&wide, &[], &["right rim"]);
}

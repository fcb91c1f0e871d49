//! Landmarks found by rule on the built-in phantom, beside its own, with slices of 1, 2 and 3 mm.

mod bones;

use bones::{Masks, apart, asymmetry, surfaces};
use pao_sim::anatomy::detect::{Detected, detect};
use pao_sim::anatomy::{Found, Label, Landmark, PhantomParameters, Side, Specimen, phantom};
use pao_sim::geometry::{Point, Vector};
use pao_sim::volume::Surface;
use pao_sim::volume::components::components;
use std::sync::LazyLock;

/// The joints of the phantom's pelvis are open, so its label falls into its bones.
fn masks(body: &Specimen) -> Masks {
    let found = components(&body.labels.map(|v| v == Label::Pelvis.value()));
    let mut numbers: Vec<u32> = (1..=found.sizes.len() as u32).collect();
    numbers.sort_by_key(|n| std::cmp::Reverse(found.sizes[*n as usize - 1]));
    let mut bones: Vec<_> = numbers[..3]
        .iter()
        .map(|n| {
            let mask = found.mask(*n);
            let (min, max) = mask.bounds(|inside| inside).unwrap();
            let middle = mask.grid.center(min).x + mask.grid.center(max).x;
            (middle, mask)
        })
        .collect();
    bones.sort_by(|a, b| a.0.total_cmp(&b.0));
    let femur = |side| body.labels.map(|v| v == Label::femur(side).value());
    let [(_, right), (_, sacrum), (_, left)] = bones.try_into().unwrap();
    [sacrum, left, right, femur(Side::Left), femur(Side::Right)]
}

fn made(number: u32) -> (Specimen, Masks) {
    let body = phantom(number, &PhantomParameters::default());
    let masks = masks(&body);
    (body, masks)
}

static ONE: LazyLock<(Specimen, Masks)> = LazyLock::new(|| made(1));

/// Prints every distance; returns (landmark, distance, uncertainty).
fn compare(body: &Specimen, masks: &Masks) -> Vec<(String, f64, f64)> {
    let mut all = Vec::new();
    for thickness in 1..=3 {
        let found = detect(&surfaces(masks, thickness)).unwrap();
        let mut line = Vec::new();
        for landmark in Landmark::ALL {
            for side in Side::BOTH {
                let truth = body.landmarks.get(landmark, side).unwrap();
                let distance = (found.landmarks.get(landmark, side).unwrap() - truth).norm();
                let from = found.landmarks.provenance(landmark, side).unwrap();
                let uncertainty = from.uncertainty_mm.unwrap();
                let key = landmark.key(side);
                line.push(format!("{key} {distance:.1} ({uncertainty:.1})"));
                all.push((key, distance, uncertainty));
            }
        }
        for side in Side::BOTH {
            let (mean, most) = apart(found.rims[side.index()].as_ref().unwrap(), body.rim(side));
            line.push(format!("{side} rim {mean:.1} (most {most:.1})"));
        }
        println!("{}, {thickness} mm slices: {}", body.name, line.join(", "));
        let pairs = Landmark::ALL.into_iter().zip(asymmetry(&found));
        let line: Vec<String> = pairs
            .map(|(landmark, mm)| format!("{} {mm:.1}", landmark.name()))
            .collect();
        println!("    left from mirrored right: {} mm", line.join(", "));
    }
    all
}

/// Those that the phantom defines as the rules do. Its foramen is smooth, so that its lowest point is
/// no corner, and its GSN is the notch's roof, where the rule takes its depth.
const ALIKE: [Landmark; 5] = [
    Landmark::Asis,
    Landmark::Aiis,
    Landmark::Fh,
    Landmark::Sps,
    Landmark::Ips,
];

#[test]
fn the_phantoms_own_landmarks_are_found_with_slices_of_1_to_3_mm() {
    for (key, distance, uncertainty) in compare(&ONE.0, &ONE.1) {
        if ALIKE.iter().any(|l| key.starts_with(l.name())) {
            assert!(distance < 5.0, "{key} {distance:.1} mm");
            assert!(
                distance < 2.5 * uncertainty + 0.3,
                "{key} {distance:.1} of {uncertainty:.1}"
            );
        }
    }
}

#[test]
fn everything_found_says_how_surely() {
    let found = detect(&surfaces(&ONE.1, 1)).unwrap();
    for landmark in Landmark::ALL {
        for side in Side::BOTH {
            let from = found.landmarks.provenance(landmark, side).unwrap();
            assert_eq!(from.found, Some(Found::Detected));
            let mm = from.uncertainty_mm.unwrap();
            let expected = match landmark {
                Landmark::Fh => 0.01..0.5,
                _ => 0.5..15.0,
            };
            assert!(expected.contains(&mm), "{landmark:?} {side}: {mm}");
        }
    }
    for rim in &found.rims {
        let mm = rim.as_ref().unwrap().provenance.uncertainty_mm.unwrap();
        assert!((0.2..6.0).contains(&mm), "{mm}");
    }
}

/// A spine that is filed off is as uncertain as its new face is wide.
#[test]
fn a_blunt_spine_is_less_certain() {
    let whole = surfaces(&ONE.1, 1);
    let before = detect(&whole).unwrap();
    let at = before.landmarks.get(Landmark::Asis, Side::Left).unwrap();
    let forward = -Vector::y();
    let filed = |p: &Point| {
        let beyond = (p - at).dot(&forward) + 4.0;
        match (p - at).norm() < 40.0 && beyond > 0.0 {
            true => p - forward * beyond,
            false => *p,
        }
    };
    let mut bones = whole.clone();
    let hip = &whole.hips[0];
    bones.hips[0] = Surface::new(
        hip.vertices().iter().map(filed).collect(),
        hip.triangles().to_vec(),
    );
    let after = detect(&bones).unwrap();
    let uncertainty = |of: &Detected, side| {
        let from = of.landmarks.provenance(Landmark::Asis, side).unwrap();
        from.uncertainty_mm.unwrap()
    };
    let [sharp, blunt] = [&before, &after].map(|of| uncertainty(of, Side::Left));
    assert!(blunt > 1.25 * sharp, "{sharp} and {blunt}");
}

/// The table of docs/specimens.md.
#[test]
#[ignore = "minutes"]
fn all_six_phantoms() {
    for number in 1..=6 {
        let (body, masks) = made(number);
        compare(&body, &masks);
    }
}

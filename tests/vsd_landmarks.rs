//! Landmarks found by rule on the bones of six people, beside those that five raters placed on
//! the same bones.

mod bones;
mod data;

use bones::{apart, asymmetry, rank_correlation, surfaces, voxelized};
use data::SUBJECTS;
use pao_sim::anatomy::detect::{Detected, Extra, detect};
use pao_sim::anatomy::surfaces::read_bone_surfaces;
use pao_sim::anatomy::{Landmark, Side};
use pao_sim::geometry::Point;
use std::collections::BTreeMap;

/// Mean (LPS) and standard deviation over all axes of one landmark of one subject.
fn raters(all: &serde_json::Value, subject: &str, side: Side, name: &str) -> (Point, f64) {
    let prefix = match side {
        Side::Left => "Left",
        Side::Right => "Right",
    };
    let entry = &all["Pelvis"][subject][format!("{prefix} {name}")];
    let three = |field: &str| -> [f64; 3] {
        std::array::from_fn(|axis| entry[field][axis].as_f64().expect("three numbers"))
    };
    let [x, y, z] = three("mean_mm");
    let sd = three("sd_mm").iter().map(|s| s * s).sum::<f64>().sqrt();
    (Point::new(-x, -y, z), sd)
}

#[test]
fn landmarks_lie_where_raters_place_them() {
    let Some(data) = data::vsd() else { return };
    let text = std::fs::read_to_string(data.join("landmarks.json")).unwrap();
    let all: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut worst = Vec::new();
    let (mut distances, mut scatters, mut uncertainties) = (Vec::new(), Vec::new(), Vec::new());
    println!("subject side landmark distance_mm rater_sd_mm uncertainty_mm limit_mm");
    for subject in SUBJECTS {
        let bones = read_bone_surfaces(&data.join(subject)).unwrap();
        let found = detect(&bones).unwrap();
        for side in Side::BOTH {
            let uncertainty = |landmark| {
                let from = found.landmarks.provenance(landmark, side).unwrap();
                from.uncertainty_mm.unwrap()
            };
            let at = |landmark| Extra {
                point: found.landmarks.get(landmark, side).unwrap(),
                uncertainty_mm: uncertainty(landmark),
            };
            for (
                name,
                Extra {
                    point,
                    uncertainty_mm,
                },
            ) in [
                ("ASIS", at(Landmark::Asis)),
                ("AIIS", at(Landmark::Aiis)),
                (
                    "Pubic Tubercle (PT)",
                    found.pubic_tubercles[side.index()].unwrap(),
                ),
                (
                    "Ischial Spine (IS)",
                    found.ischial_spines[side.index()].unwrap(),
                ),
            ] {
                let (mean, sd) = raters(&all, subject, side, name);
                let (distance, limit) = ((point - mean).norm(), (2.0 * sd).max(5.0));
                println!(
                    "{subject} {side} {name} {distance:.1} {sd:.1} {uncertainty_mm:.1} {limit:.1}"
                );
                distances.push(distance);
                scatters.push(sd);
                uncertainties.push(uncertainty_mm);
                if distance > limit {
                    worst.push(format!(
                        "{subject} {side} {name}: {distance:.1} of {limit:.1} mm"
                    ));
                }
            }
            let head = found.heads[side.index()].unwrap();
            let rim = found.rims[side.index()].as_ref().unwrap();
            println!(
                "{subject} {side} head radius {:.2} rms {:.2} mm, {} vertices; rim {} points, {:.1} mm",
                head.radius_mm,
                head.rms_mm,
                head.vertices,
                rim.len(),
                rim.provenance.uncertainty_mm.unwrap()
            );
            let all = Landmark::ALL.map(|l| format!("{} {:.1}", l.name(), uncertainty(l)));
            println!("{subject} {side} uncertainties: {}", all.join(", "));
            assert!(head.rms_mm < 1.0, "{subject} {side}");
        }
    }
    assert!(worst.is_empty(), "{worst:#?}");
    calibrated(&distances, &scatters, &uncertainties);
}

/// Uncertainties rank landmarks as the raters' scatter and the distances do, and are of their size.
fn calibrated(distances: &[f64], scatters: &[f64], uncertainties: &[f64]) {
    let with_scatter = rank_correlation(uncertainties, scatters);
    let with_distance = rank_correlation(uncertainties, distances);
    let raters = rank_correlation(scatters, distances);
    let size = |values: &[f64]| {
        let squares = values
            .iter()
            .zip(uncertainties)
            .map(|(v, u)| (v / u).powi(2));
        (squares.sum::<f64>() / values.len() as f64).sqrt()
    };
    let beyond = distances
        .iter()
        .zip(uncertainties)
        .filter(|(d, u)| *d > *u)
        .count();
    println!(
        "rank correlation of uncertainty with scatter {with_scatter:.2}, with distance {with_distance:.2} \
         (scatter with distance {raters:.2}); RMS of distance / uncertainty {:.2}, of scatter / uncertainty \
         {:.2}; {beyond} of {} farther than the uncertainty",
        size(distances),
        size(scatters),
        distances.len()
    );
    assert!(with_scatter > 0.5, "{with_scatter}");
    // Between the rule's place and the mean of five raters there is little left to tell.
    assert!(with_distance > 0.0, "{with_distance}");
    assert!((0.4..1.0).contains(&size(distances)));
    assert!((0.8..1.2).contains(&size(scatters)));
}

/// What thicker slices of the same bones do, and how symmetric the landmarks are.
#[test]
fn landmarks_bear_thick_slices_and_mirror_each_other() {
    let Some(data) = data::vsd() else { return };
    let mut moves = Vec::new();
    let mut fine: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for subject in SUBJECTS {
        let bones = read_bone_surfaces(&data.join(subject)).unwrap();
        let found = detect(&bones).unwrap();
        let pairs = Landmark::ALL.into_iter().zip(asymmetry(&found));
        let line: Vec<String> = pairs
            .map(|(landmark, mm)| format!("{} {mm:.1}", landmark.name()))
            .collect();
        println!("{subject} left from mirrored right: {} mm", line.join(", "));
        let masks = voxelized(&bones);
        for thickness in 1..=3 {
            let again = detect(&surfaces(&masks, thickness)).unwrap();
            let mut line = Vec::new();
            for landmark in Landmark::ALL {
                for side in Side::BOTH {
                    let at = |of: &Detected| of.landmarks.get(landmark, side).unwrap();
                    let moved = (at(&again) - at(&found)).norm();
                    line.push(format!("{} {moved:.1}", landmark.key(side)));
                    if thickness == 1 {
                        fine.entry(landmark.name()).or_default().push(moved);
                    }
                    let from = found.landmarks.provenance(landmark, side).unwrap();
                    let uncertainty_mm = from.uncertainty_mm.unwrap();
                    // The head's sphere is surer than slices of voxels are.
                    if landmark != Landmark::Fh {
                        moves.push(moved / uncertainty_mm);
                    } else {
                        assert!(moved < 0.5, "{subject} {side} {thickness} mm: {moved}");
                    }
                }
            }
            for side in Side::BOTH {
                let rim = |of: &Detected| of.rims[side.index()].clone().unwrap();
                let (mean, most) = apart(&rim(&again), &rim(&found));
                line.push(format!("{side} rim {mean:.1} (most {most:.1})"));
            }
            println!("{subject} {thickness} mm slices: {}", line.join(", "));
        }
    }
    // A specimen comes out the same from surfaces and from voxels of them.
    for (landmark, moved) in fine {
        let mean = moved.iter().sum::<f64>() / moved.len() as f64;
        let most = moved.iter().copied().fold(0.0, f64::max);
        println!("surfaces and 1 mm voxels: {landmark} {mean:.2} mm apart, {most:.2} at most");
        assert!(mean < 0.4 && most < 0.8, "{landmark}: {mean}, {most} mm");
    }
    let square = moves.iter().map(|m| m * m).sum::<f64>() / moves.len() as f64;
    let far = moves.iter().filter(|m| **m > 2.0).count();
    println!(
        "moved by thick slices: RMS {:.2} uncertainties, {far} of {} by more than two",
        square.sqrt(),
        moves.len()
    );
    assert!(square.sqrt() < 0.3 && far == 0);
}

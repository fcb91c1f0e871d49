//! Landmarks found by rule on the bones of six people, beside those that five raters placed on
//! the same bones.

mod data;

use data::SUBJECTS;
use pao_sim::anatomy::detect::detect;
use pao_sim::anatomy::surfaces::read_bone_surfaces;
use pao_sim::anatomy::{Landmark, Side};
use pao_sim::geometry::Point;

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
    println!("subject side landmark distance_mm rater_sd_mm limit_mm");
    for subject in SUBJECTS {
        let bones = read_bone_surfaces(&data.join(subject)).unwrap();
        let found = detect(&bones).unwrap();
        for side in Side::BOTH {
            let at = |landmark| found.landmarks.get(landmark, side).unwrap();
            for (name, point) in [
                ("ASIS", at(Landmark::Asis)),
                ("AIIS", at(Landmark::Aiis)),
                ("Pubic Tubercle (PT)", found.pubic_tubercles[side.index()]),
                ("Ischial Spine (IS)", found.ischial_spines[side.index()]),
            ] {
                let (mean, sd) = raters(&all, subject, side, name);
                let (distance, limit) = ((point - mean).norm(), (2.0 * sd).max(5.0));
                println!("{subject} {side} {name} {distance:.1} {sd:.1} {limit:.1}");
                if distance > limit {
                    worst.push(format!(
                        "{subject} {side} {name}: {distance:.1} of {limit:.1} mm"
                    ));
                }
            }
            let head = found.heads[side.index()];
            let rim = &found.rims[side.index()];
            println!(
                "{subject} {side} head radius {:.2} rms {:.2} mm, {} vertices; rim {} points",
                head.radius_mm,
                head.rms_mm,
                head.vertices,
                rim.len()
            );
            assert!(head.rms_mm < 1.0, "{subject} {side}");
        }
    }
    assert!(worst.is_empty(), "{worst:#?}");
}

//! Milliseconds a DRR, of a pelvis, a femur and a fragment by size and shape, on one thread, by both
//! projectors: `cargo bench --bench projector`. Prints minima over interleaved rounds (`ROUNDS`, 9),
//! since a shared machine only ever makes things slower. `PITCH_PX` (1) is the pitch of `slice` and
//! `BATCH` (8) the number of poses that are projected at once, all within 2 deg of the one named.
//! `ONLY="avx512   slice"` leaves out all cases without these words. `CHECK=1` compares each image of the pelvis with a finely stepped integral first (minutes).

mod measure;
mod synthetic;

use measure::{setting, thread_seconds};
use nalgebra::UnitQuaternion;
use pao_sim::geometry::{Rigid, Vector};
use pao_sim::xray::{BoneVolume, Camera, PixelRect, ProjectorParameters, SimdLevel, reference};
use std::rc::Rc;
use synthetic::{bones, pose};

/// Poses about one, as in a population.
fn about(pose: &Rigid, count: usize) -> Vec<Rigid> {
    let turn = |n: usize| {
        let angle = |k: usize| ((n * k) as f64).sin() * 0.02;
        UnitQuaternion::from_scaled_axis(Vector::new(angle(1), angle(2), angle(3)))
    };
    (0..count)
        .map(|n| Rigid::from_parts(pose.translation, turn(n) * pose.rotation))
        .collect()
}

fn image(bone: &BoneVolume, camera: &Camera, pose: &Rigid, by: &ProjectorParameters) -> Vec<f32> {
    let mut image = vec![0.0; camera.width * camera.height];
    let mut touched = [PixelRect::EMPTY];
    by.projector()
        .project_add(bone, camera, &[*pose], None, &mut image, &mut touched);
    image
}

fn main() {
    let full = Camera::cios_fusion().cropped(50);
    let cameras = [("1/8", full.reduced(0.125)), ("1/4", full.reduced(0.25))];
    let bones = bones();
    for (name, bone) in &bones {
        let mu = bone.attenuation();
        let occupied = mu.data.iter().filter(|&&v| v > 0.0).count();
        println!(
            "{name}: {:?} voxels, {:.1} % occupied",
            mu.grid.dims,
            100.0 * occupied as f64 / mu.data.len() as f64
        );
    }
    let poses = [
        ("AP", pose(0.0, 0.0)),
        ("oblique", pose(-12.0, 8.0)),
        ("orbit 45", pose(45.0, 3.0)),
        ("lateral", pose(90.0, 0.0)),
    ];
    let pitch_px = std::env::var("PITCH_PX").ok().and_then(|p| p.parse().ok());
    let projectors = [
        ("ray_cast", ProjectorParameters::RayCast { step_mm: 1.0 }),
        (
            "slice",
            ProjectorParameters::Slice {
                pitch_px: pitch_px.unwrap_or(1.0),
            },
        ),
    ];
    if setting("CHECK", 0) == 1 {
        println!("| pose | projector | RMS | largest (% of the image's maximum) |");
        for (pose_name, pose) in &poses {
            let (camera, bone) = (&cameras[0].1, &bones[0].1);
            let exact = reference::line_integrals(bone.attenuation(), camera, pose, 0.125);
            let largest = exact.data.iter().fold(0.0f64, |a, &b| a.max(b));
            for (name, projector) in &projectors {
                let image = image(bone, camera, pose, projector);
                let differences = image.iter().zip(&exact.data);
                let differences = differences.map(|(&a, b)| 100.0 * (f64::from(a) - b) / largest);
                let (mut squares, mut worst) = (0.0, 0.0f64);
                for d in differences {
                    squares += d * d;
                    worst = worst.max(d.abs());
                }
                let rms = (squares / exact.data.len() as f64).sqrt();
                println!("| {pose_name} | {name} | {rms:.4} | {worst:.3} |");
            }
        }
    }
    let count = setting("BATCH", 8);
    let only = std::env::var("ONLY").ok();
    let mut cases = Vec::new();
    for level in SimdLevel::available() {
        for (bone_name, bone) in &bones {
            let bone = Rc::new(bone.clone().with_simd(level));
            for (scale, camera) in &cameras {
                for (pose_name, pose) in &poses {
                    for (projector_name, parameters) in &projectors {
                        let name = format!(
                            "{:8} {projector_name:8} {scale} {bone_name:8} {pose_name:8}",
                            level.name()
                        );
                        if !only.as_deref().is_none_or(|only| name.contains(only)) {
                            continue;
                        }
                        let poses = about(pose, count);
                        let projector = parameters.projector();
                        let bone = Rc::clone(&bone);
                        cases.push((name, bone, camera, poses, projector, f64::INFINITY));
                    }
                }
            }
        }
    }
    for _ in 0..setting("ROUNDS", 9) {
        for (_, bone, camera, poses, projector, best) in &mut cases {
            let mut out = vec![0.0f32; poses.len() * camera.width * camera.height];
            let mut touched = vec![PixelRect::EMPTY; poses.len()];
            // Thrice, as a registration projects one bone many times in a row.
            for _ in 0..3 {
                let start = thread_seconds();
                projector.project_add(bone, camera, poses, None, &mut out, &mut touched);
                *best = best.min((thread_seconds() - start) * 1e3 / poses.len() as f64);
                std::hint::black_box(&out);
            }
        }
    }
    for (name, .., best) in &cases {
        println!("{name} {best:8.3} ms");
    }
}

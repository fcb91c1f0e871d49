//! Milliseconds a DRR, of a pelvis, a femur and a fragment by size and shape, on one thread:
//! `cargo bench --bench projector`. Prints minima over interleaved rounds (`ROUNDS`, 9), since a
//! shared machine only ever makes things slower.

mod synthetic;

use pao_sim::xray::{Camera, PixelRect, SimdLevel};
use std::rc::Rc;
use synthetic::{bones, pose};

/// Processor time of this thread, which other processes on a shared machine add little to.
fn processor_seconds() -> f64 {
    let mut time = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: the call writes to the structure that it is given.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &mut time) };
    assert_eq!(
        status, 0,
        "the system has no clock of a thread's processor time"
    );
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
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
    let rounds = std::env::var("ROUNDS")
        .ok()
        .and_then(|r| r.parse().ok())
        .unwrap_or(9);
    let mut cases = Vec::new();
    for level in SimdLevel::available() {
        for (bone_name, bone) in &bones {
            let bone = Rc::new(bone.clone().with_simd(level));
            for (scale, camera) in &cameras {
                for (pose_name, pose) in &poses {
                    let name = format!("{} {scale} {bone_name} {pose_name}", level.name());
                    cases.push((name, Rc::clone(&bone), camera, pose, f64::INFINITY));
                }
            }
        }
    }
    for _ in 0..rounds {
        for (_, bone, camera, pose, best) in &mut cases {
            let mut out = vec![0.0f32; camera.width * camera.height];
            let rect = bone.footprint(camera, pose).unwrap_or(PixelRect::EMPTY);
            // Thrice, as a registration projects one bone many times in a row.
            for _ in 0..3 {
                let start = processor_seconds();
                bone.project_add(camera, pose, 1.0, rect, &mut out);
                *best = best.min((processor_seconds() - start) * 1e3);
                std::hint::black_box(&out);
            }
        }
    }
    for (name, .., best) in &cases {
        println!("{name:35} {best:8.3} ms");
    }
}

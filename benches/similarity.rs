//! Time of the similarity at the sizes of the paper, on one thread:
//! `cargo bench --bench similarity [-- REPEATS]`.
//!
//! Prints the least time of interleaved repeats: on a shared machine everything else only adds.

use pao_sim::image::Image;
use pao_sim::objective::{Comparison, FixedView};
use pao_sim::simd::SimdLevel;
use pao_sim::xray::Camera;
use std::time::{Duration, Instant};

/// Overlapping blobs on zero, and noise on all of it.
fn image(size: usize, shift: f64, noise: f32) -> Image<f32> {
    let mut image = Image::filled(size, size, 0.0f32);
    let mut state = 12_345u32;
    for (i, value) in image.data.iter_mut().enumerate() {
        let (x, y) = (
            (i % size) as f64 / size as f64,
            (i / size) as f64 / size as f64,
        );
        let mut sum = 0.0;
        for k in 0..12 {
            let k = f64::from(k);
            let (cx, cy) = (
                0.5 + 0.3 * (2.4 * k + shift).sin(),
                0.5 + 0.3 * (1.7 * k).cos(),
            );
            let d = (x - cx).hypot(y - cy) / (0.04 + 0.01 * k);
            sum += (1.0 - d * d).max(0.0);
        }
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *value = sum as f32 + noise * (state >> 8) as f32 / (1 << 24) as f32;
    }
    image
}

fn main() {
    let repeats: usize = std::env::args()
        .skip(1)
        .find_map(|argument| argument.parse().ok())
        .unwrap_or(200);
    let cases: Vec<_> = [(180, 0.125), (359, 0.25)]
        .into_iter()
        .map(|(size, factor)| {
            let camera = Camera::centered(size, 0.194 / factor, 1020.0);
            let fixed = FixedView::new(image(size, 0.0, 0.1), camera, 83, factor)
                .expect("the image fits its camera and its patches");
            (fixed, image(size, 0.1, 0.0))
        })
        .collect();
    let mut scratch: Vec<_> = cases
        .iter()
        .flat_map(|case| SimdLevel::available().map(move |level| (case, level)))
        .map(|(case, level)| {
            (
                case,
                level,
                Comparison::new(&case.0, level),
                Duration::MAX,
                0.0,
            )
        })
        .collect();
    for _ in 0..repeats {
        for ((fixed, moving), _, comparison, least, cost) in &mut scratch {
            let start = Instant::now();
            *cost = comparison.similarity(fixed, &moving.data);
            *least = start.elapsed().min(*least);
        }
    }
    println!("| image | patch | level | ms | ns a pixel | cost |\n|---|---|---|---|---|---|");
    for ((fixed, _), level, _, least, cost) in scratch {
        let size = fixed.camera().width;
        let seconds = least.as_secs_f64();
        println!(
            "| {size} x {size} | {} px | {} | {:.3} | {:.2} | {cost:.9} |",
            fixed.patch_diameter_px(),
            level.name(),
            seconds * 1e3,
            seconds * 1e9 / (size * size) as f64,
        );
    }
}

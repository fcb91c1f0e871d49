//! The plain loop: one ray after the other, leaping over empty cells.

use super::KernelVolume;
use super::occupancy::Occupancy;
use crate::xray::PixelRect;
use crate::xray::rays::{IndexRays, samples_between};

/// Adds the line integrals of `rays` to the pixels `rect` of `out`, an image of `width` columns.
pub(crate) fn project_add(
    volume: &KernelVolume,
    rays: &IndexRays,
    step_mm: f64,
    rect: PixelRect,
    width: usize,
    out: &mut [f32],
) {
    for v in rect.y0..rect.y1 {
        for u in rect.x0..rect.x1 {
            let slope = rays.slope(u, v);
            let Some((enter, leave)) = rays.clip(&slope, &volume.min, &volume.max) else {
                continue;
            };
            let (first, end) = samples_between(enter, leave, step_mm);
            if first >= end {
                continue;
            }
            // The first sample in f64, so that the long way from the source costs no digits; the
            // few hundred steps inside the box then do well in f32.
            let start = rays.source + slope * (f64::from(first) * step_mm);
            let sum = ray_sum(
                volume,
                std::array::from_fn(|a| start[a] as f32),
                std::array::from_fn(|a| (slope[a] * step_mm) as f32),
                end - first,
            );
            let scale = f64::from(volume.unit) * step_mm * rays.length_per_depth(u, v);
            out[v * width + u] += (f64::from(sum) * scale) as f32;
        }
    }
}

/// The sum of `count` samples from index `start` on, `step` apart, in units of the voxels.
fn ray_sum(volume: &KernelVolume, start: [f32; 3], step: [f32; 3], count: u32) -> f32 {
    let limit: [f32; 3] = [
        volume.max.x as f32,
        volume.max.y as f32,
        volume.max.z as f32,
    ];
    let fastest = step[0].abs().max(step[1].abs()).max(step[2].abs());
    let steps_per_cell = Occupancy::EDGE as f32 / fastest;
    let row = volume.dims[0];
    let slice = row * volume.dims[1];
    let cells = &volume.occupancy;
    let mut sum = 0.0f32;
    let mut k = 0;
    while k < count {
        // Rounding may leave the first or last sample a hair outside the box.
        let p: [f32; 3] =
            std::array::from_fn(|a| (start[a] + k as f32 * step[a]).clamp(0.0, limit[a]));
        let at = p.map(|x| x as usize);
        let cell = at.map(|x| x >> Occupancy::SHIFT);
        let distance =
            cells.distance[(cell[2] * cells.dims[1] + cell[1]) * cells.dims[0] + cell[0]];
        if distance > 0 {
            // All cells nearer than `distance` are empty: so far the ray may go from anywhere in
            // this cell, and at least one step.
            k += ((f32::from(distance) - 1.0) * steps_per_cell) as u32 + 1;
            continue;
        }
        let f: [f32; 3] = std::array::from_fn(|a| p[a] - at[a] as f32);
        let base = at[2] * slice + at[1] * row + at[0];
        let along_i = |offset: usize| {
            let low = f32::from(volume.voxels[base + offset]);
            let high = f32::from(volume.voxels[base + offset + 1]);
            low + f[0] * (high - low)
        };
        let (near, far) = (along_i(0), along_i(row));
        let below = near + f[1] * (far - near);
        let (near, far) = (along_i(slice), along_i(slice + row));
        let above = near + f[1] * (far - near);
        sum += below + f[2] * (above - below);
        k += 1;
    }
    sum
}

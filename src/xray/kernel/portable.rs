//! The plain loop: one ray after the other, leaping over empty cells.

use super::Projection;
use super::fixed::{BITS, CHUNK, TILE, WEIGHT_BITS, WEIGHT_ONE, weight};
use super::occupancy::Occupancy;

/// Adds the line integrals of a projection's pixels to `out`.
pub(crate) fn project_add(job: &Projection, out: &mut [f32]) {
    for v in job.rect.y0..job.rect.y1 {
        for u in job.rect.x0..job.rect.x1 {
            let sum = ray_sum(job, u, v);
            out[job.place(u, v)] += sum as f32 * job.scale(u, v);
        }
    }
}

/// The sum of all samples of one ray, each shifted right by `job.shift`.
fn ray_sum(job: &Projection, u: usize, v: usize) -> i32 {
    let volume = job.volume;
    let Some((first, end)) = job.samples(job.rays.slope(u, v), 0.0) else {
        return 0;
    };
    let tile = job.fixed.tile(u - u % TILE, v - v % TILE);
    let (i, j) = ((u % TILE) as i32, (v % TILE) as i32);
    let (column, row) = job.fixed.step_offsets();
    let mut step = tile.step();
    for a in 0..3 {
        step[a] += i * column[a] + j * row[a];
    }
    let fastest = step.iter().map(|s| s.unsigned_abs()).max().unwrap_or(1);
    let samples_per_voxel = (1u32 << BITS) as f32 / fastest as f32;
    let mut sum = 0;
    let (mut chunk, mut start) = (u32::MAX, [0; 3]);
    let mut k = first;
    while k < end {
        if k / CHUNK != chunk {
            chunk = k / CHUNK;
            let (column, row) = job.fixed.offsets(chunk);
            start = tile.start(chunk);
            for a in 0..3 {
                start[a] = start[a]
                    .wrapping_add(i.wrapping_mul(column[a]))
                    .wrapping_add(j.wrapping_mul(row[a]));
            }
        }
        let position: [i32; 3] = std::array::from_fn(|a| {
            start[a]
                .wrapping_add((k % CHUNK) as i32 * step[a])
                .clamp(0, job.last[a])
        });
        let cell = position.map(|p| (p >> BITS) as usize >> Occupancy::SHIFT);
        let clearance = volume.occupancy.clearance(cell);
        if clearance > 0 {
            // The ray may leave this cell by one voxel less, from anywhere in it.
            k += ((f32::from(clearance) - 1.0) * samples_per_voxel) as u32 + 1;
            continue;
        }
        // Negative samples, because that is what fits the vector kernels' instructions.
        sum -= -sample(job, &position) >> job.shift;
        k += 1;
    }
    sum
}

/// The interpolated volume at a position, in units of the voxels over [`WEIGHT_ONE`].
#[inline(always)]
fn sample(job: &Projection, position: &[i32; 3]) -> i32 {
    let [nx, ny, _] = job.volume.dims;
    let voxel = position.map(|p| (p >> BITS) as usize);
    let weight = position.map(weight);
    let at = (voxel[2] * ny + voxel[1]) * nx + voxel[0];
    let pairs = &job.volume.pairs;
    let between = |low: [i16; 2], high: [i16; 2], weight: i32| -> [i16; 2] {
        std::array::from_fn(|n| {
            let difference = i32::from(high[n]) - i32::from(low[n]);
            let part = (difference * weight + (1 << (WEIGHT_BITS - 1))) >> WEIGHT_BITS;
            low[n] + part as i16
        })
    };
    let lower = between(pairs[at], pairs[at + 1], weight[0]);
    let at = at + nx * ny;
    let upper = between(pairs[at], pairs[at + 1], weight[0]);
    let pair = between(lower, upper, weight[2]);
    i32::from(pair[0]) * (WEIGHT_ONE - weight[1]) + i32::from(pair[1]) * weight[1]
}

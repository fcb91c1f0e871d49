//! The plain ray caster: what all faster ones are held to.

use super::Camera;
use crate::geometry::{Pixel, Rigid, Vector};
use crate::image::Image;
use crate::volume::Volume;

/// Line integrals of attenuation (per mm) along the rays from the source to every pixel, in f64
/// and without any haste.
///
/// A ray's samples lie on planes parallel to the detector, at depths `k * step_mm` from the
/// source for integer k up to the detector; trilinear between voxel centres, zero beyond the
/// outermost centres; each sample times the length of the ray between two planes (`step_mm` on the
/// principal ray, at most 2 % more in the corners).
///
/// The planes belong to the C-arm and not to the volume, unlike samples that begin where a ray
/// enters a volume's box (facts 2.4). So the box can be cropped, or a bone be split into two
/// objects, without moving one sample: the DRR of two fragments at rest is the DRR of the whole
/// bone. No ray has a last part of a step that is dropped, and no sample enters or leaves at once
/// when a silhouette moves, so the image is a continuous function of the pose. On a volume with a
/// zero border the rule is the trapezoidal rule, without end terms.
pub fn line_integrals(
    volume: &Volume<f32>,
    camera: &Camera,
    camera_from_volume: &Rigid,
    step_mm: f64,
) -> Image<f64> {
    let volume_from_camera = camera_from_volume.inverse();
    let mut image = Image::filled(camera.width, camera.height, 0.0);
    // Beyond the ball around the volume every sample is zero.
    let grid = &volume.grid;
    let [i, j, k] = grid.dims.map(|n| (n as f64 - 1.0) / 2.0);
    let depth = -(camera_from_volume * grid.point(i, j, k)).z;
    let radius = (grid.center([0; 3]) - grid.point(i, j, k)).norm();
    let end = (camera.source_detector_mm / step_mm).floor();
    let first = ((depth - radius) / step_mm).floor().clamp(0.0, end) as usize;
    let last = ((depth + radius) / step_mm).ceil().clamp(0.0, end) as usize;
    for y in 0..camera.height {
        for x in 0..camera.width {
            let ray = camera.ray(&Pixel::new(x as f64, y as f64));
            let length = step_mm / -ray.direction.z;
            let mut sum = 0.0;
            for k in first..=last {
                let world = volume_from_camera * ray.at(k as f64 * length);
                sum += trilinear(volume, &volume.grid.index(&world));
            }
            image.data[y * camera.width + x] = sum * length;
        }
    }
    image
}

/// The value at a continuous index, linear in each axis between voxel centres, zero beyond the
/// outermost centres.
pub fn trilinear(volume: &Volume<f32>, index: &Vector) -> f64 {
    let dims = volume.grid.dims;
    if (0..3).any(|a| !(index[a] >= 0.0 && index[a] <= dims[a] as f64 - 1.0)) {
        return 0.0;
    }
    let low: [usize; 3] = std::array::from_fn(|a| index[a].floor() as usize);
    let mut value = 0.0;
    for corner in 0..8 {
        let mut weight = 1.0;
        let mut voxel = low;
        for axis in 0..3 {
            let fraction = index[axis] - low[axis] as f64;
            if corner >> axis & 1 == 1 {
                weight *= fraction;
                // On the last centre the upper neighbour has no weight and need not exist.
                voxel[axis] = (voxel[axis] + 1).min(dims[axis] - 1);
            } else {
                weight *= 1.0 - fraction;
            }
        }
        value += weight * f64::from(volume.at(voxel[0], voxel[1], voxel[2]));
    }
    value
}

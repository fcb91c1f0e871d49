//! Simulated fluoroscopy (paper, supplement on the simulation study).

use super::noise::photon_counts;
use crate::geometry::{Pixel, Rigid};
use crate::image::Image;
use crate::random::Stream;
use crate::volume::Volume;
use crate::xray::Camera;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How attenuation becomes counts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FluoroscopyParameters {
    /// Mean number N0 of photons that reach a pixel through air.
    pub photons: f64,
    /// Distance of samples along a ray (mm).
    pub step_mm: f64,
}

impl Default for FluoroscopyParameters {
    fn default() -> Self {
        Self {
            photons: 2000.0,
            step_mm: 1.0,
        }
    }
}

impl FluoroscopyParameters {
    /// Fields out of range, with what is expected.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        if !(1.0..=60_000.0).contains(&self.photons) {
            let message = format!(
                "is {}; expected 1 to 60000, so that counts fit 16 bits",
                self.photons
            );
            problems.push(("photons".into(), message));
        }
        if !(0.05..=10.0).contains(&self.step_mm) {
            let message = format!("is {}; expected 0.05 to 10 mm", self.step_mm);
            problems.push(("step_mm".into(), message));
        }
        problems
    }
}

/// Photon counts of one view: Beer-Lambert along each ray through `attenuation` (per mm), then a
/// Poisson draw a pixel. No scatter, blur or spectrum, as in the paper. `stream` must be fresh and of
/// this view alone.
pub fn fluoroscopy(
    attenuation: &Volume<f32>,
    camera: &Camera,
    camera_from_volume: &Rigid,
    parameters: &FluoroscopyParameters,
    stream: &Stream,
) -> Image<u16> {
    let lines = line_integrals(attenuation, camera, camera_from_volume, parameters.step_mm);
    photon_counts(&lines, parameters.photons, stream)
}

/// Line integrals by the sampling rule of [`crate::xray::reference`], rows in parallel.
fn line_integrals(
    volume: &Volume<f32>,
    camera: &Camera,
    camera_from_volume: &Rigid,
    step_mm: f64,
) -> Image<f32> {
    let grid = &volume.grid;
    let volume_from_camera = camera_from_volume.inverse();
    let source = grid.index(&(volume_from_camera * crate::geometry::Point::origin()));
    let mut data = vec![0.0; camera.width * camera.height];
    data.par_chunks_mut(camera.width)
        .enumerate()
        .for_each(|(y, row)| {
            for (x, value) in row.iter_mut().enumerate() {
                let ray = camera.ray(&Pixel::new(x as f64, y as f64));
                let length = step_mm / -ray.direction.z;
                let step = grid.index(&(volume_from_camera * ray.at(length))) - source;
                let (mut from, mut to) = (0.0f64, (camera.source_detector_mm / step_mm).floor());
                for axis in 0..3 {
                    let end = grid.dims[axis] as f64 - 1.0;
                    let (a, b) = (
                        -source[axis] / step[axis],
                        (end - source[axis]) / step[axis],
                    );
                    from = from.max(a.min(b));
                    to = to.min(a.max(b));
                }
                let mut sum = 0.0f32;
                let mut k = from.ceil();
                while k <= to {
                    sum += trilinear(volume, &(source + step * k));
                    k += 1.0;
                }
                *value = sum * length as f32;
            }
        });
    Image::new(camera.width, camera.height, data)
}

fn trilinear(volume: &Volume<f32>, index: &crate::geometry::Vector) -> f32 {
    let dims = volume.grid.dims;
    let mut low = [0; 3];
    let mut t = [0.0f32; 3];
    for axis in 0..3 {
        let last = dims[axis].saturating_sub(2);
        low[axis] = (index[axis].max(0.0) as usize).min(last);
        t[axis] = (index[axis] - low[axis] as f64) as f32;
    }
    let (sx, sy, sz) = (
        usize::from(dims[0] > 1),
        if dims[1] > 1 { dims[0] } else { 0 },
        if dims[2] > 1 { dims[0] * dims[1] } else { 0 },
    );
    let o = volume.grid.offset(low[0], low[1], low[2]);
    let d = &volume.data;
    let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let line = |o: usize| lerp(d[o], d[o + sx], t[0]);
    let face = |o: usize| lerp(line(o), line(o + sy), t[1]);
    lerp(face(o), face(o + sz), t[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, Vector};
    use crate::random::{Purpose, stream};
    use crate::volume::Grid;

    fn camera() -> Camera {
        Camera::centered(160, 1.9, 1020.0)
    }

    fn counts(volume: &Volume<f32>, pose: &Rigid) -> Image<u16> {
        let s = stream(2, Purpose::Noise, "test/0");
        fluoroscopy(
            volume,
            &camera(),
            pose,
            &FluoroscopyParameters::default(),
            &s,
        )
    }

    #[test]
    fn air_gives_all_photons() {
        let grid = Grid::axis_aligned([50; 3], 2.0, Point::new(-49.0, -49.0, -850.0));
        let image = counts(&Volume::filled(grid, 0.0), &Rigid::identity());
        let n = image.data.len() as f64;
        let mean = image.data.iter().map(|&c| f64::from(c)).sum::<f64>() / n;
        assert!((mean - 2000.0).abs() < 5.0 * (2000.0 / n).sqrt(), "{mean}");
    }

    /// A slab of constant attenuation, parallel to the detector and wider than the beam: behind a
    /// thickness d the mean count is N0 exp(-mu d / cos(angle to the principal ray)).
    #[test]
    fn a_slab_follows_beer_and_lambert() {
        let (mu, layers) = (0.02, 61);
        let mut grid = Grid::axis_aligned([121, 121, layers + 2], 4.0, Point::origin());
        grid.spacing[2] = 1.0;
        grid.origin = Point::new(-240.0, -240.0, -850.0);
        let mut slab = Volume::filled(grid.clone(), mu as f32);
        // With a zero border the trilinear slab is as thick as it has layers.
        for (offset, value) in slab.data.iter_mut().enumerate() {
            let k = grid.voxel(offset)[2];
            if k == 0 || k == layers + 1 {
                *value = 0.0;
            }
        }
        // The volume lies anywhere in its own world; the pose brings it into the beam.
        let motion = Rigid::new(Vector::new(500.0, -80.0, 33.0), Vector::new(1.0, 2.0, -0.4));
        slab.grid.origin = motion * slab.grid.origin;
        slab.grid.direction = *motion.rotation.to_rotation_matrix().matrix();
        let image = counts(&slab, &motion.inverse());
        let camera = camera();
        let (mut error, mut weight) = (0.0, 0.0);
        for y in 0..160 {
            for x in 0..160 {
                let ray = camera.ray(&Pixel::new(x as f64, y as f64));
                let mean = 2000.0 * (-mu * layers as f64 / -ray.direction.z).exp();
                let difference = f64::from(image.at(x, y)) - mean;
                assert!(difference.abs() < 6.5 * mean.sqrt(), "{x} {y}");
                error += difference;
                weight += mean;
            }
        }
        assert!(error.abs() < 5.0 * weight.sqrt(), "{error}");
    }

    #[test]
    fn lines_agree_with_the_plain_caster() {
        let grid = Grid::axis_aligned([30, 24, 27], 3.0, Point::new(-40.0, -30.0, -860.0));
        let data = (0..grid.len())
            .map(|o| ((o * 7919) % 101) as f32 * 1e-4)
            .collect();
        let volume = Volume::new(grid, data);
        let pose = Rigid::new(Vector::new(3.0, -20.0, 60.0), Vector::new(0.05, -0.1, 0.2));
        let camera = Camera::centered(40, 6.0, 1020.0);
        let fast = line_integrals(&volume, &camera, &pose, 1.3);
        let plain = crate::xray::reference::line_integrals(&volume, &camera, &pose, 1.3);
        for (a, b) in fast.data.iter().zip(&plain.data) {
            assert!((f64::from(*a) - b).abs() < 1e-4, "{a} {b}");
        }
        assert!(plain.data.iter().any(|&v| v > 0.1));
    }
}

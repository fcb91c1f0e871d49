//! Simulated fluoroscopy (paper, supplement on the simulation study).

use super::noise::photon_counts;
use crate::geometry::Rigid;
use crate::image::Image;
use crate::random::Stream;
use crate::xray::{BodyVolume, Camera};
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

/// Photon counts of one view of a body: Beer-Lambert along each ray, then a Poisson draw a pixel. No
/// scatter, blur or spectrum, as in the paper. `stream` must be fresh and of this view alone.
pub fn fluoroscopy(
    body: &BodyVolume,
    camera: &Camera,
    camera_from_volume: &Rigid,
    parameters: &FluoroscopyParameters,
    stream: &Stream,
) -> Image<u16> {
    let lines = body.line_integrals(camera, camera_from_volume, parameters.step_mm);
    photon_counts(&lines, parameters.photons, stream)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pixel, Point, Vector};
    use crate::random::{Purpose, stream};
    use crate::volume::{Grid, Volume};

    fn camera() -> Camera {
        Camera::centered(160, 1.9, 1020.0)
    }

    fn counts(volume: &Volume<f32>, pose: &Rigid) -> Image<u16> {
        let s = stream(2, Purpose::Noise, "test/0");
        fluoroscopy(
            &BodyVolume::new(volume),
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
}

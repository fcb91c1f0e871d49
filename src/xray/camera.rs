//! The C-arm as a pinhole camera.

use crate::geometry::{Pixel, Point, Ray, Rigid, Vector};
use nalgebra::Unit;

/// A C-arm's intrinsic geometry. The camera frame is right-handed with its origin at the X-ray
/// source, +x along image columns, +y along image rows (down) and +z from detector to source:
/// the detector lies at z = -`source_detector_mm` (DESIGN section 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Columns and rows of the image.
    pub width: usize,
    pub height: usize,
    /// Distance of neighbouring pixel centres on the detector in mm.
    pub pixel_mm: f64,
    /// Distance from source to detector in mm.
    pub source_detector_mm: f64,
    /// Where the ray perpendicular to the detector meets it.
    pub principal: Pixel,
}

impl Camera {
    /// Siemens CIOS Fusion (the paper's section on registration): 1536 x 1536 pixels of 0.194 mm,
    /// source to detector 1020 mm, principal point at the centre of the image.
    pub fn cios_fusion() -> Self {
        Self::centered(1536, 0.194, 1020.0)
    }

    /// A square detector of `size` pixels with the principal point at its centre, (size - 1) / 2.
    pub fn centered(size: usize, pixel_mm: f64, source_detector_mm: f64) -> Self {
        let c = (size as f64 - 1.0) / 2.0;
        Self {
            width: size,
            height: size,
            pixel_mm,
            source_detector_mm,
            principal: Pixel::new(c, c),
        }
    }

    /// Focal length in pixels.
    pub fn focal_px(&self) -> f64 {
        self.source_detector_mm / self.pixel_mm
    }

    /// Image position of a point in the camera frame (z < 0 in front of the source).
    pub fn project(&self, point: &Point) -> Pixel {
        let scale = self.focal_px() / -point.z;
        self.principal + nalgebra::Vector2::new(point.x * scale, point.y * scale)
    }

    /// The detector point of an image position, in the camera frame.
    pub fn detector_point(&self, pixel: &Pixel) -> Point {
        Point::new(
            (pixel.x - self.principal.x) * self.pixel_mm,
            (pixel.y - self.principal.y) * self.pixel_mm,
            -self.source_detector_mm,
        )
    }

    /// The ray from the source to an image position, of unit direction, in the camera frame.
    pub fn ray(&self, pixel: &Pixel) -> Ray {
        Ray {
            origin: Point::origin(),
            direction: self.detector_point(pixel).coords.normalize(),
        }
    }

    /// The camera of the image without `margin` pixels on each side.
    pub fn cropped(&self, margin: usize) -> Self {
        Self {
            width: self.width - 2 * margin,
            height: self.height - 2 * margin,
            principal: self.principal - nalgebra::Vector2::repeat(margin as f64),
            ..*self
        }
    }

    /// The camera of the image reduced by `factor` (1/8, say): floor(n f + 1/2) pixels, new pixel
    /// i at old index i / f, intrinsics times f (DESIGN section 3).
    pub fn reduced(&self, factor: f64) -> Self {
        let size = |n: usize| (n as f64 * factor + 0.5).floor() as usize;
        Self {
            width: size(self.width),
            height: size(self.height),
            pixel_mm: self.pixel_mm / factor,
            principal: self.principal * factor,
            ..*self
        }
    }
}

/// The C-arm's orbit: a rotation about a fixed axis of the camera frame through its isocentre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Isocentre in the camera frame (mm).
    pub isocenter: Point,
    /// Axis of the orbital rotation in the camera frame.
    pub axis: Unit<Vector>,
}

impl Orbit {
    /// The CIOS Fusion as its users calibrated it (facts 2.11).
    pub fn cios_fusion() -> Self {
        Self {
            isocenter: Point::new(-157.6, -2.7, -631.8),
            axis: -Vector::y_axis(),
        }
    }

    /// `moved_camera_from_camera` for an orbital rotation by `angle` (rad): where the anatomy, at
    /// rest in the room, appears once the C-arm has turned. `camera_from_volume` of the turned
    /// C-arm is this times that of the C-arm before.
    pub fn turned(&self, angle: f64) -> Rigid {
        let rotation = nalgebra::UnitQuaternion::from_axis_angle(&self.axis, angle);
        Rigid::rotation_wrt_point(rotation, self.isocenter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_and_ray_agree() {
        let camera = Camera::cios_fusion().cropped(50).reduced(0.125);
        assert_eq!((camera.width, camera.height), (180, 180));
        assert!((camera.principal.x - 717.5 / 8.0).abs() < 1e-12);
        let pixel = Pixel::new(13.25, 140.5);
        let point = camera.ray(&pixel).at(700.0);
        assert!((camera.project(&point) - pixel).norm() < 1e-9);
    }

    #[test]
    fn reduced_pixel_i_is_full_pixel_i_over_f() {
        let full = Camera::cios_fusion().cropped(50);
        let small = full.reduced(0.25);
        assert_eq!(small.width, 359);
        let a = full.detector_point(&Pixel::new(40.0, 80.0));
        let b = small.detector_point(&Pixel::new(10.0, 20.0));
        assert!((a - b).norm() < 1e-9);
    }

    #[test]
    fn the_isocenter_stays_in_an_orbital_turn() {
        let orbit = Orbit::cios_fusion();
        assert!((orbit.turned(0.4) * orbit.isocenter - orbit.isocenter).norm() < 1e-9);
    }
}

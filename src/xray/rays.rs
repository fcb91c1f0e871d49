//! The rays of a whole image in the index space of a grid.

use super::Camera;
use crate::geometry::{Point, Rigid, Vector};
use crate::volume::Grid;

/// The rays from the source to all pixels of an image, as continuous indices of a grid.
///
/// At depth `s` mm (distance from the source, perpendicular to the detector) the ray of pixel
/// (u, v) is at index `source + s * (axis + u * column + v * row)`: linear in s, u and v, so a
/// kernel needs no square root and no normalized direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IndexRays {
    /// Index of the X-ray source.
    pub source: Vector,
    /// Index per mm of depth along the ray of pixel (0, 0).
    pub axis: Vector,
    /// What one column adds to `axis`.
    pub column: Vector,
    /// What one row adds to `axis`.
    pub row: Vector,
    /// Depth of index zero, and what one index along each axis adds.
    depth: (f64, Vector),
    camera: Camera,
}

impl IndexRays {
    /// The rays of `camera` in the index space of `grid`.
    pub fn new(camera: &Camera, camera_from_volume: &Rigid, grid: &Grid) -> Self {
        let volume_from_camera = camera_from_volume.inverse();
        let linear = |v: Vector| {
            let local = grid.direction.transpose() * (volume_from_camera.rotation * v);
            local.component_div(&Vector::from(grid.spacing))
        };
        let pixel = camera.pixel_mm / camera.source_detector_mm;
        Self {
            source: grid.index(&(volume_from_camera * Point::origin())),
            axis: linear(Vector::new(
                -camera.principal.x * pixel,
                -camera.principal.y * pixel,
                -1.0,
            )),
            column: linear(Vector::new(pixel, 0.0, 0.0)),
            row: linear(Vector::new(0.0, pixel, 0.0)),
            depth: (
                -(camera_from_volume * grid.origin).z,
                Vector::from_fn(|axis, _| {
                    let along = grid.direction.column(axis) * grid.spacing[axis];
                    -(camera_from_volume.rotation * along).z
                }),
            ),
            camera: *camera,
        }
    }

    /// Index per mm of depth along the ray of a pixel.
    #[inline]
    pub fn slope(&self, u: usize, v: usize) -> Vector {
        self.axis + self.column * u as f64 + self.row * v as f64
    }

    /// Index per mm of depth along the ray of any point of the image, in pixels.
    pub fn slope_at(&self, u: f64, v: f64) -> Vector {
        self.axis + self.column * u + self.row * v
    }

    /// The pixel, whether in the image or not, whose centre is nearest to the principal point.
    pub fn principal_pixel(&self) -> [f64; 2] {
        [
            self.camera.principal.x.round(),
            self.camera.principal.y.round(),
        ]
    }

    /// Index per mm of depth along the principal ray.
    pub fn principal_slope(&self) -> Vector {
        self.slope_at(self.camera.principal.x, self.camera.principal.y)
    }

    /// Tangent per pixel of the angle to the principal ray, and the principal point.
    pub fn perspective(&self) -> (f64, [f64; 2]) {
        let camera = &self.camera;
        (
            camera.pixel_mm / camera.source_detector_mm,
            [camera.principal.x, camera.principal.y],
        )
    }

    /// Length in mm of the ray of a pixel per mm of depth: 1 on the principal ray, 1.02 in the
    /// corners of the CIOS Fusion's image.
    #[inline]
    pub fn length_per_depth(&self, u: usize, v: usize) -> f64 {
        let pixel = self.camera.pixel_mm / self.camera.source_detector_mm;
        let x = (u as f64 - self.camera.principal.x) * pixel;
        let y = (v as f64 - self.camera.principal.y) * pixel;
        (1.0 + x * x + y * y).sqrt()
    }

    /// Depth in mm of the farthest corner of a grid of this many voxels, at most the detector's.
    pub fn farthest_mm(&self, dims: [usize; 3]) -> f64 {
        let (zero, per_index) = self.depth;
        let farthest = zero
            + (0..3)
                .map(|a| (per_index[a] * (dims[a] as f64 - 1.0)).max(0.0))
                .sum::<f64>();
        farthest.clamp(0.0, self.camera.source_detector_mm)
    }

    /// The depths between which the ray with this slope lies in the box of indices `min..=max` and
    /// between source and detector, or `None` if it misses it.
    #[inline]
    pub fn clip(&self, slope: &Vector, min: &Vector, max: &Vector) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (0.0f64, self.camera.source_detector_mm);
        for axis in 0..3 {
            let (o, d) = (self.source[axis], slope[axis]);
            if d == 0.0 {
                if o < min[axis] || o > max[axis] {
                    return None;
                }
                continue;
            }
            let (a, b) = ((min[axis] - o) / d, (max[axis] - o) / d);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some((enter, leave))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pixel;

    #[test]
    fn index_rays_are_the_cameras_rays() {
        let camera = Camera::cios_fusion().cropped(50).reduced(0.125);
        let pose = Rigid::new(Vector::new(4.0, -7.0, -800.0), Vector::new(0.3, -1.2, 0.4));
        let grid = Grid {
            dims: [5, 6, 7],
            spacing: [0.5, 1.0, 2.0],
            origin: Point::new(-3.0, 8.0, 1.0),
            direction: *nalgebra::Rotation3::from_euler_angles(0.1, 0.2, 0.3).matrix(),
        };
        let rays = IndexRays::new(&camera, &pose, &grid);
        let depth = 812.0;
        let ray = camera.ray(&Pixel::new(17.0, 133.0));
        let length = depth * rays.length_per_depth(17, 133);
        let expected = grid.index(&(pose.inverse() * ray.at(length)));
        let index = rays.source + rays.slope(17, 133) * depth;
        assert!((index - expected).norm() < 1e-9, "{index} {expected}");
    }
}

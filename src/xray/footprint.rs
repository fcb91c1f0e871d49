//! Where on the detector an object can be seen.

use super::Camera;
use crate::geometry::{Point, Rigid, Vector};
pub use crate::image::PixelRect;
use crate::volume::Volume;

impl PixelRect {
    /// The whole image of a camera.
    pub fn full(camera: &Camera) -> Self {
        Self::of_image(camera.width, camera.height)
    }
}

/// Points whose convex hull holds everything that attenuates, interpolation included.
#[derive(Clone, Debug)]
pub(crate) struct Hull {
    points: Vec<Point>,
    /// The same as indices of the volume.
    indices: Vec<Vector>,
}

/// Slices of the volume that share one box of the hull. Thin enough that the boxes follow the
/// bone, thick enough that a pelvis has about 300 points, projected in a microsecond or two.
const SLAB: usize = 8;

impl Hull {
    /// The hull of a volume's values other than zero: the corners of a box around those of each
    /// slab of slices, widened by the one voxel that linear interpolation reaches.
    pub fn of(volume: &Volume<f32>) -> Self {
        let grid = &volume.grid;
        let [nx, ny, nz] = grid.dims;
        let mut indices = Vec::new();
        for first in (0..nz).step_by(SLAB) {
            let last = (first + SLAB).min(nz);
            let (mut min, mut max) = ([usize::MAX; 3], [0; 3]);
            for k in first..last {
                for j in 0..ny {
                    let row = &volume.data[grid.offset(0, j, k)..][..nx];
                    let Some(left) = row.iter().position(|&v| v != 0.0) else {
                        continue;
                    };
                    let right = row.iter().rposition(|&v| v != 0.0).unwrap_or(left);
                    min = [min[0].min(left), min[1].min(j), min[2].min(k)];
                    max = [max[0].max(right), max[1].max(j), max[2].max(k)];
                }
            }
            if min[0] == usize::MAX {
                continue;
            }
            for corner in 0..8 {
                indices.push(Vector::from_fn(|axis, _| {
                    if corner >> axis & 1 == 0 {
                        min[axis] as f64 - 1.0
                    } else {
                        max[axis] as f64 + 1.0
                    }
                }));
            }
        }
        Self {
            points: indices.iter().map(|i| grid.point(i.x, i.y, i.z)).collect(),
            indices,
        }
    }

    /// The points as continuous indices of the volume.
    pub fn indices(&self) -> impl Iterator<Item = Vector> + '_ {
        self.indices.iter().copied()
    }

    /// The least and the greatest distance in mm of a point from the source, perpendicular to the
    /// detector.
    pub fn depths(&self, camera_from_volume: &Rigid) -> (f64, f64) {
        let depths = self.points.iter().map(|p| -(camera_from_volume * p).z);
        depths.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), d| {
            (least.min(d), most.max(d))
        })
    }

    /// The pixels whose rays can meet the hull between source and detector, or `None` if there are
    /// none. The whole image where a part of the hull lies beside or behind the source.
    pub fn footprint(&self, camera: &Camera, camera_from_volume: &Rigid) -> Option<PixelRect> {
        // A point nearer to the source's plane than this projects to anywhere.
        const NEAREST_MM: f64 = 1.0;
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        let (mut any_in_front, mut any_behind, mut any_before_detector) = (false, false, false);
        for point in &self.points {
            let p = camera_from_volume * point;
            any_before_detector |= p.z >= -camera.source_detector_mm;
            if p.z > -NEAREST_MM {
                any_behind = true;
                continue;
            }
            any_in_front = true;
            let pixel = camera.project(&p);
            for axis in 0..2 {
                min[axis] = min[axis].min(pixel[axis]);
                max[axis] = max[axis].max(pixel[axis]);
            }
        }
        if !any_in_front || !any_before_detector {
            return None;
        }
        if any_behind {
            return Some(PixelRect::full(camera));
        }
        // The slack keeps a pixel whose centre lies on the hull's edge but for rounding.
        const SLACK: f64 = 1e-6;
        let range = |axis: usize, size: usize| {
            let first = (min[axis] - SLACK).ceil().max(0.0);
            let end = (max[axis] + SLACK).floor().min(size as f64 - 1.0) + 1.0;
            (first < end).then_some((first as usize, end as usize))
        };
        let (x0, x1) = range(0, camera.width)?;
        let (y0, y1) = range(1, camera.height)?;
        Some(PixelRect { x0, y0, x1, y1 })
    }
}

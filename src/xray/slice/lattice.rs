//! The lattice of ray directions that the slices of one pose are resampled to.

use super::SliceStack;
use super::tables::BLOCK;
use crate::geometry::Vector;
use crate::image::PixelRect;
use crate::xray::rays::IndexRays;

/// The most voxels that one step of the lattice may be in any slice: the kernels load 32 voxels for
/// 16 points of the lattice, and 8 for 4.
const LARGEST_STEP: f64 = 1.9;
/// The least cosine between any ray of the image's part and the direction across slices. Rays that
/// run along the slices meet too few of them.
const LEAST_COSINE: f64 = 0.3;

/// Rays by where they meet planes across the slices' axis.
///
/// A ray is named by its tangents (x, y): how many columns and rows of voxels it goes on while it
/// goes on by one slice. In a slice `h` slices from the source all rays with the same x meet the
/// same column, and those with the same y the same row. The lattice is regular in x and y. Its point
/// (0, 0) is the ray of the pixel nearest to the principal point, whatever part of the image is
/// asked for, so that neither blur nor value of a pixel depend on that part, and an object that moves
/// in parallel to the detector takes its image along unchanged.
#[derive(Clone, Debug)]
pub(crate) struct Lattice {
    /// The source in columns, rows and slices.
    source: [f64; 3],
    /// Tangents of point (0, 0), and how far points are apart.
    center: [f64; 2],
    pub(super) step: [f64; 2],
    /// Blocks of points along x that are needed, in points divided by [`BLOCK`]: first and behind
    /// the last.
    pub(super) blocks: (i32, i32),
    /// Points along y that are needed: first and behind the last.
    pub(super) rows: (i32, i32),
    pub(super) warp: WarpFrame,
}

/// How pixels map to the lattice: point (x, y) = (`x` . d, `y` . d) / (`depth` . d) for
/// d = (1, u - u0, v - v0), where (u0, v0) is the pixel of point (0, 0).
#[derive(Clone, Debug)]
pub(super) struct WarpFrame {
    pub pixel: [f64; 2],
    pub x: [f64; 2],
    pub y: [f64; 2],
    pub depth: [f64; 3],
    /// Length in mm of the ray between two slices, times `depth` . d, per length of the ray per mm
    /// of depth.
    pub length: f64,
}

impl Lattice {
    /// Which axis of the volume the rays follow most: across its slices they are resampled. The
    /// principal ray decides; `spacing` is the voxels'.
    pub fn dominant_axis(rays: &IndexRays, spacing: &[f64; 3]) -> usize {
        let direction = rays
            .principal_slope()
            .component_mul(&Vector::from(*spacing));
        direction.iamax()
    }

    /// The lattice for the pixels `rect` with a pitch of `pitch_px` pixels or, where that would be
    /// too coarse for the voxels, as fine as they need. `hull` holds points, as indices of the
    /// volume, between which everything lies that is not zero.
    ///
    /// `None` where rays run too much along the slices or a part of the hull does not lie before the
    /// source; no blocks or rows where nothing is seen.
    pub fn new(
        stack: &SliceStack,
        rays: &IndexRays,
        spacing: &[f64; 3],
        hull: impl Iterator<Item = Vector>,
        rect: PixelRect,
        pitch_px: f64,
    ) -> Option<Self> {
        let [p, q, d] = stack.axes;
        let pixel = rays.principal_pixel();
        let slope = rays.slope_at(pixel[0], pixel[1]);
        let sign = slope[d].signum();
        let corners = [
            [rect.x0, rect.y0],
            [rect.x1 - 1, rect.y0],
            [rect.x0, rect.y1 - 1],
            [rect.x1 - 1, rect.y1 - 1],
        ];
        let steep = |slope: &Vector| {
            let direction = slope.component_mul(&Vector::from(*spacing));
            direction[d] * sign > LEAST_COSINE * direction.norm()
        };
        if !corners.iter().all(|&[u, v]| steep(&rays.slope(u, v))) || !steep(&slope) {
            return None;
        }

        let depth = slope[d] * sign;
        let (column, row) = (rays.column, rays.row);
        // What a column and a row of pixels add to the tangents, times depth squared.
        let adds =
            |axis: usize| [column, row].map(|add| add[axis] * depth - slope[axis] * sign * add[d]);
        let (x, y) = (adds(p), adds(q));
        let determinant = (x[0] * y[1] - x[1] * y[0]).abs() / depth.powi(2);
        let source = stack.axes.map(|axis| rays.source[axis]);
        let farthest = [0.0, stack.dims[2] as f64 - 1.0].map(|slice| (slice - source[2]).abs());
        let largest = LARGEST_STEP / farthest[0].max(farthest[1]);
        let step =
            [y, x].map(|other| (pitch_px * determinant / other[0].hypot(other[1])).min(largest));
        let center = [slope[p] / depth, slope[q] / depth];
        let warp = WarpFrame {
            pixel,
            x: x.map(|add| add / (depth * depth * step[0])),
            y: y.map(|add| add / (depth * depth * step[1])),
            depth: [1.0, sign * column[d] / depth, sign * row[d] / depth],
            length: 1.0 / depth,
        };

        let mut seen = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for index in hull {
            let slices = (index[d] - source[2]) * sign;
            if slices < 1.0 {
                return None;
            }
            for (a, axis) in [p, q].into_iter().enumerate() {
                let tangent = (index[axis] - source[a]) / slices;
                let point = (tangent - center[a]) / step[a];
                seen[a] = [seen[a][0].min(point), seen[a][1].max(point)];
            }
        }
        let mut asked = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for [u, v] in corners {
            for (a, point) in warp.point(u as f64, v as f64).into_iter().enumerate() {
                asked[a] = [asked[a][0].min(point), asked[a][1].max(point)];
            }
        }
        // The points between which those that are seen lie, and those around the ones asked for.
        let range = |a: usize| {
            let first = seen[a][0].floor().max(asked[a][0].floor() - 1.0);
            let end = seen[a][1].ceil().min(asked[a][1].floor() + 2.0) + 1.0;
            (first as i32, end.max(first) as i32)
        };
        let (columns, rows) = (range(0), range(1));
        let blocks = if columns.0 < columns.1 {
            (
                columns.0.div_euclid(BLOCK),
                (columns.1 - 1).div_euclid(BLOCK) + 1,
            )
        } else {
            (0, 0)
        };
        Some(Self {
            source,
            center,
            step,
            blocks,
            rows,
            warp,
        })
    }

    /// Slices from the source to a slice.
    #[inline(always)]
    pub(super) fn height(&self, slice: usize) -> f64 {
        (slice as f64 - self.source[2]).abs()
    }

    /// Along columns (`a` = 0) or rows (1) of voxels of a slice: where the lattice's point 0 is, and
    /// how far points are apart.
    #[inline(always)]
    pub(super) fn positions(&self, slice: usize, a: usize) -> (f64, f64) {
        let height = self.height(slice);
        (
            self.source[a] + height * self.center[a],
            height * self.step[a],
        )
    }
}

impl WarpFrame {
    /// The place on the lattice of a pixel.
    fn point(&self, u: f64, v: f64) -> [f64; 2] {
        let (u, v) = (u - self.pixel[0], v - self.pixel[1]);
        let depth = self.depth[0] + self.depth[1] * u + self.depth[2] * v;
        [&self.x, &self.y].map(|add| (add[0] * u + add[1] * v) / depth)
    }
}

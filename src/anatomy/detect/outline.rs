//! The shadow of a bone: its parallel projection as a picture of bone and background.

use super::spot::{middle, nearness, outward};
use crate::geometry::{Point, Vector};
use crate::volume::Surface;
use nalgebra::{Vector1, Vector2};

/// Size of a pixel of the picture (mm).
const PIXEL_MM: f64 = 0.25;

/// Bone up to this far inside the edge, and this far beside a place on it, tells how deep in the view the edge
/// lies there (mm).
const EDGE_MM: f64 = 2.0;
const BESIDE_MM: f64 = 5.0;

/// How far inside the edge the bone is thick enough to be met for sure (mm).
const INSET_MM: f64 = 0.5;

/// Background left free around the shadow (pixels).
const MARGIN: usize = 8;

/// A bone seen along `view`: coordinates (u, v) in mm along two world directions from a world
/// point.
pub(super) struct Outline<'a> {
    surface: &'a Surface,
    origin: Point,
    /// World directions of u and v, and the direction of view.
    axes: [Vector; 3],
    /// (u, v) of the centre of pixel (0, 0).
    corner: Vector2<f64>,
    width: usize,
    height: usize,
    bone: Vec<bool>,
}

impl<'a> Outline<'a> {
    /// The shadow of `surface` in the plane of `u` and `v` (unit, orthogonal) through `origin`.
    pub fn new(surface: &'a Surface, origin: Point, u: Vector, v: Vector) -> Self {
        let project = |p: &Point| {
            let d = p - origin;
            Vector2::new(d.dot(&u), d.dot(&v))
        };
        let flat: Vec<Vector2<f64>> = surface.vertices().iter().map(project).collect();
        let (mut low, mut high) = (Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN));
        for p in &flat {
            low = low.inf(p);
            high = high.sup(p);
        }
        let corner = low - Vector2::repeat(MARGIN as f64 * PIXEL_MM);
        let size =
            |axis: usize| ((high[axis] - low[axis]) / PIXEL_MM).ceil() as usize + 1 + 2 * MARGIN;
        let (width, height) = (size(0), size(1));
        let mut outline = Self {
            surface,
            origin,
            axes: [u, v, u.cross(&v)],
            corner,
            width,
            height,
            bone: vec![false; width * height],
        };
        for triangle in surface.triangles() {
            outline.fill(triangle.map(|i| (flat[i as usize] - corner) / PIXEL_MM));
        }
        outline
    }

    /// Marks the pixels whose centres a triangle covers (in pixels, border included).
    fn fill(&mut self, [a, b, c]: [Vector2<f64>; 3]) {
        let cross = |p: Vector2<f64>, q: Vector2<f64>| p.x * q.y - p.y * q.x;
        let area = cross(b - a, c - a);
        if area == 0.0 {
            return;
        }
        let low = a.inf(&b).inf(&c);
        let high = a.sup(&b).sup(&c);
        for y in low.y.ceil() as usize..=high.y.floor() as usize {
            for x in low.x.ceil() as usize..=high.x.floor() as usize {
                let p = Vector2::new(x as f64, y as f64);
                let inside = |from: Vector2<f64>, to: Vector2<f64>| {
                    cross(to - from, p - from) * area.signum() >= 0.0
                };
                if inside(a, b) && inside(b, c) && inside(c, a) {
                    self.bone[y * self.width + x] = true;
                }
            }
        }
    }

    /// True where the bone's shadow covers (u, v); false outside the picture.
    pub fn covered(&self, at: &Vector2<f64>) -> bool {
        let p = (at - self.corner) / PIXEL_MM;
        let (x, y) = ((p.x + 0.5).floor(), (p.y + 0.5).floor());
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        inside && self.bone[y as usize * self.width + x as usize]
    }

    /// Distance in mm from an uncovered (u, v) along a unit direction to the shadow, to a tenth of
    /// a millimetre, or `None` beyond `limit_mm`.
    pub fn distance(
        &self,
        from: &Vector2<f64>,
        direction: &Vector2<f64>,
        limit_mm: f64,
    ) -> Option<f64> {
        (0..=(limit_mm * 10.0) as usize)
            .map(|n| n as f64 * 0.1)
            .find(|r| self.covered(&(from + direction * *r)))
    }

    /// The largest hole in the shadow: its centroid (u, v) and area in mm^2. A hole is background
    /// that is not connected to the picture's border.
    pub fn largest_hole(&self) -> Option<(Vector2<f64>, f64)> {
        let mut seen = self.bone.clone();
        let mut best: Option<(Vector2<f64>, usize)> = None;
        let mut stack = Vec::new();
        for start in 0..seen.len() {
            if seen[start] {
                continue;
            }
            seen[start] = true;
            stack.push(start);
            let (mut sum, mut count, mut open) = (Vector2::zeros(), 0usize, false);
            while let Some(at) = stack.pop() {
                let (x, y) = (at % self.width, at / self.width);
                sum += Vector2::new(x as f64, y as f64);
                count += 1;
                if x == 0 || y == 0 || x + 1 == self.width || y + 1 == self.height {
                    open = true;
                    continue;
                }
                for next in [at - 1, at + 1, at - self.width, at + self.width] {
                    if !seen[next] {
                        seen[next] = true;
                        stack.push(next);
                    }
                }
            }
            if !open && best.is_none_or(|(_, most)| count > most) {
                best = Some((sum / count as f64, count));
            }
        }
        best.map(|(center, count)| {
            let center = self.corner + center * PIXEL_MM;
            (center, count as f64 * PIXEL_MM * PIXEL_MM)
        })
    }

    /// The point of the bone's surface that casts the edge of the shadow at (u, v), where `inward` (unit) points into
    /// the shadow: in the depth of view, the middle of the bone near there that reaches nearly to the edge; from
    /// just inside, the surface is met outward.
    pub fn surface_point(&self, edge: &Vector2<f64>, inward: &Vector2<f64>) -> Option<Point> {
        let [u, v, view] = self.axes;
        let areas = self.surface.vertex_areas();
        let depths = self.surface.vertices().iter().zip(areas).map(|(p, area)| {
            let d = p - self.origin;
            let at = Vector2::new(d.dot(&u), d.dot(&v)) - edge;
            let beside = (at.x * inward.y - at.y * inward.x) / BESIDE_MM;
            let within = at.dot(inward);
            // Beyond the edge lies bone of the hole's other side.
            let near = match within > -BESIDE_MM {
                true => nearness(within, EDGE_MM) * (1.0 - beside * beside).max(0.0),
                false => 0.0,
            };
            (Vector1::new(d.dot(&view)), area * near)
        });
        let depth = middle(depths)?.x;
        let inside = edge + inward * INSET_MM;
        let inside = self.origin + u * inside.x + v * inside.y + view * depth;
        let direction = -(u * inward.x + v * inward.y);
        outward(self.surface, &inside, &direction)
    }
}

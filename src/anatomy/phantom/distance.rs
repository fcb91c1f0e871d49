//! Signed distances (mm, negative inside) to simple solids, and their smooth combination.
//!
//! They are exact or slightly too small in magnitude, so that a value larger than the distance
//! between two points proves that no surface lies between them.

use crate::geometry::{Point, Vector};

/// A point of a polyline with the radius of the solid around it, both in mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub center: Point,
    pub radius: f64,
}

/// A round rod along a polyline, whose radius changes linearly between the nodes; flattened
/// across `flat` where that is given.
#[derive(Clone, Debug)]
pub(super) struct Rod {
    nodes: Vec<Node>,
    flat: Option<(Vector, f64)>,
}

impl Rod {
    pub fn new(nodes: Vec<Node>) -> Self {
        Self { nodes, flat: None }
    }

    /// The corners (lowest, highest) of the box in the frame's axes that holds all that is nearer
    /// than `margin` mm to a rod that is not widened.
    pub fn bounds(&self, margin: f64) -> [Point; 2] {
        let mut bounds = [
            Point::from([f64::INFINITY; 3]),
            Point::from([f64::NEG_INFINITY; 3]),
        ];
        for node in &self.nodes {
            let reach = Vector::repeat(node.radius + margin);
            bounds[0] = bounds[0].inf(&(node.center - reach));
            bounds[1] = bounds[1].sup(&(node.center + reach));
        }
        bounds
    }

    /// A rod whose section is an ellipse: wider by `ratio` (>= 1) along the unit vector `axis`
    /// than across it, where it keeps its radius.
    pub fn widened(nodes: Vec<Node>, axis: Vector, ratio: f64) -> Self {
        Self {
            nodes,
            flat: Some((axis.normalize(), 1.0 - 1.0 / ratio)),
        }
    }

    pub fn distance(&self, p: &Point) -> f64 {
        let mut best = f64::INFINITY;
        for pair in self.nodes.windows(2) {
            let axis = pair[1].center - pair[0].center;
            let to = p - pair[0].center;
            let h = (to.dot(&axis) / axis.norm_squared()).clamp(0.0, 1.0);
            let mut away = to - axis * h;
            if let Some((flat, shrink)) = &self.flat {
                away -= flat * (away.dot(flat) * shrink);
            }
            let radius = pair[0].radius + (pair[1].radius - pair[0].radius) * h;
            best = best.min(away.norm() - radius);
        }
        best
    }
}

/// An ellipsoid; the columns of `axes` are unit and orthogonal.
#[derive(Clone, Debug)]
pub(super) struct Ellipsoid {
    pub center: Point,
    pub axes: [Vector; 3],
    pub radii: [f64; 3],
}

impl Ellipsoid {
    /// Along the frame's axes.
    pub fn aligned(center: Point, radii: [f64; 3]) -> Self {
        Self {
            center,
            axes: [Vector::x(), Vector::y(), Vector::z()],
            radii,
        }
    }

    /// A first-order distance: exact in sign, and in value near the surface.
    pub fn distance(&self, p: &Point) -> f64 {
        let to = p - self.center;
        let (mut k0, mut k1) = (0.0, 0.0);
        for (axis, radius) in self.axes.iter().zip(self.radii) {
            let q = to.dot(axis) / radius;
            k0 += q * q;
            k1 += (q / radius) * (q / radius);
        }
        let (k0, k1) = (k0.sqrt(), k1.sqrt());
        if k1 < 1e-9 {
            return -self.radii.iter().copied().fold(f64::INFINITY, f64::min);
        }
        k0 * (k0 - 1.0) / k1
    }
}

/// The union of two solids with their meeting edge filled to about `k` mm.
#[inline]
pub(super) fn join(a: f64, b: f64, k: f64) -> f64 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}

/// The intersection of two solids with its edge rounded over about `k` mm. Never inside of
/// either.
#[inline]
pub(super) fn meet(a: f64, b: f64, k: f64) -> f64 {
    -join(-a, -b, k)
}

/// 0 below `low`, 1 above `high`, smooth between.
#[inline]
pub(super) fn smooth_step(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The direction in which a distance grows fastest, of unit length where it has a gradient.
pub(super) fn gradient(distance: impl Fn(&Point) -> f64, p: &Point) -> Vector {
    const STEP_MM: f64 = 0.05;
    let along = |axis: Vector| distance(&(p + axis * STEP_MM)) - distance(&(p - axis * STEP_MM));
    let g = Vector::new(along(Vector::x()), along(Vector::y()), along(Vector::z()));
    g.try_normalize(1e-12).unwrap_or_else(Vector::zeros)
}

/// Moves `p` along the gradient onto the surface.
pub(super) fn onto_surface(distance: impl Fn(&Point) -> f64, p: &Point) -> Point {
    let mut q = *p;
    for _ in 0..60 {
        let d = distance(&q);
        if d.abs() < 1e-4 {
            break;
        }
        q -= gradient(&distance, &q) * (0.7 * d);
    }
    q
}

/// The first place where a half line crosses the surface, looked for every `step` mm up to
/// `reach` mm from `start`, or `None` if it does not.
pub(super) fn first_crossing(
    distance: impl Fn(&Point) -> f64,
    start: &Point,
    direction: &Vector,
    step: f64,
    reach: f64,
) -> Option<Point> {
    let direction = direction.normalize();
    let inside = distance(start) < 0.0;
    let mut low = 0.0;
    while low < reach {
        let high = low + step;
        if (distance(&(start + direction * high)) < 0.0) != inside {
            let (mut a, mut b) = (low, high);
            for _ in 0..40 {
                let middle = 0.5 * (a + b);
                if (distance(&(start + direction * middle)) < 0.0) == inside {
                    a = middle;
                } else {
                    b = middle;
                }
            }
            return Some(start + direction * (0.5 * (a + b)));
        }
        low = high;
    }
    None
}

/// Points on a smooth curve (Catmull-Rom) through `points`, `per_segment` for each of its pieces.
pub(super) fn smooth_curve<const N: usize>(
    points: &[[f64; N]],
    closed: bool,
    per_segment: usize,
) -> Vec<[f64; N]> {
    let n = points.len() as isize;
    let at = |i: isize| {
        let i = if closed {
            i.rem_euclid(n)
        } else {
            i.clamp(0, n - 1)
        };
        points[i as usize]
    };
    let segments = if closed { n } else { n - 1 };
    let mut curve = Vec::new();
    for i in 0..segments {
        let (a, b, c, d) = (at(i - 1), at(i), at(i + 1), at(i + 2));
        for s in 0..per_segment {
            let t = s as f64 / per_segment as f64;
            curve.push(std::array::from_fn(|k| {
                0.5 * (2.0 * b[k]
                    + (c[k] - a[k]) * t
                    + (2.0 * a[k] - 5.0 * b[k] + 4.0 * c[k] - d[k]) * t * t
                    + (3.0 * b[k] - a[k] - 3.0 * c[k] + d[k]) * t * t * t)
            }));
        }
    }
    if !closed {
        curve.push(at(n - 1));
    }
    curve
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rod_has_its_radii_at_its_nodes() {
        let rod = Rod::new(vec![
            Node {
                center: Point::origin(),
                radius: 2.0,
            },
            Node {
                center: Point::new(10.0, 0.0, 0.0),
                radius: 4.0,
            },
        ]);
        assert!((rod.distance(&Point::new(0.0, 5.0, 0.0)) - 3.0).abs() < 1e-12);
        assert!((rod.distance(&Point::new(5.0, 0.0, 5.0)) - 2.0).abs() < 1e-12);
        assert!((rod.distance(&Point::new(15.0, 0.0, 0.0)) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_meeting_never_reaches_outside_its_parts() {
        for i in -20..20 {
            for j in -20..20 {
                let (a, b) = (f64::from(i) * 0.3, f64::from(j) * 0.3);
                assert!(meet(a, b, 2.0) >= a.max(b));
                assert!(join(a, b, 2.0) <= a.min(b));
            }
        }
    }

    #[test]
    fn surface_points_are_found() {
        let ball = Ellipsoid::aligned(Point::new(1.0, 2.0, 3.0), [10.0, 12.0, 8.0]);
        let d = |p: &Point| ball.distance(p);
        let p = onto_surface(d, &Point::new(9.0, 7.0, 4.0));
        assert!(d(&p).abs() < 1e-3);
        let q = first_crossing(d, &Point::new(1.0, 2.0, 3.0), &Vector::y(), 0.5, 40.0).unwrap();
        assert!((q - Point::new(1.0, 14.0, 3.0)).norm() < 1e-6);
    }
}

//! The ilium: a curved blade of varying thickness within an outline.

use super::build::{Build, Draws};
use super::distance::smooth_curve;
use crate::geometry::{Point, Vector};
use nalgebra::{DMatrix, UnitQuaternion};

/// The blade's plane in the template (side frame): through `ORIGIN` above the acetabulum, u
/// forwards along the wing, v up along it, and w = u x v towards the inner (medial) surface.
const ORIGIN: [f64; 3] = [82.0, 5.0, 40.0];
const U: [f64; 3] = [0.439, -0.898, 0.0];
const V: [f64; 3] = [0.233, 0.114, 0.966];

/// The outline in (u, v), mm: from the ASIS back along the crest, down by PSIS and PIIS, along the
/// greater sciatic notch, through the acetabulum's place and up the front by the AIIS.
const OUTLINE: [[f64; 2]; 26] = [
    [65.0, 35.0],
    [65.0, 49.0],
    [60.0, 65.0],
    [52.0, 79.0],
    [40.0, 92.0],
    [22.0, 102.0],
    [0.0, 107.0],
    [-20.0, 108.0],
    [-40.0, 104.0],
    [-58.0, 95.0],
    [-74.0, 81.0],
    [-87.0, 67.0],
    [-95.0, 53.0],
    [-90.0, 40.0],
    [-83.0, 30.0],
    [-78.0, 19.0],
    [-66.0, 16.0],
    [-52.0, 15.0],
    [-40.0, 9.0],
    [-33.0, -3.0],
    [-22.0, -16.0],
    [0.0, -26.0],
    [24.0, -20.0],
    [45.0, -5.0],
    [46.0, 9.0],
    [54.0, 24.0],
];

/// Middle surface and thickness: (u, v, w, thickness), mm.
const BLADE: [[f64; 4]; 47] = [
    [60.0, 38.0, 0.0, 13.0],
    [59.0, 55.0, -7.0, 15.0],
    [48.0, 73.0, -16.0, 18.0],
    [36.0, 88.0, -20.0, 17.0],
    [16.0, 99.0, -15.0, 12.0],
    [-8.0, 104.0, -6.0, 9.5],
    [-35.0, 100.0, 10.0, 11.0],
    [-58.0, 89.0, 14.0, 12.0],
    [-74.0, 73.0, 14.0, 14.0],
    [-91.0, 55.0, 10.0, 14.0],
    [-86.0, 40.0, 9.0, 15.0],
    [-76.0, 25.0, 4.0, 9.0],
    [-60.0, 20.0, 6.0, 16.0],
    [-60.0, 36.0, 6.0, 19.0],
    [-60.0, 55.0, 12.0, 18.0],
    [-60.0, 72.0, 15.0, 16.0],
    [-75.0, 50.0, 11.0, 20.0],
    [-40.0, 20.0, 7.0, 23.0],
    [-40.0, 45.0, 9.0, 19.0],
    [-40.0, 70.0, 13.0, 16.0],
    [-40.0, 88.0, 11.0, 13.0],
    [-30.0, 5.0, 1.0, 20.0],
    [-20.0, 25.0, 5.0, 22.0],
    [-20.0, 45.0, 2.5, 10.0],
    [-20.0, 65.0, 0.5, 5.5],
    [-20.0, 85.0, 0.0, 6.5],
    [-10.0, 70.0, -4.0, 4.0],
    [0.0, 10.0, -1.0, 26.0],
    [0.0, 30.0, -3.0, 14.0],
    [0.0, 50.0, -6.0, 6.5],
    [0.0, 70.0, -8.0, 5.5],
    [0.0, 90.0, -9.0, 7.5],
    [20.0, 10.0, -1.0, 17.0],
    [20.0, 30.0, -5.0, 13.0],
    [20.0, 50.0, -9.0, 10.0],
    [20.0, 70.0, -14.0, 13.0],
    [20.0, 85.0, -16.0, 12.0],
    [40.0, 12.0, 1.0, 13.0],
    [40.0, 30.0, 0.0, 11.0],
    [40.0, 50.0, -5.0, 10.0],
    [40.0, 70.0, -14.0, 16.0],
    [44.0, -3.0, 1.0, 15.0],
    [51.0, 22.0, -1.0, 11.0],
    [0.0, -12.0, -1.0, 32.0],
    [22.0, -12.0, 1.0, 22.0],
    [-20.0, -12.0, -3.0, 24.0],
    [0.0, -26.0, 0.0, 30.0],
];

/// Spacing of the tables in mm and the half width of the square they cover.
const CELL_MM: f64 = 1.0;
const REACH_MM: f64 = 140.0;

#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Signed distance to the outline, negative inside.
    outline: f64,
    middle: f64,
    half_thickness: f64,
}

/// The blade of one side, in its side frame.
#[derive(Clone, Debug)]
pub(super) struct Wing {
    origin: Point,
    axes: [Vector; 3],
    stretch: [f64; 3],
    count: usize,
    table: Vec<Cell>,
}

impl Wing {
    pub fn new(build: &Build, draws: &mut Draws) -> Self {
        let origin = draws.place(ORIGIN, 0.5);
        let turn =
            UnitQuaternion::from_axis_angle(&Vector::z_axis(), draws.value(0.0, 2.0).to_radians());
        let u = turn * Vector::from(U).normalize();
        // A positive flare leans the crest outwards.
        let flare = UnitQuaternion::from_axis_angle(
            &nalgebra::Unit::new_normalize(u),
            draws.value(0.0, 2.5).to_radians(),
        );
        let v = flare * (turn * Vector::from(V));
        let v = (v - u * u.dot(&v)).normalize();
        let [_, sy, sz] = build.scale;
        let outline: Vec<[f64; 2]> = OUTLINE
            .iter()
            .map(|p| [draws.value(p[0], 0.9), draws.value(p[1], 0.9)])
            .collect();
        let outline = smooth_curve(&outline, true, 6);
        let blade: Vec<[f64; 4]> = BLADE
            .iter()
            .map(|b| {
                [
                    b[0],
                    b[1],
                    draws.value(b[2], 0.7),
                    build.girth * b[3] * draws.value(1.0, 0.04),
                ]
            })
            .collect();
        let middle = Spline::new(blade.iter().map(|b| ([b[0], b[1]], b[2])));
        let thickness = Spline::new(blade.iter().map(|b| ([b[0], b[1]], b[3])));
        let count = (2.0 * REACH_MM / CELL_MM) as usize + 1;
        let mut table = Vec::with_capacity(count * count);
        for row in 0..count {
            for column in 0..count {
                let p = [column, row].map(|n| n as f64 * CELL_MM - REACH_MM);
                let distance = polygon_distance(&outline, p);
                // Far from the outline the splines would run away; nothing is there.
                let q = nearest_inside(&outline, p, distance);
                table.push(Cell {
                    outline: distance,
                    middle: middle.at(q),
                    half_thickness: 0.5 * thickness.at(q).max(3.0),
                });
            }
        }
        Self {
            origin,
            axes: [u, v, u.cross(&v)],
            stretch: [sy, sz, sy],
            count,
            table,
        }
    }

    /// The place on the middle surface at (u, v) of the template.
    pub fn middle(&self, u: f64, v: f64) -> Point {
        let w = self.cell(u, v).middle;
        self.origin
            + self.axes[0] * (u * self.stretch[0])
            + self.axes[1] * (v * self.stretch[1])
            + self.axes[2] * (w * self.stretch[2])
    }

    fn cell(&self, u: f64, v: f64) -> Cell {
        let limit = (self.count - 1) as f64 - 1e-6;
        let x = ((u + REACH_MM) / CELL_MM).clamp(0.0, limit);
        let y = ((v + REACH_MM) / CELL_MM).clamp(0.0, limit);
        let (i, j) = (x as usize, y as usize);
        let (fx, fy) = (x - i as f64, y - j as f64);
        let at = |i: usize, j: usize| &self.table[j * self.count + i];
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
        let mix = |f: fn(&Cell) -> f64| {
            (1.0 - fy) * ((1.0 - fx) * f(a) + fx * f(b)) + fy * ((1.0 - fx) * f(c) + fx * f(d))
        };
        Cell {
            outline: mix(|c| c.outline),
            middle: mix(|c| c.middle),
            half_thickness: mix(|c| c.half_thickness),
        }
    }

    pub fn distance(&self, p: &Point) -> f64 {
        let to = p - self.origin;
        let q: [f64; 3] = std::array::from_fn(|a| to.dot(&self.axes[a]) / self.stretch[a]);
        let cell = self.cell(q[0], q[1]);
        let beyond = (q[0].abs().max(q[1].abs()) - REACH_MM).max(0.0);
        // The blade rises and twists: across it, distances are shorter than along w.
        const SLOPE: f64 = 0.93;
        let across = ((q[2] - cell.middle).abs() - cell.half_thickness) * SLOPE;
        let along = cell.outline + beyond;
        // The edge is rounded as far as the blade's thickness allows.
        let round = cell.half_thickness * 0.9;
        let (a, b) = (across + round, along + round);
        let d = a.max(0.0).hypot(b.max(0.0)) + a.max(b).min(0.0) - round;
        d * self.stretch[0].min(self.stretch[1])
    }
}

/// Thin-plate spline: the smoothest surface through scattered values.
struct Spline {
    points: Vec<[f64; 2]>,
    weights: Vec<f64>,
}

fn bump(a: [f64; 2], b: [f64; 2]) -> f64 {
    let r2 = (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
    if r2 > 0.0 { 0.5 * r2 * r2.ln() } else { 0.0 }
}

impl Spline {
    fn new(samples: impl Iterator<Item = ([f64; 2], f64)>) -> Self {
        let (points, values): (Vec<_>, Vec<_>) = samples.unzip();
        let n = points.len();
        let mut matrix = DMatrix::zeros(n + 3, n + 3);
        let mut right = DMatrix::zeros(n + 3, 1);
        for i in 0..n {
            for j in 0..n {
                matrix[(i, j)] = bump(points[i], points[j]);
            }
            // A little slack lets the surface pass near, not through, uneven control values.
            matrix[(i, i)] = 60.0;
            for (k, term) in [1.0, points[i][0], points[i][1]].into_iter().enumerate() {
                matrix[(i, n + k)] = term;
                matrix[(n + k, i)] = term;
            }
            right[(i, 0)] = values[i];
        }
        let weights = matrix
            .lu()
            .solve(&right)
            .expect("distinct control points that are not on one line give a regular system");
        Self {
            points,
            weights: weights.column(0).iter().copied().collect(),
        }
    }

    fn at(&self, p: [f64; 2]) -> f64 {
        let n = self.points.len();
        let mut sum = self.weights[n] + self.weights[n + 1] * p[0] + self.weights[n + 2] * p[1];
        for (point, weight) in self.points.iter().zip(&self.weights) {
            sum += weight * bump(*point, p);
        }
        sum
    }
}

/// Closest point of a closed polygon and its squared distance.
fn closest(polygon: &[[f64; 2]], p: [f64; 2]) -> ([f64; 2], f64) {
    let mut best = (polygon[0], f64::INFINITY);
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (ab, ap) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        let length = ab[0] * ab[0] + ab[1] * ab[1];
        let t = if length > 0.0 {
            ((ap[0] * ab[0] + ap[1] * ab[1]) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let q = [a[0] + t * ab[0], a[1] + t * ab[1]];
        let d = (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
        if d < best.1 {
            best = (q, d);
        }
    }
    best
}

/// Signed distance to a closed polygon, negative inside.
fn polygon_distance(polygon: &[[f64; 2]], p: [f64; 2]) -> f64 {
    let mut inside = false;
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        if (a[1] > p[1]) != (b[1] > p[1])
            && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        {
            inside = !inside;
        }
    }
    let d = closest(polygon, p).1.sqrt();
    if inside { -d } else { d }
}

/// `p`, or the polygon's point closest to it where it lies outside.
fn nearest_inside(polygon: &[[f64; 2]], p: [f64; 2], distance: f64) -> [f64; 2] {
    if distance <= 0.0 {
        p
    } else {
        closest(polygon, p).0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polygon_distance_of_a_square() {
        let square = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        assert!((polygon_distance(&square, [1.0, 2.0]) + 1.0).abs() < 1e-12);
        assert!((polygon_distance(&square, [7.0, 8.0]) - 5.0).abs() < 1e-12);
    }

    #[test]
    fn the_spline_reproduces_a_plane() {
        let corners = [
            [0.0, 0.0],
            [50.0, 3.0],
            [4.0, 40.0],
            [60.0, 70.0],
            [30.0, 20.0],
        ];
        let spline = Spline::new(
            corners
                .into_iter()
                .map(|p| (p, 2.0 + 0.1 * p[0] - 0.3 * p[1])),
        );
        assert!((spline.at([20.0, 30.0]) - (2.0 + 2.0 - 9.0)).abs() < 1e-9);
    }
}

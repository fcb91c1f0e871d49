//! Sacrum and coccyx, and the last lumbar vertebrae. Pelvic frame.

use super::build::{Build, Draws};
use super::distance::{Ellipsoid, Node, Rod, join, meet, smooth_curve};
use crate::geometry::{Point, Vector};

/// Middle curve of the sacrum in the sagittal plane, from its base to the tip of the coccyx:
/// (y, z, half width, half thickness), mm.
const CURVE: [[f64; 4]; 8] = [
    [37.0, 102.0, 54.0, 16.0],
    [49.0, 88.0, 55.0, 17.5],
    [63.0, 74.0, 50.0, 15.0],
    [76.0, 59.0, 41.0, 12.5],
    [87.0, 43.0, 32.0, 9.5],
    [93.0, 27.0, 23.0, 7.5],
    [93.0, 13.0, 11.0, 5.0],
    [88.0, 2.0, 6.0, 4.0],
];

/// Sacral foramina: (place along the curve in nodes, distance from the midline, radius).
const FORAMINA: [[f64; 3]; 4] = [
    [1.25, 23.0, 5.0],
    [2.35, 20.5, 4.5],
    [3.35, 18.0, 4.0],
    [4.3, 15.5, 3.4],
];

const PIECES: usize = 8;

/// How far the bone reaches beyond its curve's ends.
const END_MM: f64 = 1.0;

#[derive(Clone, Debug)]
pub(super) struct Sacrum {
    curve: Vec<[f64; 4]>,
    body: Ellipsoid,
    crest: Rod,
    canal: Rod,
    foramina: Vec<Rod>,
}

impl Sacrum {
    pub fn new(build: &Build, draws: &mut Draws) -> Self {
        let [sx, ..] = build.scale;
        let shift = draws.value(0.0, 2.0);
        let nodes: Vec<[f64; 4]> = CURVE
            .iter()
            .map(|c| {
                let p = draws.place([0.0, c[0], c[1]], 0.8);
                let width = c[2] * sx * draws.value(1.0, 0.02);
                [p.y + shift, p.z, width, c[3] * build.girth]
            })
            .collect();
        let curve = smooth_curve(&nodes, false, PIECES);
        let at = |place: f64, across: f64, x: f64| {
            let i = (place * PIECES as f64).round() as usize;
            let i = i.min(curve.len() - 2);
            let (a, b) = (curve[i], curve[i + 1]);
            let t = Vector::new(0.0, b[0] - a[0], b[1] - a[1]).normalize();
            let normal = Vector::new(0.0, -t.z, t.y);
            Point::new(x, a[0], a[1]) + normal * across
        };
        let node = |center: Point, radius: f64| Node { center, radius };
        let g = build.girth;
        let crest = Rod::new(vec![
            node(at(0.6, 22.0 * g, 0.0), 4.5),
            node(at(2.0, 19.0 * g, 0.0), 4.5),
            node(at(3.6, 12.5 * g, 0.0), 3.5),
        ]);
        let canal = Rod::widened(
            vec![
                node(at(0.0, 12.0 * g, 0.0), 7.0),
                node(at(2.0, 9.0 * g, 0.0), 5.0),
                node(at(4.2, 6.0 * g, 0.0), 2.0),
            ],
            Vector::x(),
            1.5,
        );
        let foramina = FORAMINA
            .iter()
            .flat_map(|f| [-1.0, 1.0].map(|s| (f[0], s * f[1] * sx, f[2])))
            .map(|(place, x, r)| {
                Rod::new(vec![
                    node(at(place, -22.0, x * 1.12), r * 1.25),
                    node(at(place, 0.0, x), r),
                    node(at(place, 22.0, x * 0.92), r * 0.8),
                ])
            })
            .collect();
        let t = Vector::new(0.0, curve[4][0] - curve[0][0], curve[4][1] - curve[0][1]).normalize();
        let body = Ellipsoid {
            center: at(0.35, -3.5 * g, 0.0),
            axes: [Vector::x(), t, Vector::new(0.0, -t.z, t.y)],
            radii: [27.0 * g, 17.0 * g, 18.5 * g],
        };
        Self {
            curve,
            body,
            crest,
            canal,
            foramina,
        }
    }

    /// The middle of the sacrum's base and the unit direction from which it is seen head-on: where
    /// the spine stands.
    pub fn base(&self) -> (Point, Vector) {
        let (a, b) = (self.curve[0], self.curve[PIECES]);
        let up = Vector::new(0.0, a[0] - b[0], a[1] - b[1]).normalize();
        (Point::new(0.0, a[0], a[1]) + up * 2.0, up)
    }

    /// Signed distance to the surface, without regard to the hip bones.
    pub fn distance(&self, p: &Point) -> f64 {
        let mut best = (f64::INFINITY, 0.0, 0.0, 0.0, 0.0);
        let mut whole_length = 0.0;
        for pair in self.curve.windows(2) {
            let (a, b) = (pair[0], pair[1]);
            let (ty, tz) = (b[0] - a[0], b[1] - a[1]);
            let (py, pz) = (p.y - a[0], p.z - a[1]);
            let length = ty.hypot(tz);
            let s = (py * ty + pz * tz) / (length * length);
            let h = s.clamp(0.0, 1.0);
            let (ay, az) = (py - h * ty, pz - h * tz);
            let d2 = ay * ay + az * az;
            if d2 < best.0 {
                // Signed: posterior positive; and along the curve, from the base.
                let across = (-tz * py + ty * pz) / length;
                let mix = |k: usize| a[k] + h * (b[k] - a[k]);
                best = (d2, across, whole_length + s * length, mix(2), mix(3));
            }
            whole_length += length;
        }
        let (_, across, from_base, width, thick) = best;
        // The wings of the sacrum are thinner at the back, where the multifidus lies.
        let side = (p.x.abs() / width).min(1.2);
        let half = thick * (1.0 - 0.18 * side * side);
        let shift = 0.12 * thick * side;
        let round = half.min(7.0);
        // Its upper edge falls off beside the promontory.
        let fallen = 0.22 * (p.x.abs() - 24.0).max(0.0);
        let q = [
            p.x.abs() - width + round,
            (across + shift).abs() - half + round,
            (fallen - from_base).max(from_base - whole_length) - END_MM + round,
        ];
        let outside = q.iter().map(|v| v.max(0.0).powi(2)).sum::<f64>().sqrt();
        let plate = outside + q[0].max(q[1]).max(q[2]).min(0.0) - round;
        let mut d = join(plate, self.body.distance(p), 8.0);
        d = join(d, self.crest.distance(p), 6.0);
        d = meet(d, -self.canal.distance(p), 2.0);
        for hole in &self.foramina {
            d = meet(d, -hole.distance(p), 2.0);
        }
        d
    }
}

/// A lumbar vertebra.
#[derive(Clone, Debug)]
struct Vertebra {
    center: Point,
    axes: [Vector; 3],
    half: [f64; 3],
    arch: Vec<(Rod, f64)>,
}

/// The lumbar spine above the sacrum: L5, L4 and L3 as far as the volume reaches.
#[derive(Clone, Debug)]
pub(super) struct Spine {
    vertebrae: Vec<Vertebra>,
}

impl Spine {
    pub fn new(build: &Build, draws: &mut Draws, sacrum: &Sacrum) -> Self {
        let g = build.girth;
        let (mut at, mut up) = sacrum.base();
        let mut vertebrae = Vec::new();
        for level in 0..3 {
            let disc = draws.value(10.0, 1.0);
            let height = draws.value(28.0, 1.0) * g;
            // The lumbar lordosis: each level stands more upright than that below.
            let lean = draws.value([14.0, 12.0, 9.0][level], 1.5).to_radians();
            let turn = nalgebra::Rotation3::from_axis_angle(&Vector::x_axis(), lean);
            up = if up.y < 0.0 {
                (turn.inverse() * up).normalize()
            } else {
                up
            };
            let x = Vector::x();
            let back = up.cross(&x).normalize();
            let center = at + up * (disc + 0.5 * height);
            let half = [25.5 * g, 17.5 * g, 0.5 * height];
            let node = |a: f64, b: f64, c: f64, radius: f64| Node {
                center: center + x * a + back * b + up * c,
                radius: radius * g,
            };
            let mut arch = vec![(
                Rod::widened(
                    vec![node(0.0, 36.0, -2.0, 3.5), node(0.0, 62.0, -10.0, 4.0)],
                    up,
                    2.2,
                ),
                4.0,
            )];
            for s in [-1.0, 1.0] {
                arch.push((
                    Rod::new(vec![
                        node(15.0 * s, 12.0, 5.0, 5.0),
                        node(17.0 * s, 26.0, 3.0, 5.5),
                        node(0.0, 38.0, -5.0, 4.0),
                    ]),
                    4.0,
                ));
                arch.push((
                    Rod::new(vec![
                        node(17.0 * s, 22.0, 4.0, 5.0),
                        node(44.0 * s, 26.0, 7.0, 3.5),
                    ]),
                    4.0,
                ));
                arch.push((
                    Rod::new(vec![
                        node(19.0 * s, 30.0, 16.0, 5.0),
                        node(17.0 * s, 32.0, -20.0, 5.0),
                    ]),
                    4.0,
                ));
            }
            vertebrae.push(Vertebra {
                center,
                axes: [x, back, up],
                half,
                arch,
            });
            at = center + up * (0.5 * height);
        }
        Self { vertebrae }
    }

    /// Signed distance to the nearest vertebra's surface.
    pub fn distance(&self, p: &Point) -> f64 {
        self.vertebrae
            .iter()
            .map(|v| v.distance(p))
            .fold(f64::INFINITY, f64::min)
    }

    /// Signed distance to the column of vertebral bodies and discs, for the soft tissue between.
    pub fn column(&self, p: &Point) -> f64 {
        self.vertebrae
            .iter()
            .map(|v| v.pillar(p, 8.0))
            .fold(f64::INFINITY, f64::min)
    }
}

impl Vertebra {
    /// Distance to the body, made `taller` at both ends.
    fn pillar(&self, p: &Point, taller: f64) -> f64 {
        let to = p - self.center;
        let [x, y, z]: [f64; 3] = std::array::from_fn(|a| to.dot(&self.axes[a]));
        let waist = 1.0 - 0.09 * (1.0 - (z / self.half[2]).powi(2)).max(0.0);
        let (rx, ry) = (self.half[0] * waist, self.half[1] * waist);
        let ring = (x / rx).hypot(y / ry);
        let side = (ring - 1.0) * rx.min(ry);
        meet(side, z.abs() - self.half[2] - taller, 3.0)
    }

    fn distance(&self, p: &Point) -> f64 {
        let mut d = self.pillar(p, 0.0);
        for (rod, k) in &self.arch {
            d = join(d, rod.distance(p), *k);
        }
        d
    }
}

//! One hip bone: ilium, ischium, pubis and the socket where they meet. All numbers of the template
//! are mm in the side frame (x lateral, y posterior, z superior, origin midway between the heads).

use super::acetabulum::Acetabulum;
use super::build::{Build, Draws};
use super::distance::{Ellipsoid, Node, Rod, first_crossing, join, meet, onto_surface};
use super::wing::Wing;
use crate::anatomy::Landmark;
use crate::geometry::{Point, Vector};

/// Half the gap of the pubic symphysis.
const SYMPHYSIS_HALF_MM: f64 = 2.2;

#[derive(Clone, Debug)]
pub(super) struct HipBone {
    pub acetabulum: Acetabulum,
    wing: Wing,
    rods: Vec<(Rod, f64)>,
    lumps: Vec<(Ellipsoid, f64)>,
    /// A point in the obturator foramen and the unit normal of its plane.
    pub foramen: (Point, Vector),
}

/// Template of a rod: (x, y, z, radius) of its nodes.
fn rod(draws: &mut Draws, build: &Build, nodes: &[[f64; 4]], wide: Option<([f64; 3], f64)>) -> Rod {
    let nodes = nodes
        .iter()
        .map(|n| Node {
            center: draws.place([n[0], n[1], n[2]], 0.8),
            radius: n[3] * build.girth,
        })
        .collect();
    match wide {
        None => Rod::new(nodes),
        Some((axis, ratio)) => Rod::widened(nodes, Vector::from(axis), ratio),
    }
}

impl HipBone {
    /// `lce` in rad.
    pub fn new(build: &Build, draws: &mut Draws, lce: f64) -> Self {
        let head = draws.place([85.0, 0.0, 0.0], 0.7);
        let wing = Wing::new(build, draws);
        let pubis = draws.place([13.0, -32.0, -23.0], 0.6);
        // The anterior pelvic plane's up, as the landmarks will give it.
        let up = wing.middle(63.0, 36.0) - (pubis + Vector::new(0.0, 15.0, -17.0));
        let up = Vector::new(0.0, up.y, up.z).normalize();
        let acetabulum = Acetabulum::new(build, draws, head, &up, lce);
        let rods = vec![
            // Posterior column, from the sciatic notch to the ischium.
            (
                rod(
                    draws,
                    build,
                    &[
                        [70.0, 26.0, 32.0, 12.5],
                        [66.0, 31.0, 12.0, 12.0],
                        [63.5, 33.0, -10.0, 12.5],
                        [62.0, 35.0, -32.0, 12.5],
                        [59.0, 34.0, -43.0, 12.0],
                    ],
                    Some(([-0.15, 1.0, 0.0], 1.45)),
                ),
                9.0,
            ),
            // Ischial spine.
            (
                rod(
                    draws,
                    build,
                    &[[61.0, 42.0, 7.0, 7.0], [53.5, 54.0, 3.5, 2.6]],
                    None,
                ),
                6.0,
            ),
            // Tuberosity and ramus of the ischium, inferior ramus of the pubis.
            (
                rod(
                    draws,
                    build,
                    &[
                        [54.0, 33.0, -50.0, 10.0],
                        [46.0, 25.0, -54.0, 7.5],
                        [34.0, 9.0, -53.0, 6.0],
                        [21.0, -7.0, -45.0, 6.2],
                        [13.0, -18.0, -36.0, 7.0],
                    ],
                    Some(([-0.35, -0.45, 0.82], 1.5)),
                ),
                8.0,
            ),
            // Superior ramus of the pubis, from the iliopubic eminence.
            (
                rod(
                    draws,
                    build,
                    &[
                        [66.0, -15.0, 16.0, 12.5],
                        [53.0, -20.0, 6.0, 10.0],
                        [40.0, -26.0, -3.5, 8.2],
                        [28.0, -32.0, -12.5, 9.5],
                        [14.0, -37.0, -19.0, 10.0],
                    ],
                    None,
                ),
                8.0,
            ),
        ];
        let tilted = |center: Point, radii: [f64; 3]| Ellipsoid {
            center,
            axes: [
                Vector::x(),
                Vector::new(0.0, 0.72, -0.69),
                Vector::new(0.0, 0.69, 0.72),
            ],
            radii: radii.map(|r| r * build.girth),
        };
        let lumps = vec![
            // Body of the pubis.
            (tilted(pubis, [17.0, 24.5, 10.0]), 5.0),
            // Pubic tubercle.
            (
                Ellipsoid::aligned(draws.place([24.0, -46.0, -13.0], 0.8), [5.5, 5.5, 5.0]),
                5.0,
            ),
            // Quadrilateral plate, the flat inner wall behind the socket.
            (
                Ellipsoid::aligned(
                    draws.place([61.0, 13.0, 4.0], 0.5),
                    [8.0, 33.0, 25.0].map(|r| r * build.girth),
                ),
                8.0,
            ),
            // Ischial tuberosity.
            (
                Ellipsoid::aligned(
                    draws.place([59.0, 37.0, -45.0], 0.8),
                    [13.0, 15.0, 17.0].map(|r| r * build.girth),
                ),
                8.0,
            ),
            // AIIS.
            (
                Ellipsoid::aligned(
                    wing.middle(43.0, -4.0),
                    [7.5, 8.0, 9.5].map(|r| r * build.girth),
                ),
                8.0,
            ),
        ];
        let center = draws.place([38.0, -7.0, -30.0], 0.0);
        let foramen = (center, Vector::new(0.63, -0.49, -0.60).normalize());
        Self {
            acetabulum,
            wing,
            rods,
            lumps,
            foramen,
        }
    }

    /// Signed distance to the bone's surface.
    pub fn distance(&self, p: &Point) -> f64 {
        let mut d = join(self.wing.distance(p), self.acetabulum.ball(p), 7.0);
        for (rod, k) in &self.rods {
            d = join(d, rod.distance(p), *k);
        }
        for (lump, k) in &self.lumps {
            d = join(d, lump.distance(p), *k);
        }
        d = meet(d, -self.acetabulum.hollow(p), 1.5);
        meet(d, SYMPHYSIS_HALF_MM - p.x, 2.0)
    }

    /// The acetabular rim, on the bone's surface.
    pub fn rim(&self) -> Vec<Point> {
        let points = self.acetabulum.rim_points();
        points.iter().map(|p| self.on_surface(p)).collect()
    }

    /// The top of the iliac crest.
    pub fn crest(&self) -> Point {
        self.surface_from(&self.wing.middle(-18.0, 100.0), [0.0, 0.0, 1.0])
    }

    fn on_surface(&self, p: &Point) -> Point {
        onto_surface(|q| self.distance(q), p)
    }

    /// The surface met from a point beside it, in the bone or out of it, towards `direction`.
    fn surface_from(&self, start: &Point, direction: [f64; 3]) -> Point {
        let d = |q: &Point| self.distance(q);
        let found = first_crossing(d, start, &Vector::from(direction), 0.5, 60.0);
        self.on_surface(&found.unwrap_or(*start))
    }

    /// The edge of the obturator foramen: where rays from its middle, in its plane, meet bone.
    pub fn foramen_edge(&self) -> Vec<Point> {
        let (center, normal) = &self.foramen;
        let a = normal.cross(&Vector::x()).normalize();
        let b = normal.cross(&a);
        let d = |q: &Point| self.distance(q);
        (0..180)
            .filter_map(|i| {
                let turn = std::f64::consts::TAU * f64::from(i) / 180.0;
                let out = a * turn.cos() + b * turn.sin();
                first_crossing(d, center, &out, 0.5, 60.0)
            })
            .collect()
    }

    /// A landmark on the bone's surface ([`Landmark::Fh`]: the head's centre), side frame.
    pub fn landmark(&self, landmark: Landmark) -> Point {
        let pubis = self.lumps[0].0.center;
        let face = |y: f64, z: f64| Point::new(SYMPHYSIS_HALF_MM + 3.0, pubis.y + y, pubis.z + z);
        match landmark {
            Landmark::Asis => self.surface_from(&self.wing.middle(60.0, 37.0), [0.25, -1.0, -0.15]),
            Landmark::Aiis => self.surface_from(&self.wing.middle(43.0, -4.0), [0.1, -1.0, -0.1]),
            Landmark::Fh => self.acetabulum.center,
            Landmark::Sps => self.surface_from(&face(-5.0, 4.0), [0.0, -0.55, 0.85]),
            Landmark::Ips => self.surface_from(&face(8.0, -8.0), [0.0, 0.72, -0.69]),
            Landmark::Mof => extreme(&self.foramen_edge(), |p| p.x),
            Landmark::Iof => extreme(&self.foramen_edge(), |p| p.z),
            Landmark::Gsn => {
                // Its roof, where the notch's border is highest: seen from within the notch.
                let (within, roof) = (self.wing.middle(-58.0, -2.0), self.wing.middle(-42.0, 12.0));
                let to = roof - within;
                self.surface_from(&within, [to.x, to.y, to.z])
            }
        }
    }
}

/// The point with the smallest value.
fn extreme(points: &[Point], value: impl Fn(&Point) -> f64) -> Point {
    points
        .iter()
        .copied()
        .min_by(|a, b| value(a).total_cmp(&value(b)))
        .expect("the foramen is surrounded by bone")
}

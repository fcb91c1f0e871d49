//! The socket of the hip: a hollow of constant joint space around the femoral head, a rim of
//! uneven height, a fossa and a notch.

use super::build::{Build, Draws};
use super::distance::{Ellipsoid, Node, Rod, join};
use crate::geometry::{Point, Vector};

/// Height of the rim in degrees from the socket's pole, every 45 deg from superior by anterior,
/// inferior and posterior: low at the front, lowest at the notch.
const RIM_DEG: [f64; 8] = [74.0, 76.0, 74.0, 69.0, 60.0, 74.0, 79.0, 76.0];
/// Where an anteverted rim is most lateral: behind its top (rad).
const MOST_LATERAL: f64 = -0.25 * std::f64::consts::PI;
/// Points of the rim's trace: at most 3 mm apart on a rim of 30 mm radius.
const RIM_POINTS: usize = 100;

#[derive(Clone, Debug)]
pub(super) struct Acetabulum {
    pub center: Point,
    /// Radius of the hollow in mm: femoral head and joint space.
    pub radius: f64,
    /// Thickness of the socket's wall in mm.
    pub wall: f64,
    /// Unit direction out of the socket: laterally, forwards and down.
    pub axis: Vector,
    superior: Vector,
    anterior: Vector,
    rim: [f64; 8],
    fossa: Ellipsoid,
    notch: Rod,
}

impl Acetabulum {
    /// The socket around `center`, whose rim gives the drawn lateral centre-edge angle in the
    /// coronal plane that holds `up`.
    pub fn new(build: &Build, draws: &mut Draws, center: Point, up: &Vector, lce: f64) -> Self {
        let inclination = draws.value(42.0, 2.5).to_radians();
        let anteversion = draws.value(18.0, 3.0).to_radians();
        let axis = Vector::new(
            anteversion.cos() * inclination.sin(),
            -anteversion.sin(),
            -anteversion.cos() * inclination.cos(),
        );
        let superior = (Vector::z() - axis * axis.z).normalize();
        let mut anterior = axis.cross(&superior);
        if anterior.y > 0.0 {
            anterior = -anterior;
        }
        let radius = build.head_radius + build.joint_space;
        let rim = RIM_DEG.map(|a| draws.value(a, 1.2).to_radians());
        let mut cup = Self {
            center,
            radius,
            wall: 5.5 * build.girth,
            axis,
            superior,
            anterior,
            rim,
            fossa: Ellipsoid::aligned(center, [1.0; 3]),
            notch: Rod::new(Vec::new()),
        };
        let deep = draws.value(3.2, 0.4);
        let floor = cup.direction(24f64.to_radians(), std::f64::consts::PI);
        let small = 0.62 * radius;
        cup.fossa = Ellipsoid::aligned(center + floor * (radius - small + deep), [small; 3]);
        let at = |degrees: f64, r: f64| Node {
            center: center + cup.direction(f64::to_radians(degrees), std::f64::consts::PI) * r,
            radius: 7.5,
        };
        cup.notch = Rod::new(vec![at(35.0, radius - 3.0), at(72.0, radius)]);
        cup.raise_rim(up, lce);
        cup
    }

    /// Unit direction at `height` (rad) from the pole, at `turn` (rad) from superior by anterior.
    fn direction(&self, height: f64, turn: f64) -> Vector {
        -self.axis * height.cos()
            + (self.superior * turn.cos() + self.anterior * turn.sin()) * height.sin()
    }

    /// Height of the rim in rad.
    fn rim_height(&self, turn: f64) -> f64 {
        let x = turn.rem_euclid(std::f64::consts::TAU) / std::f64::consts::FRAC_PI_4;
        let i = x as usize % 8;
        let t = x - x.floor();
        let [a, b, c, d] = [7, 0, 1, 2].map(|k| self.rim[(i + k) % 8]);
        0.5 * (2.0 * b
            + (c - a) * t
            + (2.0 * a - 5.0 * b + 4.0 * c - d) * t * t
            + (3.0 * b - a - 3.0 * c + d) * t * t * t)
    }

    /// Points on the rim's edge, ordered from superior by anterior, inferior and posterior.
    pub fn rim_points(&self) -> Vec<Point> {
        (0..RIM_POINTS)
            .map(|i| {
                let turn = std::f64::consts::TAU * i as f64 / RIM_POINTS as f64;
                let out = self.direction(self.rim_height(turn), turn);
                self.center + out * (self.radius + 0.35 * self.wall)
            })
            .collect()
    }

    /// The angle (rad) from `up` to the most lateral point of the rim, in the plane of x and `up`.
    fn center_edge(&self, up: &Vector) -> f64 {
        let edge = self
            .rim_points()
            .into_iter()
            .map(|p| p - self.center)
            .max_by(|a, b| a.x.total_cmp(&b.x))
            .expect("the rim has points");
        edge.x.atan2(edge.dot(up))
    }

    /// Raises or lowers the upper rim until the centre-edge angle is `wanted` (rad).
    fn raise_rim(&mut self, up: &Vector, wanted: f64) {
        let drawn = self.rim;
        let (mut low, mut high) = (-0.6, 0.6);
        for _ in 0..30 {
            let shift = 0.5 * (low + high);
            for (k, angle) in self.rim.iter_mut().enumerate() {
                let turn = k as f64 * std::f64::consts::FRAC_PI_4;
                *angle = drawn[k] + shift * (0.5 + 0.5 * (turn - MOST_LATERAL).cos());
            }
            if self.center_edge(up) < wanted {
                low = shift;
            } else {
                high = shift;
            }
        }
    }

    /// Distance to the hollow that the head, the fat of the fossa and the ligament of the notch
    /// fill, and to the mouth above the rim.
    pub fn hollow(&self, p: &Point) -> f64 {
        let to = p - self.center;
        let r = to.norm();
        let ball = r - self.radius;
        let mouth = if r < 1e-6 {
            -self.radius
        } else {
            let across = to.dot(&self.axis);
            let height = (to - self.axis * across).norm().atan2(-across);
            let turn = to.dot(&self.anterior).atan2(to.dot(&self.superior));
            let above = 0.8 * r * (self.rim_height(turn) - height);
            above.max(r - self.radius - self.wall - 3.0)
        };
        let floor = join(ball, self.fossa.distance(p), 2.0);
        floor.min(self.notch.distance(p)).min(mouth)
    }

    /// Distance to the ball that the socket is hollowed from.
    pub fn ball(&self, p: &Point) -> f64 {
        (p - self.center).norm() - self.radius - self.wall
    }
}

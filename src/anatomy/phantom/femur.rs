//! The upper femur.

use super::build::{Build, Draws, Sex};
use super::distance::{Ellipsoid, Node, Rod, join};
use crate::geometry::{Point, Vector};
use nalgebra::UnitQuaternion;

/// One femur, in its side frame (pelvic frame with x lateral).
#[derive(Clone, Debug)]
pub(super) struct Femur {
    pub head: Point,
    pub head_radius: f64,
    neck: Rod,
    trochanters: Vec<(Rod, f64)>,
    fovea: Ellipsoid,
    /// Two points of the shaft's axis, from the trochanters down.
    pub shaft_axis: [Point; 2],
    shaft: Rod,
}

impl Femur {
    /// `down` is the direction of the table's lower end in the side frame: the leg lies along it.
    pub fn new(build: &Build, draws: &mut Draws, head: Point, down: &Vector) -> Self {
        let g = build.girth;
        let radius = build.head_radius;
        // The shafts of people who lie with their knees together lean inwards.
        let lean = draws.value(6.5, 1.2).to_radians();
        let turn = UnitQuaternion::rotation_between(&-Vector::z(), down)
            .unwrap_or_else(UnitQuaternion::identity);
        let shaft = turn * Vector::new(-lean.sin(), 0.04, -lean.cos()).normalize();
        let lateral = (Vector::x() - shaft * shaft.x).normalize();
        let posterior = {
            let p = lateral.cross(&shaft);
            if p.y < 0.0 { -p } else { p }
        };
        // The angle from the horizontal plane at which the neck leans forwards: anteversion and
        // the leg's own rotation (most lie with the foot turned out).
        let version = draws.value(13.0, 3.0) + draws.value(5.0, 3.5);
        let version = version.to_radians();
        let angle = (180.0 - draws.value(127.0, 2.5)).to_radians();
        let out = lateral * version.cos() + posterior * version.sin();
        let behind = posterior * version.cos() - lateral * version.sin();
        let axis = (shaft * angle.cos() + out * angle.sin()).normalize();
        let mean = if build.sex == Sex::Male { 54.0 } else { 49.5 };
        let length = draws.value(mean, 1.8);
        let junction = head + axis * length;
        let r = draws.value(14.6, 0.5) * g;
        let along = |s: f64| head + axis * s;
        let node = |center: Point, radius: f64| Node { center, radius };
        let waist = radius * 0.66;
        let neck = Rod::widened(
            vec![
                node(along(radius * 0.55), radius * 0.72),
                node(along(length * 0.55), waist),
                node(along(length * 0.85), waist * 1.06),
            ],
            shaft - axis * axis.dot(&shaft),
            1.16,
        );
        let up = -shaft;
        let greater = Rod::widened(
            vec![
                node(junction + out * 5.0 * g + up * -8.0, 15.0 * g),
                node(
                    junction + out * 10.0 * g + behind * 6.0 + up * 10.0,
                    12.5 * g,
                ),
                node(
                    junction + out * 7.0 * g + behind * 12.0 + up * 26.0,
                    7.0 * g,
                ),
            ],
            behind,
            1.25,
        );
        let between = Rod::new(vec![
            node(along(length * 0.8), waist),
            node(junction + shaft * 12.0 - out * 2.0, 16.5 * g),
            node(junction + shaft * 38.0, r * 1.06),
        ]);
        let lesser = Rod::new(vec![
            node(junction + shaft * 24.0 - out * 6.0 + behind * 6.0, 10.0 * g),
            node(
                junction + shaft * 26.0 - out * 14.5 + behind * 13.0,
                7.5 * g,
            ),
        ]);
        let top = junction + shaft * 30.0;
        let bottom = junction + shaft * 260.0 - behind * 6.0;
        let fovea = Ellipsoid::aligned(
            head - axis * (radius + 1.2) + posterior * 3.0 - up * 2.0,
            [4.5; 3],
        );
        Self {
            head,
            head_radius: radius,
            neck,
            trochanters: vec![(between, 8.0), (greater, 9.0), (lesser, 12.0)],
            fovea,
            shaft_axis: [top, bottom],
            shaft: Rod::new(vec![node(top, r * 1.06), node(bottom, r * 0.95)]),
        }
    }

    /// Signed distance to the bone's surface.
    pub fn distance(&self, p: &Point) -> f64 {
        let mut d = self.neck.distance(p);
        for (part, k) in &self.trochanters {
            d = join(d, part.distance(p), *k);
        }
        d = join(d, self.shaft.distance(p), 10.0);
        // The neck begins so deep that its fillet does not thicken the head's articular surface.
        let d = join(d, (p - self.head).norm() - self.head_radius, 3.0);
        d.max(-self.fovea.distance(p))
    }
}

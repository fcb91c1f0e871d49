//! Everything that is not bone: skin, fat, muscle, the pelvic organs, bowel gas and air.

use super::distance::{Ellipsoid, Node, Rod, join, smooth_step};
use super::noise::Noise;
use super::skeleton::{Skeleton, sided};
use crate::anatomy::Side;
use crate::geometry::{Point, Vector};
use crate::random::Stream;
use rand::RngExt;

const AIR_HU: f64 = -1000.0;
const FAT_HU: f64 = -116.0;
const MUSCLE_HU: f64 = 31.0;
/// Fat around a vessel.
const SHEATH_MM: f64 = 3.0;

/// Torso: (z above the heads, half width, half depth) in mm; y of its middle is fixed.
const TORSO: [[f64; 3]; 6] = [
    [200.0, 158.0, 104.0],
    [150.0, 162.0, 106.0],
    [90.0, 172.0, 112.0],
    [20.0, 184.0, 116.0],
    [-40.0, 184.0, 112.0],
    [-90.0, 176.0, 104.0],
];
const MIDDLE_Y: f64 = 22.0;

/// Abdominal and pelvic cavity (pelvic frame): (z, half width, y of the middle, half depth).
const CAVITY: [[f64; 4]; 7] = [
    [230.0, 118.0, -22.0, 58.0],
    [140.0, 112.0, -20.0, 56.0],
    [95.0, 92.0, -12.0, 50.0],
    [60.0, 62.0, 5.0, 50.0],
    [25.0, 52.0, 20.0, 56.0],
    [-5.0, 42.0, 20.0, 50.0],
    [-38.0, 18.0, 20.0, 28.0],
];

/// Linear interpolation in rows sorted by falling first column.
fn row_at<const N: usize>(rows: &[[f64; N]], z: f64) -> [f64; N] {
    let i = rows[1..rows.len() - 1]
        .iter()
        .take_while(|r| r[0] > z)
        .count();
    let (a, b) = (rows[i], rows[i + 1]);
    let t = ((z - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}

/// Roughly the distance to the ellipse-like curve |x/a|^n + |y/b|^n = 1.
fn squircle(x: f64, y: f64, a: f64, b: f64) -> f64 {
    let (u, v) = ((x / a).powi(2), (y / b).powi(2));
    // Between an ellipse (n = 2) and a rounded box (n = 4).
    let r = 0.5 * (u + v).sqrt() + 0.5 * (u * u + v * v).sqrt().sqrt();
    (r - 1.0) * a.min(b)
}

#[derive(Debug)]
pub(super) struct SoftTissue {
    origin: Point,
    size: [f64; 2],
    fat: f64,
    thighs: [[Point; 2]; 2],
    iliopsoas: Vec<Rod>,
    /// With the box outside of which a vessel and its sheath cannot be.
    vessels: Vec<([Point; 2], Rod)>,
    bladder: Ellipsoid,
    organ: Ellipsoid,
    rectum: Rod,
    rectal_gas: Ellipsoid,
    fascicles: Noise,
    grain: Noise,
    bowel: Noise,
    folds: Noise,
}

fn rod(nodes: &[[f64; 4]], scale: [f64; 3], side: f64) -> Rod {
    let nodes = nodes.iter().map(|n| Node {
        center: Point::new(n[0] * scale[0] * side, n[1] * scale[1], n[2] * scale[2]),
        radius: n[3],
    });
    Rod::new(nodes.collect())
}

impl SoftTissue {
    pub fn new(skeleton: &Skeleton, stream: &mut Stream) -> Self {
        let build = &skeleton.build;
        let scale = build.scale;
        let world = |p: Point| build.world_from_pelvis * p;
        let thighs = Side::BOTH.map(|side| {
            let axis = skeleton.femora[side.index()].shaft_axis;
            axis.map(|p| world(sided(&p, side)))
        });
        let both = |nodes: &[[f64; 4]]| [1.0, -1.0].map(|s| rod(nodes, scale, s));
        let iliopsoas = both(&[
            [42.0, 32.0, 210.0, 19.0],
            [52.0, 22.0, 150.0, 22.0],
            [68.0, -2.0, 95.0, 22.0],
            [84.0, -30.0, 42.0, 19.0],
            [92.0, -36.0, 5.0, 17.0],
            [98.0, -8.0, -45.0, 11.0],
        ]);
        let vessels = both(&[
            [30.0, 18.0, 120.0, 6.0],
            [50.0, -15.0, 62.0, 6.0],
            [68.0, -48.0, 15.0, 5.5],
            [76.0, -50.0, -40.0, 5.5],
            [84.0, -30.0, -160.0, 5.0],
        ]);
        let veins = both(&[
            [24.0, 26.0, 120.0, 7.0],
            [42.0, -6.0, 62.0, 7.0],
            [56.0, -46.0, 15.0, 6.5],
            [64.0, -46.0, -40.0, 6.0],
            [74.0, -28.0, -160.0, 5.5],
        ]);
        let mut vary = |low: f64, high: f64| low + (high - low) * stream.random::<f64>();
        let full = vary(0.75, 1.15);
        let bladder = Ellipsoid::aligned(
            Point::new(vary(-4.0, 4.0), -14.0, 14.0 * full),
            [38.0 * full, 27.0 * full, 24.0 * full],
        );
        let organ = Ellipsoid::aligned(Point::new(vary(-3.0, 3.0), 22.0, -2.0), [24.0, 17.0, 20.0]);
        let rectum = rod(
            &[
                [4.0, 52.0, 78.0, 13.0],
                [-4.0, 72.0, 45.0, 15.0],
                [0.0, 66.0, 8.0, 15.0],
                [0.0, 48.0, -30.0, 11.0],
            ],
            scale,
            1.0,
        );
        let rectal_gas = Ellipsoid::aligned(
            Point::new(vary(-4.0, 2.0), 64.0, vary(15.0, 45.0)),
            [8.0, 7.0, vary(8.0, 16.0)],
        );
        let size = [
            vary(0.98, 1.03) * (scale[0] / 1.045) + (build.fat - 20.0) * 0.004,
            vary(0.98, 1.03) + (build.fat - 20.0) * 0.004,
        ];
        Self {
            origin: Point::from(build.world_from_pelvis.translation.vector),
            size,
            fat: build.fat,
            thighs,
            iliopsoas: iliopsoas.into(),
            vessels: vessels
                .into_iter()
                .chain(veins)
                .map(|rod| (rod.bounds(SHEATH_MM), rod))
                .collect(),
            bladder,
            organ,
            rectum,
            rectal_gas,
            fascicles: Noise::new(stream),
            grain: Noise::new(stream),
            bowel: Noise::new(stream),
            folds: Noise::new(stream),
        }
    }

    /// World box (min, max) of the body in x and y.
    pub fn bounds(&self) -> ([f64; 2], [f64; 2]) {
        let half = [190.0 * self.size[0], 119.0 * self.size[1]];
        let middle = [self.origin.x, self.origin.y + MIDDLE_Y];
        (
            [middle[0] - half[0], middle[1] - half[1]],
            [middle[0] + half[0], middle[1] + half[1]],
        )
    }

    /// Roughly the distance to the skin; `p` in the world.
    pub fn skin(&self, p: &Point) -> f64 {
        let q = p - self.origin;
        let [_, a, b] = row_at(&TORSO, q.z);
        let (a, b) = (a * self.size[0], b * self.size[1]);
        // The back is pressed flat by the table.
        let y = q.y - MIDDLE_Y;
        let b_here = if y > 0.0 { b * 0.96 } else { b };
        let mut d = squircle(q.x, y, a, b_here);
        if q.z < 60.0 {
            // Below the crotch the torso thins out into the thighs.
            d += (1.0 - smooth_step(-95.0, -45.0, q.z)) * 60.0;
            for axis in &self.thighs {
                let t = (p.z - axis[0].z) / (axis[1].z - axis[0].z);
                let c = axis[0] + (axis[1] - axis[0]) * t;
                let inward = (c.x - self.origin.x).signum() * 20.0 * self.size[0];
                let taper = 1.0 + 0.0006 * (q.z + 60.0);
                let thigh = squircle(
                    p.x - c.x + inward,
                    p.y - c.y - 2.0,
                    83.0 * self.size[0] * taper,
                    92.0 * self.size[1] * taper,
                );
                // At the top it is gone so far that the join's fillet does not reach the flank.
                let fade = smooth_step(-60.0, 60.0, q.z) * 90.0;
                d = join(d, thigh + fade, 25.0);
            }
        }
        d
    }

    /// Distance to the cavity of abdomen and pelvis; `p` in the pelvic frame, `hip` the distance
    /// to the nearer hip bone, on which iliacus and obturator internus lie.
    fn cavity(&self, p: &Point, hip: f64, column: f64) -> f64 {
        let [_, a, y, b] = row_at(&CAVITY, p.z);
        let mut d = squircle(p.x, p.y - y, a, b).max(-38.0 - p.z);
        d = d.max(9.0 - hip).max(3.0 - column);
        for rod in &self.iliopsoas {
            d = d.max(1.5 - rod.distance(p));
        }
        d
    }

    /// HU without bone at a world point whose place in the pelvic frame is `p`; `hip` is the
    /// distance to the nearer hip bone or sacrum, `skin` that of [`Self::skin`].
    pub fn hu(&self, s: &Skeleton, world: &Point, p: &Point, hip: f64, skin: f64) -> f64 {
        if skin > 1.5 {
            return AIR_HU;
        }
        let inside = self.under_the_skin(s, world, p, hip, skin);
        inside + (AIR_HU - inside) * smooth_step(-0.8, 0.8, skin)
    }

    fn under_the_skin(&self, s: &Skeleton, world: &Point, p: &Point, hip: f64, skin: f64) -> f64 {
        if skin > -2.2 {
            return 25.0 + 20.0 * self.grain.at(world, 3.0);
        }
        let q = world - self.origin;
        let side = (q.x / 150.0).powi(2);
        let back = smooth_step(20.0, 110.0, q.y) * smooth_step(-80.0, 30.0, q.z);
        let front = smooth_step(-40.0, -90.0, q.y) * smooth_step(-70.0, 0.0, q.z);
        let thin = 0.55 + 0.45 * smooth_step(-140.0, -20.0, q.z);
        let depth = self.fat
            * thin
            * (0.55 + 0.35 * side + 0.5 * back + 0.35 * front)
            * (1.0 + 0.25 * self.folds.at(world, 60.0));
        let muscle_edge = skin + depth.max(6.0);
        if muscle_edge > 0.0 {
            // Fine septa run through subcutaneous fat.
            let septum = 1.0 - smooth_step(0.02, 0.06, self.folds.at(world, 16.0).abs());
            return self.fat_hu(world) + 35.0 * septum;
        }
        let column = if p.z > 80.0 { s.spine.column(p) } else { 40.0 };
        if column < 0.0 {
            return 75.0 + 15.0 * self.grain.at(world, 3.0);
        }
        for ([low, high], vessel) in &self.vessels {
            if (0..3).any(|a| p[a] < low[a] || p[a] > high[a]) {
                continue;
            }
            let d = vessel.distance(p);
            if d < SHEATH_MM {
                return 46.0 + (self.fat_hu(world) - 46.0) * smooth_step(-0.5, 1.0, d);
            }
        }
        let cavity = self.cavity(p, hip, column);
        if cavity < 0.0 {
            return self.organs(world, p, -cavity);
        }
        self.muscle(world, hip, cavity, muscle_edge)
    }

    fn fat_hu(&self, world: &Point) -> f64 {
        FAT_HU + 9.0 * self.folds.at(world, 6.0) + 6.0 * self.grain.at(world, 2.5)
    }

    fn muscle(&self, world: &Point, hip: f64, cavity: f64, edge: f64) -> f64 {
        // Planes of fat between muscles: level sets of a field that runs along the body and, near
        // the ilium, parallel to the bone as the gluteal muscles do.
        let turned = Point::new(
            0.83 * world.x - 0.56 * world.y,
            0.56 * world.x + 0.83 * world.y,
            world.z,
        );
        let field = self.fascicles.stretched(&turned, [44.0, 44.0, 150.0]);
        let wide = 0.03 + 0.05 * (1.0 + self.folds.at(world, 45.0));
        let plane = |level: f64| 1.0 - smooth_step(0.4 * wide, wide, level.abs());
        let gluteal = 1.0 - smooth_step(25.0, 36.0, hip);
        let layers = gluteal * plane(0.45 * (hip / 15.0 + 1.6 * field).sin());
        let septum = plane(field).max(layers);
        let marbling = smooth_step(0.50, 0.72, self.folds.stretched(world, [5.0, 5.0, 16.0]));
        let lean = MUSCLE_HU + 9.0 * self.folds.at(world, 24.0) + 12.0 * self.grain.at(world, 3.5);
        // Fascia lets no fat stripes end at the skin side or at the peritoneum.
        let sheath = smooth_step(0.0, 3.0, cavity.min(-edge));
        let share = (septum * sheath).max(0.55 * marbling);
        if share == 0.0 {
            return lean;
        }
        lean + (self.fat_hu(world) - lean) * share
    }

    /// `deep` is the depth in the cavity in mm.
    fn organs(&self, world: &Point, p: &Point, deep: f64) -> f64 {
        let wall = 38.0 + 10.0 * self.grain.at(world, 3.0);
        let bladder = self.bladder.distance(p);
        if bladder < 0.0 {
            return if bladder < -3.0 {
                7.0 + 5.0 * self.grain.at(world, 3.0)
            } else {
                wall
            };
        }
        let rectum = self.rectum.distance(p);
        if rectum < 0.0 {
            let gas = self.rectal_gas.distance(p);
            let stool = 30.0 + 45.0 * self.bowel.at(world, 5.0);
            let content = -930.0 + (stool + 930.0) * smooth_step(-0.8, 0.8, gas);
            return wall + (content - wall) * smooth_step(2.2, 3.8, -rectum);
        }
        if self.organ.distance(p) < 0.0 {
            return 45.0 + 10.0 * self.grain.at(world, 4.0);
        }
        if p.z < 18.0 {
            return self.fat_hu(world);
        }
        // Loops with fat between them along the level set of a bent field.
        let bend = Vector::new(
            self.folds.at(world, 30.0),
            self.folds.at(&(world + Vector::z() * 500.0), 30.0),
            self.folds.at(&(world - Vector::z() * 500.0), 30.0),
        );
        let field = self.bowel.at(&(world + bend * 9.0), 33.0);
        let loops = field.abs() - 0.06;
        let fat = self.fat_hu(world);
        if loops < 0.0 {
            return fat;
        }
        let stool = 28.0 + 25.0 * self.bowel.at(world, 6.0);
        // Gas fills the middle of some loops.
        let gas = smooth_step(
            0.40,
            0.46,
            field - 0.3 * (1.0 - smooth_step(4.0, 14.0, deep)),
        );
        let inner = wall + (stool - wall) * smooth_step(0.10, 0.16, loops);
        let body = inner + (-920.0 - inner) * gas;
        fat + (body - fat) * smooth_step(0.0, 0.06, loops)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_interpolated_and_clamped() {
        assert_eq!(row_at(&TORSO, 1e3)[1], TORSO[0][1]);
        assert_eq!(row_at(&TORSO, -1e3)[1], TORSO[5][1]);
        assert!((row_at(&TORSO, 55.0)[1] - 178.0).abs() < 1e-9);
    }
}

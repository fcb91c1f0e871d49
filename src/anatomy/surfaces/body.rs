//! The body around the bones: a smooth outline of pelvis and thighs.

use super::bone_density::smooth_step;
use super::parameters::SurfacesParameters;
use crate::anatomy::Side;
use crate::anatomy::detect::BoneSurfaces;
use crate::geometry::{Point, Vector};
use crate::volume::Surface;

/// Exponent of the trunk's cross-section: a body on a table is a little squarer than an ellipse.
const TRUNK_EXPONENT: f64 = 2.4;

/// Radius of a thigh as part of the trunk's half-width.
const THIGH: f64 = 0.49;

/// Over this height trunk and thighs pass into each other, from above the lowest point of the
/// hip bones to below it (mm).
const CROTCH_MM: (f64, f64) = (25.0, -35.0);

/// A body's outline, in the world (LPS, mm): an ellipse-like trunk whose width follows the bones,
/// and two round thighs around the femora.
#[derive(Clone, Debug)]
pub(super) struct Body {
    /// Centre of the trunk in x and y.
    center: [f64; 2],
    /// (z, half-width) at the trochanters and at the iliac crests.
    hip: (f64, f64),
    crest: (f64, f64),
    half_depth: f64,
    /// Lowest point of the hip bones.
    crotch: f64,
    thighs: [Thigh; 2],
}

/// The axis of a thigh: a line through the middle of the shaft.
#[derive(Clone, Copy, Debug)]
struct Thigh {
    at: Point,
    /// Change of x and y per mm of z.
    slope: [f64; 2],
    radius: f64,
}

impl Body {
    /// The outline around bones with the given femoral heads.
    pub fn around(bones: &BoneSurfaces, heads: [Point; 2], p: &SurfacesParameters) -> Self {
        let head_z = (heads[0].z + heads[1].z) / 2.0;
        let pelvis = bounds([&bones.hips[0], &bones.hips[1], &bones.sacrum], f64::MIN);
        let trunk_femurs = bounds([&bones.femurs[0], &bones.femurs[1]], head_z - 40.0);
        let center_x = (pelvis.0.x + pelvis.1.x) / 2.0;
        let front = pelvis.0.y - p.anterior_tissue_mm;
        let back = pelvis.1.y.max(trunk_femurs.1.y) + p.posterior_tissue_mm;
        let hip_half = (trunk_femurs.1.x - trunk_femurs.0.x) / 2.0 + p.lateral_tissue_mm;
        let crest_half = (pelvis.1.x - pelvis.0.x) / 2.0 + 0.7 * p.lateral_tissue_mm;
        let thigh = |side: Side| Thigh::of(bones.femur(side), head_z, THIGH * hip_half);
        Self {
            center: [center_x, (front + back) / 2.0],
            hip: (head_z, hip_half),
            crest: (pelvis.1.z, crest_half),
            half_depth: (back - front) / 2.0,
            crotch: bounds([&bones.hips[0], &bones.hips[1]], f64::MIN).0.z,
            thighs: Side::BOTH.map(thigh),
        }
    }

    /// A box that holds the outline between two heights.
    pub fn bounds(&self, low_z: f64, high_z: f64) -> (Point, Point) {
        let half = self.hip.1.max(self.crest.1);
        let mut low = Vector::new(
            self.center[0] - half,
            self.center[1] - self.half_depth,
            low_z,
        );
        let mut high = Vector::new(
            self.center[0] + half,
            self.center[1] + self.half_depth,
            high_z,
        );
        for thigh in &self.thighs {
            for z in [low_z, self.crotch] {
                let [x, y] = thigh.center(z);
                let r = thigh.radius;
                low = low.inf(&Vector::new(x - r, y - r, low_z));
                high = high.sup(&Vector::new(x + r, y + r, high_z));
            }
        }
        (low.into(), high.into())
    }

    /// True inside the outline.
    pub fn contains(&self, p: &Point) -> bool {
        let legs = smooth_step(CROTCH_MM.0, CROTCH_MM.1, p.z - self.crotch);
        let mut level = 0.0;
        if legs < 1.0 {
            level += (1.0 - legs) * self.trunk(p);
        }
        if legs > 0.0 {
            level += legs * self.thighs[0].level(p).max(self.thighs[1].level(p));
        }
        level > 0.0
    }

    /// 1 at the trunk's axis, 0 on its skin.
    fn trunk(&self, p: &Point) -> f64 {
        let up = ((p.z - self.hip.0) / (self.crest.0 - self.hip.0)).clamp(0.0, 1.0);
        let half_width = self.hip.1 + (self.crest.1 - self.hip.1) * up;
        let x = ((p.x - self.center[0]) / half_width).abs();
        let y = ((p.y - self.center[1]) / self.half_depth).abs();
        1.0 - (x.powf(TRUNK_EXPONENT) + y.powf(TRUNK_EXPONENT)).powf(1.0 / TRUNK_EXPONENT)
    }
}

impl Thigh {
    /// Through the femur's middle 60 mm and 150 mm below the head, a little behind the bone, as the
    /// muscles are.
    fn of(femur: &Surface, head_z: f64, radius: f64) -> Self {
        let middle = |below: f64| {
            let level = head_z - below;
            let (mut sum, mut n) = (Vector::zeros(), 0.0);
            for p in femur.vertices() {
                if (p.z - level).abs() < 8.0 {
                    sum += p.coords;
                    n += 1.0;
                }
            }
            // A femur that ends above the level keeps its lowest point's place.
            if n > 0.0 {
                Point::from(sum / n)
            } else {
                let lowest = femur.vertices().iter().min_by(|a, b| a.z.total_cmp(&b.z));
                lowest.copied().unwrap_or_else(Point::origin)
            }
        };
        let (high, low) = (middle(60.0), middle(150.0));
        let dz = high.z - low.z;
        let slope = if dz > 1.0 {
            [(high.x - low.x) / dz, (high.y - low.y) / dz]
        } else {
            [0.0; 2]
        };
        Self {
            at: low + Vector::y() * 0.12 * radius,
            slope,
            radius,
        }
    }

    fn center(&self, z: f64) -> [f64; 2] {
        let dz = z - self.at.z;
        [
            self.at.x + self.slope[0] * dz,
            self.at.y + self.slope[1] * dz,
        ]
    }

    /// 1 on the axis, 0 on the skin.
    fn level(&self, p: &Point) -> f64 {
        let [x, y] = self.center(p.z);
        1.0 - ((p.x - x).powi(2) + (p.y - y).powi(2)).sqrt() / self.radius
    }
}

/// Lowest and highest coordinates of the vertices above a height.
fn bounds<const N: usize>(surfaces: [&Surface; N], above: f64) -> (Point, Point) {
    let mut low = Vector::repeat(f64::MAX);
    let mut high = Vector::repeat(f64::MIN);
    for surface in surfaces {
        for p in surface.vertices().iter().filter(|p| p.z > above) {
            low = low.inf(&p.coords);
            high = high.sup(&p.coords);
        }
    }
    (low.into(), high.into())
}

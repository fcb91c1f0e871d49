//! Where K-wires enter: the iliac crest after the osteotomies, by rule.
//!
//! The authors marked it by hand (facts 2.15). Here it is the surface of the remaining pelvis that
//! - is the first bone met from straight above (along the APP's IS axis),
//! - faces up, within an angle of superior,
//! - lies laterally, beyond a share of the way from the midline to the ipsilateral ASIS, which
//!   leaves out spine, sacrum and the medial, posterior end of the crest,
//! - lies no deeper than a little below the ASIS, which leaves out what is seen from above beside
//!   the wing.
//!
//! Points are drawn uniformly by area, in coordinates that look the same from either side.

use crate::anatomy::{Hip, Label, Landmark, frame::FrameError};
use crate::geometry::{Point, Ray, Vector};
use crate::random::Stream;
use crate::volume::{Surface, SurfaceParameters, Volume};
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// Bone is kept this far beyond the zone's limits, so that the faces of this cut are no part of it.
const BEYOND_MM: f64 = 5.0;

/// The rule for the insertion zone. Values ours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ZoneParameters {
    /// Smallest distance from the midline, as a share of the ASIS' distance from it.
    pub lateral_share: f64,
    /// How far below the ASIS the zone reaches, in mm.
    pub below_asis_mm: f64,
    /// Largest angle between the outward normal and superior, in degrees.
    pub steepest_deg: f64,
}

impl Default for ZoneParameters {
    fn default() -> Self {
        Self {
            lateral_share: 0.6,
            below_asis_mm: 10.0,
            steepest_deg: 60.0,
        }
    }
}

impl ZoneParameters {
    /// (field, what is wrong and what is expected) for every value out of range.
    pub fn problems(&self) -> Vec<(String, String)> {
        let checks = [
            ("lateral_share", self.lateral_share, 0.1, 1.5),
            ("below_asis_mm", self.below_asis_mm, -100.0, 100.0),
            ("steepest_deg", self.steepest_deg, 5.0, 85.0),
        ];
        checks
            .into_iter()
            .filter(|(_, value, low, high)| !(low..=high).contains(&value))
            .map(|(field, value, low, high)| {
                let text = format!("is {value}; expected {low} to {high}");
                (field.to_owned(), text)
            })
            .collect()
    }
}

/// The crest of one hip after its surgery, in the APP.
#[derive(Clone, Debug)]
pub(super) struct InsertionZone {
    surface: Surface,
    lateral_sign: f64,
    /// Limits of what is drawn: lateral (u, which is x on a left hip and -x on a right one) and
    /// anterior (z) coordinates of the surface.
    u: [f64; 2],
    z: [f64; 2],
    /// Where rays start from, and the lowest point that counts (y).
    top: f64,
    lowest: f64,
    smallest_cosine: f64,
}

impl InsertionZone {
    /// The zone of a surgery's label map, or `None` if no bone lies in it.
    pub(super) fn new(
        hip: &Hip,
        labels: &Volume<u8>,
        parameters: &ZoneParameters,
    ) -> Result<Option<Self>, FrameError> {
        let s = hip.side.lateral_sign();
        let own = hip.app_from_volume * hip.landmark(Landmark::Asis)?;
        let other_side = hip.side.opposite();
        let other = hip.specimen.landmarks.get(Landmark::Asis, other_side);
        let other = other.ok_or_else(|| FrameError::Missing(Landmark::Asis.key(other_side)))?;
        let other = hip.app_from_volume * other;
        let middle = s * (own.x + other.x) / 2.0;
        let most_medial = middle + parameters.lateral_share * (s * own.x - middle);
        let lowest = own.y - parameters.below_asis_mm;
        let near = |p: &Point| s * p.x >= most_medial - BEYOND_MM && p.y >= lowest - BEYOND_MM;

        let mut wing = labels.map(|label| label == Label::Pelvis.value());
        for (offset, inside) in wing.data.iter_mut().enumerate() {
            if *inside {
                let voxel = wing.grid.voxel(offset);
                *inside = near(&(hip.app_from_volume * wing.grid.center(voxel)));
            }
        }
        let surface = Surface::from_mask(&wing, |inside| inside, &SurfaceParameters::default())
            .transformed(&hip.app_from_volume);
        if surface.is_empty() {
            return Ok(None);
        }
        let (low, high) = surface.vertices().iter().fold(
            (
                Point::from(Vector::repeat(f64::MAX)),
                Point::from(Vector::repeat(f64::MIN)),
            ),
            |(low, high), p| {
                let p = Point::new(s * p.x, p.y, p.z);
                (low.inf(&p), high.sup(&p))
            },
        );
        Ok(Some(Self {
            surface,
            lateral_sign: s,
            u: [most_medial, high.x],
            z: [low.z, high.z],
            top: high.y + 1.0,
            lowest,
            smallest_cosine: parameters.steepest_deg.to_radians().cos(),
        }))
    }

    /// One try: a point of the crest (APP) and the outward unit normal there, or `None` where the
    /// drawn vertical line misses the zone. Always three numbers from the stream.
    pub(super) fn draw(&self, stream: &mut Stream) -> Option<(Point, Vector)> {
        let mut uniform = |[low, high]: [f64; 2]| low + (high - low) * stream.random::<f64>();
        let (u, z, lot) = (uniform(self.u), uniform(self.z), uniform([0.0, 1.0]));
        let ray = Ray {
            origin: Point::new(self.lateral_sign * u, self.top, z),
            direction: -Vector::y(),
        };
        let hit = *self.surface.intersections(&ray).first()?;
        let point = ray.at(hit.t);
        let normal = self.surface.normal_at(&point, hit.triangle);
        // A vertical line meets a slanted surface less often by the cosine of the slant.
        let accepted = normal.y >= self.smallest_cosine
            && point.y >= self.lowest
            && lot * normal.y < self.smallest_cosine;
        accepted.then_some((point, normal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Side;
    use crate::random::{Purpose, stream};
    use crate::surgery::toy_hip::{hip_of, toy_hip};

    fn points(hip: &Hip, tries: usize) -> Vec<(Point, Vector)> {
        let parameters = ZoneParameters::default();
        let zone = InsertionZone::new(hip, &hip.specimen.labels, &parameters)
            .unwrap()
            .unwrap();
        let mut stream = stream(1, Purpose::Wires, "zone");
        (0..tries).filter_map(|_| zone.draw(&mut stream)).collect()
    }

    #[test]
    fn points_of_a_flat_wing_lie_on_its_top() {
        for side in Side::BOTH {
            let found = points(&toy_hip(side), 300);
            assert!(found.len() > 100, "{}", found.len());
            for (p, n) in found {
                // The wing's top edges are rounded by the surface's smoothing.
                assert!((p.y - 120.0).abs() < 2.5 && p.x.abs() < 13.0, "{p}");
                assert!(n.y > 0.5);
            }
        }
    }

    /// A roof of two slopes, 45 deg and flat, of the same area: as many points on each.
    #[test]
    fn points_are_uniform_by_area() {
        let hip = hip_of(Side::Left, |u, y, z| {
            let roof = if z < 0.0 { 100.0 } else { 100.0 - z };
            let long = if z < 0.0 { 40.0 * 2.0f64.sqrt() } else { 40.0 };
            if u.abs() < 30.0 && z.abs() < long && y < roof && y > 30.0 {
                Label::Pelvis
            } else {
                Label::Background
            }
        });
        let found: Vec<_> = points(&hip, 40_000);
        // Away from edges: 50 mm of flat roof, and slope of the same length.
        let flat = found
            .iter()
            .filter(|(p, _)| (-53.0..-3.0).contains(&p.z))
            .count() as f64;
        let run = 50.0 / 2.0f64.sqrt();
        let slope = found
            .iter()
            .filter(|(p, _)| (2.0..2.0 + run).contains(&p.z))
            .count() as f64;
        // Lowest allowed is 10 mm below the ASIS at y = 80: z up to 30 on the slope.
        let reach = (30.0 - 2.0) / run;
        let ratio = slope / (flat * reach);
        assert!((ratio - 1.0).abs() < 0.08, "{slope} against {flat}");
    }

    #[test]
    fn a_hip_without_a_wing_has_no_zone() {
        let hip = hip_of(Side::Left, |_, y, _| {
            if y < 0.0 {
                Label::Pelvis
            } else {
                Label::Background
            }
        });
        let zone = InsertionZone::new(&hip, &hip.specimen.labels, &ZoneParameters::default());
        assert!(zone.unwrap().is_none());
    }
}

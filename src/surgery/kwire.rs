//! K-wires that fix the relocated fragment: where they go, not how they look in a volume (the
//! supplement's section on the simulation study).

use super::insertion_zone::{InsertionZone, ZoneParameters};
use crate::anatomy::{Hip, Label, frame::FrameError};
use crate::geometry::{Point, Ray, Rigid, Vector};
use crate::random::Stream;
use crate::volume::{Surface, SurfaceParameters, Volume};
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// A wire: a cylinder that ends in a cone, in the world of the CT (LPS, mm).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KWire {
    /// Centre of the cap that body and cone share, on the relocated fragment's surface.
    pub tip_base: Point,
    /// Unit vector along the wire, from the insertion point to the fragment: the tip lies at
    /// `tip_base + direction * tip_length_mm`, the far end at `tip_base - direction *
    /// body_length_mm`.
    pub direction: Vector,
    pub body_length_mm: f64,
    pub tip_length_mm: f64,
    pub radius_mm: f64,
    /// Its constant intensity in Hounsfield units.
    pub hu: f64,
}

/// Wires as the supplement draws them. Pairs are `[low, high]` of uniform distributions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct KWireParameters {
    /// Smallest distance of the second insertion point from the first, in mm.
    pub separation_mm: f64,
    /// Weights of the direction to the femoral head, tried in this order.
    pub betas: Vec<f64>,
    /// Allowed distances from insertion point to fragment, in mm.
    pub inserted_mm: [f64; 2],
    /// Length of the cylinder in mm.
    pub body_length_mm: [f64; 2],
    /// Height of the cone in mm.
    pub tip_length_mm: [f64; 2],
    /// Radius of the cylinder in mm.
    pub radius_mm: [f64; 2],
    /// Intensity in Hounsfield units.
    pub hu: [f64; 2],
    /// Insertion points drawn for one wire before it is given up. One draw in some ten falls on
    /// the crest at all.
    pub max_draws: u32,
    /// What counts as iliac crest.
    pub zone: ZoneParameters,
}

impl Default for KWireParameters {
    fn default() -> Self {
        Self {
            separation_mm: 20.0,
            betas: vec![0.5, 0.6, 0.7, 0.8, 0.9, 1.0],
            inserted_mm: [40.0, 110.0],
            body_length_mm: [190.5, 266.7],
            tip_length_mm: [4.0, 6.0],
            radius_mm: [0.5, 1.5],
            hu: [14_000.0, 26_000.0],
            max_draws: 100_000,
            zone: ZoneParameters::default(),
        }
    }
}

impl KWireParameters {
    /// (field, what is wrong and what is expected) for every value out of range.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        if !(0.0..=200.0).contains(&self.separation_mm) {
            let text = format!("is {}; expected 0 to 200 mm", self.separation_mm);
            problems.push(("separation_mm".to_owned(), text));
        }
        if self.betas.is_empty() || self.betas.iter().any(|b| !(0.0..=1.0).contains(b)) {
            let text = format!(
                "is {:?}; expected one or more weights from 0 to 1",
                self.betas
            );
            problems.push(("betas".to_owned(), text));
        }
        for (field, [low, high], least, most) in [
            ("inserted_mm", self.inserted_mm, 0.0, 500.0),
            ("body_length_mm", self.body_length_mm, 1.0, 1000.0),
            ("tip_length_mm", self.tip_length_mm, 0.0, 100.0),
            ("radius_mm", self.radius_mm, 0.05, 20.0),
            ("hu", self.hu, -1000.0, 100_000.0),
        ] {
            if !(least <= low && low <= high && high <= most) {
                let text =
                    format!("is [{low}, {high}]; expected [low, high] within {least} and {most}");
                problems.push((field.to_owned(), text));
            }
        }
        if self.max_draws == 0 {
            problems.push((
                "max_draws".to_owned(),
                "is 0; expected at least 1".to_owned(),
            ));
        }
        let zone = self.zone.problems().into_iter();
        problems.extend(zone.map(|(field, text)| (format!("zone.{field}"), text)));
        problems
    }
}

/// Why wires could not be placed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum KWireError {
    #[error(transparent)]
    Frame(#[from] FrameError),
    #[error(
        "the remaining pelvis of {hip} has no bone in the insertion zone; check the label map and \
         the ASIS landmarks, or widen the zone"
    )]
    NoCrest { hip: String },
    #[error("the label map of {hip} holds no fragment (label 4); cut it before placing wires")]
    NoFragment { hip: String },
    #[error(
        "wire {wire} of {hip} found no place in {draws} draws: {off_crest} off the iliac crest, \
         {too_close} within {separation_mm} mm of the first wire, {astray} without a way of \
         allowed length to the fragment; widen the zone or allow more draws (max_draws)"
    )]
    NoPlace {
        hip: String,
        wire: usize,
        draws: u32,
        off_crest: u32,
        too_close: u32,
        astray: u32,
        separation_mm: f64,
    },
}

/// Crest and fragment of one surgery, ready for many movements.
#[derive(Clone, Debug)]
pub struct KWireModel {
    hip: String,
    zone: InsertionZone,
    /// The fragment before its movement, in the APP.
    fragment: Surface,
    volume_from_app: Rigid,
    parameters: KWireParameters,
}

impl KWireModel {
    /// The model of one surgery: `labels` is its label map (fragment and cut included).
    ///
    /// # Errors
    /// When the map holds no fragment or no iliac crest, or an ASIS is missing.
    pub fn new(
        hip: &Hip,
        labels: &Volume<u8>,
        parameters: &KWireParameters,
    ) -> Result<Self, KWireError> {
        let no_crest = || KWireError::NoCrest { hip: hip.key() };
        let zone = InsertionZone::new(hip, labels, &parameters.zone)?.ok_or_else(no_crest)?;
        let is_fragment = |label| label == Label::Fragment.value();
        let fragment = Surface::from_mask(labels, is_fragment, &SurfaceParameters::default());
        if fragment.is_empty() {
            return Err(KWireError::NoFragment { hip: hip.key() });
        }
        Ok(Self {
            hip: hip.key(),
            zone,
            fragment: fragment.transformed(&hip.app_from_volume),
            volume_from_app: hip.app_from_volume.inverse(),
            parameters: parameters.clone(),
        })
    }

    /// The unit direction and length of the way from an insertion point into the relocated
    /// fragment, by the first of the betas that gives an allowed one. All in the APP; `normal` is
    /// the crest's outward normal.
    fn way(
        &self,
        from: &Point,
        normal: &Vector,
        fragment: &Rigid,
        head: &Point,
    ) -> Option<(Vector, f64)> {
        let at_rest = fragment.inverse();
        let (nearest, _) = self.fragment.closest_point(&(at_rest * from))?;
        let n_f = (fragment * nearest - from).try_normalize(1e-9)?;
        // The sum is to point from the crest to the fragment, so n_i points into the bone.
        let n_i = -normal;
        let n_if = ((n_i + n_f) / 2.0).try_normalize(1e-9)?;
        let n_fh = (head - from).try_normalize(1e-9)?;
        let [shortest, longest] = self.parameters.inserted_mm;
        self.parameters.betas.iter().find_map(|beta| {
            let direction = (n_fh * *beta + n_if * (1.0 - beta)).try_normalize(1e-9)?;
            let ray = Ray {
                origin: at_rest * from,
                direction: at_rest * direction,
            };
            let length = self.fragment.intersections(&ray).first()?.t;
            (shortest..=longest)
                .contains(&length)
                .then_some((direction, length))
        })
    }
}

/// Two wires from the iliac crest into the relocated fragment. `fragment` and `femur` are the
/// movements in the APP; the femoral head that wires are turned towards is the moved one. Each wire
/// takes three numbers from the stream a draw, and four once it has its place.
///
/// # Errors
/// When a wire finds no place in `max_draws` draws.
pub fn place_kwires(
    model: &KWireModel,
    fragment: &Rigid,
    femur: &Rigid,
    stream: &mut Stream,
) -> Result<[KWire; 2], KWireError> {
    let (start, first) = place_one(model, 1, None, fragment, femur, stream)?;
    let (_, second) = place_one(model, 2, Some(&start), fragment, femur, stream)?;
    Ok([first, second])
}

/// The insertion point (APP) and the wire.
fn place_one(
    model: &KWireModel,
    wire: usize,
    other: Option<&Point>,
    fragment: &Rigid,
    femur: &Rigid,
    stream: &mut Stream,
) -> Result<(Point, KWire), KWireError> {
    let parameters = &model.parameters;
    let head = femur * Point::origin();
    let (mut off_crest, mut too_close, mut astray) = (0, 0, 0);
    for _ in 0..parameters.max_draws {
        let Some((start, normal)) = model.zone.draw(stream) else {
            off_crest += 1;
            continue;
        };
        if other.is_some_and(|o| (start - o).norm() < parameters.separation_mm) {
            too_close += 1;
            continue;
        }
        let Some((direction, length)) = model.way(&start, &normal, fragment, &head) else {
            astray += 1;
            continue;
        };
        let mut uniform = |[low, high]: [f64; 2]| low + (high - low) * stream.random::<f64>();
        let placed = KWire {
            tip_base: model.volume_from_app * (start + direction * length),
            direction: model.volume_from_app * direction,
            body_length_mm: uniform(parameters.body_length_mm),
            tip_length_mm: uniform(parameters.tip_length_mm),
            radius_mm: uniform(parameters.radius_mm),
            hu: uniform(parameters.hu),
        };
        return Ok((start, placed));
    }
    Err(KWireError::NoPlace {
        hip: model.hip.clone(),
        wire,
        draws: parameters.max_draws,
        off_crest,
        too_close,
        astray,
        separation_mm: parameters.separation_mm,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Side;
    use crate::geometry::euler;
    use crate::random::{Purpose, stream};
    use crate::surgery::toy_hip::{hip_of, toy_hip};

    fn model(hip: &Hip) -> KWireModel {
        KWireModel::new(hip, &hip.specimen.labels, &KWireParameters::default()).unwrap()
    }

    /// A plausible movement of one side.
    fn movement(side: Side) -> (Rigid, Rigid) {
        let s = side.lateral_sign();
        let angles = Vector::new(0.2, s * 0.05, -s * 0.2);
        let translation = Vector::new(-s * 2.0, -2.0, 2.0);
        let fragment = Rigid::from_parts(translation.into(), euler::from_xyz(&angles));
        (
            fragment,
            Rigid::translation(translation.x, translation.y, translation.z),
        )
    }

    fn placed(hip: &Hip, count: usize) -> Vec<[KWire; 2]> {
        let (fragment, femur) = movement(hip.side);
        let model = model(hip);
        (0..count)
            .map(|i| {
                let mut stream = stream(1, Purpose::Wires, &format!("case {i}"));
                place_kwires(&model, &fragment, &femur, &mut stream).unwrap()
            })
            .collect()
    }

    #[test]
    fn wires_keep_the_supplements_rules() {
        let hip = toy_hip(Side::Left);
        let (fragment, femur) = movement(Side::Left);
        let p = KWireParameters::default();
        let within = |[low, high]: [f64; 2], v: f64| low <= v && v <= high;
        for pair in placed(&hip, 20) {
            let mut starts = Vec::new();
            for wire in pair {
                assert!((wire.direction.norm() - 1.0).abs() < 1e-12);
                assert!(within(p.body_length_mm, wire.body_length_mm));
                assert!(within(p.tip_length_mm, wire.tip_length_mm));
                assert!(within(p.radius_mm, wire.radius_mm) && within(p.hu, wire.hu));
                // The toy fragment is a shell of 45 mm about the moved head, the crest a flat top
                // 120 mm above the head's old place.
                let base = hip.app_from_volume * wire.tip_base;
                let at_rest = fragment.inverse() * base;
                assert!((at_rest.coords.norm() - 45.0).abs() < 1.0, "{at_rest}");
                let direction = hip.app_from_volume * wire.direction;
                assert!(direction.y < 0.0, "wires go down");
                let length = (120.0 - base.y) / -direction.y;
                let start = base - direction * length;
                assert!(start.x.abs() < 14.0 && start.z.abs() < 62.0, "{start}");
                assert!(length > 39.0 && length < 111.0);
                // beta is at least a half, so the wire points to the moved head rather than not.
                let to_head = (femur * Point::origin() - start).normalize();
                assert!(direction.dot(&to_head) > 0.8);
                starts.push(start);
            }
            assert!(
                (starts[0] - starts[1]).norm() > 17.0,
                "apart, rounded edges aside"
            );
        }
    }

    /// With n_fh alone the wire aims at the head's centre, and the length is that of the way to a
    /// ball.
    #[test]
    fn a_beta_of_one_aims_at_the_head() {
        let hip = toy_hip(Side::Right);
        let parameters = KWireParameters {
            betas: vec![1.0],
            ..Default::default()
        };
        let model = KWireModel::new(&hip, &hip.specimen.labels, &parameters).unwrap();
        let still = Rigid::identity();
        let mut stream = stream(1, Purpose::Wires, "aim");
        for wire in place_kwires(&model, &still, &still, &mut stream).unwrap() {
            let line = hip.head() - wire.tip_base;
            assert!(line.cross(&wire.direction).norm() < 1e-9);
            assert!((line.dot(&wire.direction) - 45.0).abs() < 0.8);
        }
    }

    #[test]
    fn sides_mirror_each_other() {
        let (left, right) = (toy_hip(Side::Left), toy_hip(Side::Right));
        for (l, r) in placed(&left, 5).iter().zip(placed(&right, 5)) {
            for (l, r) in l.iter().zip(r) {
                let mirrored = Point::new(-l.tip_base.x, l.tip_base.y, l.tip_base.z);
                assert!((mirrored - r.tip_base).norm() < 1e-6, "{l:?} {r:?}");
                let mirrored = Vector::new(-l.direction.x, l.direction.y, l.direction.z);
                assert!((mirrored - r.direction).norm() < 1e-6);
                assert_eq!((l.radius_mm, l.hu), (r.radius_mm, r.hu));
            }
        }
    }

    #[test]
    fn what_is_missing_is_named() {
        let hip = hip_of(Side::Left, |u, y, _| {
            if u.abs() < 12.0 && y > 47.0 && y < 120.0 {
                Label::Pelvis
            } else {
                Label::Background
            }
        });
        let made = KWireModel::new(&hip, &hip.specimen.labels, &KWireParameters::default());
        assert!(matches!(made, Err(KWireError::NoFragment { .. })));

        let hip = toy_hip(Side::Left);
        let parameters = KWireParameters {
            inserted_mm: [200.0, 210.0],
            max_draws: 50,
            ..Default::default()
        };
        let model = KWireModel::new(&hip, &hip.specimen.labels, &parameters).unwrap();
        let still = Rigid::identity();
        let mut stream = stream(1, Purpose::Wires, "far");
        let error = place_kwires(&model, &still, &still, &mut stream).unwrap_err();
        let KWireError::NoPlace {
            wire: 1,
            off_crest,
            astray,
            ..
        } = error
        else {
            panic!("{error}");
        };
        assert!(astray > 10 && off_crest + astray == 50);
    }

    #[test]
    fn problems_name_nested_fields() {
        assert!(KWireParameters::default().problems().is_empty());
        let wrong = KWireParameters {
            betas: vec![1.5],
            hu: [3.0, 1.0],
            zone: ZoneParameters {
                steepest_deg: 90.0,
                ..Default::default()
            },
            ..Default::default()
        };
        let fields: Vec<String> = wrong.problems().into_iter().map(|p| p.0).collect();
        assert_eq!(fields, ["betas", "hu", "zone.steepest_deg"]);
    }
}

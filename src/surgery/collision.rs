//! Whether bones overlap once fragment and femur have moved (the paper's section on the
//! simulation study; facts 2.14).
//!
//! The labels are opened with a ball first, which drops the thin and ragged parts that touch all
//! the time, and meshed. **Tolerance**: each surface is moved inward by half of it, so two bodies
//! collide when they overlap by more than the tolerance. Opening leaves no convex edge sharper than
//! its ball, so surfaces shrunk by up to its radius stay surfaces. Surfaces that do not cross may
//! still lie one inside the other; a containment test finds those.

use crate::anatomy::{Hip, Label};
use crate::geometry::Rigid;
use crate::volume::{Surface, SurfaceParameters, Volume, morphology};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What counts as a collision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CollisionParameters {
    /// Radius in mm of the ball that the labels are opened with; 0 leaves them as they are.
    pub opening_radius_mm: f64,
    /// How deep two bodies may overlap, in mm.
    pub tolerance_mm: f64,
}

impl Default for CollisionParameters {
    /// The opening of the authors' own command (facts 2.14); the tolerance of DESIGN section 3.
    fn default() -> Self {
        Self {
            opening_radius_mm: 5.0,
            tolerance_mm: 0.5,
        }
    }
}

impl CollisionParameters {
    /// (field, what is wrong and what is expected) for every value out of range.
    pub fn problems(&self) -> Vec<(String, String)> {
        let mut problems = Vec::new();
        if !(0.0..=20.0).contains(&self.opening_radius_mm) {
            let text = format!("is {}; expected 0 to 20 mm", self.opening_radius_mm);
            problems.push(("opening_radius_mm".to_owned(), text));
        }
        if !(0.0..=5.0).contains(&self.tolerance_mm) {
            let text = format!("is {}; expected 0 to 5 mm", self.tolerance_mm);
            problems.push(("tolerance_mm".to_owned(), text));
        }
        problems
    }
}

/// A body that the opening leaves nothing of.
#[derive(Debug, thiserror::Error)]
#[error(
    "opening the {body} of {hip} ({voxels} voxels) with a ball of {radius_mm} mm leaves nothing; \
     check the label map or lower opening_radius_mm"
)]
pub struct CollisionError {
    body: &'static str,
    hip: String,
    voxels: usize,
    radius_mm: f64,
}

/// Two bodies that may collide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pair {
    /// Fragment and pelvis, the fragment with its movement.
    FragmentPelvis,
    /// Femur and pelvis, the femur with the FRAGMENT's movement: together with the pair before this
    /// is the test of fragment and femur as one body against the pelvis.
    JoinedFemurPelvis,
    /// Femur and pelvis, each with its own movement.
    FemurPelvis,
    /// Femur and fragment, each with its own movement.
    FemurFragment,
}

impl Pair {
    /// All of them, in the order in which they are tested.
    pub const ALL: [Self; 4] = [
        Self::FragmentPelvis,
        Self::JoinedFemurPelvis,
        Self::FemurPelvis,
        Self::FemurFragment,
    ];
}

/// How two bodies overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// Their surfaces cross.
    Crossing,
    /// A piece of one lies wholly inside the other.
    Containment,
}

/// The bodies of one fragment, ready for many movements: pelvis without fragment and cuts,
/// fragment, ipsilateral femur.
#[derive(Clone, Debug)]
pub struct CollisionModel {
    /// Surfaces of the opened labels in the APP, before shrinking.
    opened: Bodies,
    /// The same, each moved inward by half the tolerance.
    shrunk: Bodies,
    tolerance_mm: f64,
}

#[derive(Clone, Debug)]
struct Bodies {
    pelvis: Surface,
    fragment: Surface,
    femur: Surface,
}

impl CollisionModel {
    /// The model of one surgery: `labels` is its label map (fragment and cut included), on any
    /// grid in the world of the hip's specimen.
    ///
    /// # Errors
    /// When the opening leaves nothing of a body.
    pub fn new(
        hip: &Hip,
        labels: &Volume<u8>,
        parameters: &CollisionParameters,
    ) -> Result<Self, CollisionError> {
        let wanted = [
            ("pelvis", Label::Pelvis),
            ("fragment", Label::Fragment),
            ("femur", Label::femur(hip.side)),
        ];
        let radius_mm = parameters.opening_radius_mm;
        let mut surfaces = wanted
            .par_iter()
            .map(|&(body, label)| {
                let mask = labels.map(|v| v == label.value());
                let surface = opened_surface(&mask, radius_mm);
                if surface.is_empty() {
                    return Err(CollisionError {
                        body,
                        hip: hip.key(),
                        voxels: mask.data.iter().filter(|&&v| v).count(),
                        radius_mm,
                    });
                }
                Ok(surface.transformed(&hip.app_from_volume))
            })
            .collect::<Result<Vec<_>, _>>()?
            .into_iter();
        let mut next = || surfaces.next().expect("there is a surface for each body");
        let opened = Bodies {
            pelvis: next(),
            fragment: next(),
            femur: next(),
        };
        Ok(Self::shrink(opened, parameters.tolerance_mm))
    }

    /// The same bodies with another tolerance, without opening and meshing them again.
    pub fn with_tolerance(&self, tolerance_mm: f64) -> Self {
        Self::shrink(self.opened.clone(), tolerance_mm)
    }

    fn shrink(opened: Bodies, tolerance_mm: f64) -> Self {
        let inward = |surface: &Surface| surface.offset(-tolerance_mm / 2.0);
        let shrunk = Bodies {
            pelvis: inward(&opened.pelvis),
            fragment: inward(&opened.fragment),
            femur: inward(&opened.femur),
        };
        Self {
            opened,
            shrunk,
            tolerance_mm,
        }
    }

    /// How deep two bodies may overlap, in mm.
    pub fn tolerance_mm(&self) -> f64 {
        self.tolerance_mm
    }

    /// How the two bodies of a pair overlap after the movements of fragment and femur in the APP,
    /// or `None` if they do not.
    pub fn contact(&self, pair: Pair, fragment: &Rigid, femur: &Rigid) -> Option<Contact> {
        let bodies = &self.shrunk;
        let (fixed, moving, pose) = match pair {
            Pair::FragmentPelvis => (&bodies.pelvis, &bodies.fragment, *fragment),
            Pair::JoinedFemurPelvis => (&bodies.pelvis, &bodies.femur, *fragment),
            Pair::FemurPelvis => (&bodies.pelvis, &bodies.femur, *femur),
            Pair::FemurFragment => (&bodies.fragment, &bodies.femur, fragment.inverse() * femur),
        };
        if fixed.crosses(moving, &pose) {
            return Some(Contact::Crossing);
        }
        let contained = fixed.contains_piece_of(moving, &pose)
            || moving.contains_piece_of(fixed, &pose.inverse());
        contained.then_some(Contact::Containment)
    }

    /// The first pair in the order of [`Pair::ALL`] that overlaps after the movements of fragment
    /// and femur in the APP, or `None` when no bone overlaps. The first two pairs together are
    /// the paper's test of fragment and femur as one body against the pelvis.
    pub fn first_collision(&self, fragment: &Rigid, femur: &Rigid) -> Option<(Pair, Contact)> {
        Pair::ALL
            .into_iter()
            .find_map(|pair| Some((pair, self.contact(pair, fragment, femur)?)))
    }
}

/// The surface of a mask opened with a ball, in the world.
fn opened_surface(mask: &Volume<bool>, radius_mm: f64) -> Surface {
    let parameters = SurfaceParameters::default();
    if radius_mm > 0.0 {
        let opened = morphology::open(mask, radius_mm);
        Surface::from_mask(&opened, |v| v, &parameters)
    } else {
        Surface::from_mask(mask, |v| v, &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::Side;
    use crate::geometry::{Vector, euler};
    use crate::surgery::toy_hip::{hip_of, toy_hip};

    fn model(side: Side) -> CollisionModel {
        let hip = toy_hip(side);
        CollisionModel::new(&hip, &hip.specimen.labels, &CollisionParameters::default()).unwrap()
    }

    fn shifted(x: f64, y: f64, z: f64) -> Rigid {
        Rigid::translation(x, y, z)
    }

    #[test]
    fn each_pair_is_told_apart() {
        let model = model(Side::Left);
        let rest = Rigid::identity();
        assert_eq!(model.first_collision(&rest, &rest), None);
        let crossing = |pair| Some((pair, Contact::Crossing));
        let up = shifted(0.0, 6.0, 0.0);
        let both = model.first_collision(&up, &up);
        assert_eq!(both, crossing(Pair::FragmentPelvis));
        let femur_up = model.first_collision(&rest, &up);
        assert_eq!(femur_up, crossing(Pair::FemurFragment));
        let medial = shifted(-6.0, -4.0, 0.0);
        let femur_medial = model.first_collision(&rest, &medial);
        assert_eq!(femur_medial, crossing(Pair::FemurPelvis));
        // A turn about the head moves the shell's edge along itself, so it is free.
        let turn = euler::from_xyz(&Vector::new(0.0, 0.3, 0.0));
        let turned = Rigid::from_parts(Vector::zeros().into(), turn);
        assert_eq!(model.first_collision(&turned, &rest), None);
    }

    /// The fragment's top, a ball of 45 mm radius, rises towards the flat bottom of the wing, 2 mm
    /// above: it collides once it has risen by 2 mm and the tolerance.
    #[test]
    fn the_tolerance_is_the_depth_of_the_overlap() {
        let model = model(Side::Left);
        let still = Rigid::identity();
        let limit = |model: &CollisionModel| {
            (0..100)
                .map(|step| f64::from(step) * 0.05)
                .find(|&rise| {
                    let up = shifted(0.0, rise, 0.0);
                    model.contact(Pair::FragmentPelvis, &up, &still).is_some()
                })
                .expect("it collides in the end")
        };
        let at_zero = limit(&model.with_tolerance(0.0));
        // Half a voxel of 1.5 mm is the surfaces' own uncertainty.
        assert!((at_zero - 2.0).abs() < 0.8, "{at_zero}");
        for tolerance in [0.5, 1.0, 2.0] {
            let gained = limit(&model.with_tolerance(tolerance)) - at_zero;
            assert!(
                (gained - tolerance).abs() < 0.15,
                "{gained} for {tolerance}"
            );
        }
    }

    #[test]
    fn one_body_inside_another_is_found() {
        // The fragment is a ball of 9 mm; 60 mm above it the pelvis is a block of 60 mm.
        let hip = hip_of(Side::Left, |u, y, z| {
            if u * u + y * y + z * z <= 81.0 {
                Label::Fragment
            } else if u.abs() < 30.0 && z.abs() < 30.0 && (30.0..90.0).contains(&y) {
                Label::Pelvis
            } else if (-90.0..-40.0).contains(&y) && u.abs() < 10.0 && z.abs() < 10.0 {
                Label::FemurLeft
            } else {
                Label::Background
            }
        });
        let parameters = CollisionParameters::default();
        let model = CollisionModel::new(&hip, &hip.specimen.labels, &parameters).unwrap();
        let contact = |rise: f64| {
            model.contact(
                Pair::FragmentPelvis,
                &shifted(0.0, rise, 0.0),
                &Rigid::identity(),
            )
        };
        assert_eq!(contact(0.0), None);
        assert_eq!(contact(30.0), Some(Contact::Crossing));
        assert_eq!(contact(60.0), Some(Contact::Containment));
        assert_eq!(contact(90.0), Some(Contact::Crossing));
        assert_eq!(contact(120.0), None);
    }

    #[test]
    fn a_body_that_opening_removes_is_named() {
        let hip = hip_of(Side::Right, |u, y, z| {
            let r = (u * u + y * y + z * z).sqrt();
            match r {
                r if r < 20.0 => Label::FemurRight,
                r if r < 24.0 => Label::Fragment,
                r if r > 60.0 => Label::Pelvis,
                _ => Label::Background,
            }
        });
        let made = CollisionModel::new(&hip, &hip.specimen.labels, &Default::default());
        let message = made.unwrap_err().to_string();
        assert!(
            message.contains("opening the fragment of toy/right"),
            "{message}"
        );
    }

    #[test]
    fn sides_mirror_each_other() {
        let (left, right) = (model(Side::Left), model(Side::Right));
        let mut found = Vec::new();
        for step in 0..60 {
            let a = f64::from(step);
            let translation = Vector::new((a * 0.7).sin(), (a * 1.3).sin(), (a * 2.1).sin()) * 4.0;
            let angles = Vector::new((a * 0.9).sin(), (a * 1.7).sin(), (a * 0.3).sin()) * 0.25;
            let pose = |s: f64| {
                Rigid::from_parts(
                    Vector::new(s * translation.x, translation.y, translation.z).into(),
                    euler::from_xyz(&Vector::new(angles.x, s * angles.y, s * angles.z)),
                )
            };
            let still = Rigid::identity();
            let (l, r) = (
                left.first_collision(&pose(1.0), &still),
                right.first_collision(&pose(-1.0), &still),
            );
            assert_eq!(l, r, "step {step}");
            found.push(l.is_some());
        }
        assert!(found.contains(&true) && found.contains(&false));
    }
}

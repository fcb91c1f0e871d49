//! Random movements of the fragment and the ipsilateral femur, free of collisions (the paper's
//! Table S-5 and section on the simulation study).
//!
//! Movements are drawn in coordinates that look the same from either side and turned into the APP
//! last: **LR** rotation forward is positive about x on both sides; **IS** and **AP** rotations
//! and the **LR** translation change their sign between the sides. A mirrored body with the same
//! draws moves in mirrored fashion.

use crate::anatomy::{Hip, Side};
use crate::geometry::{Point, Rigid, Vector, euler};
use crate::random::Stream;
use crate::surgery::collision::{CollisionModel, Contact, Pair};
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// Rigid movements in the APP with its origin at the ipsilateral femoral head: a point after the
/// operation is the movement times the point before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Movement {
    pub fragment: Rigid,
    pub femur: Rigid,
}

impl Movement {
    /// Nothing moves.
    pub fn identity() -> Self {
        Self {
            fragment: Rigid::identity(),
            femur: Rigid::identity(),
        }
    }

    /// The femoral head's centre after the movement, in the APP.
    pub fn head(&self) -> Point {
        self.femur * Point::origin()
    }
}

/// Ranges `[low, high]` of the uniform distributions of Table S-5, with signs that mean the same on
/// either side. Rotations are R = Rx Ry Rz about the femoral head.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MovementParameters {
    /// Fragment about LR in degrees; positive turns its top forward.
    pub fragment_rotation_lr_deg: [f64; 2],
    /// Fragment about IS in degrees; positive turns its front laterally.
    pub fragment_rotation_is_deg: [f64; 2],
    /// Fragment about AP in degrees; positive turns its top laterally, which raises the LCE angle.
    pub fragment_rotation_ap_deg: [f64; 2],
    /// Femur about LR in degrees; positive is flexion (the knee moves forward).
    pub femur_flexion_deg: [f64; 2],
    /// Femur about IS in degrees; positive turns its front laterally.
    pub femur_rotation_is_deg: [f64; 2],
    /// Femur about AP in degrees; positive turns its knee medially (adduction).
    pub femur_rotation_ap_deg: [f64; 2],
    /// Shared translation along LR in mm; positive is medial.
    pub translation_lr_mm: [f64; 2],
    /// Shared translation along IS in mm; positive is superior.
    pub translation_is_mm: [f64; 2],
    /// Shared translation along AP in mm; positive is anterior.
    pub translation_ap_mm: [f64; 2],
    /// Draws before a fragment's movement is given up.
    pub max_draws: u32,
}

impl Default for MovementParameters {
    fn default() -> Self {
        Self {
            fragment_rotation_lr_deg: [0.0, 20.0],
            fragment_rotation_is_deg: [0.0, 6.0],
            fragment_rotation_ap_deg: [0.0, 25.0],
            femur_flexion_deg: [0.0, 20.0],
            femur_rotation_is_deg: [-5.0, 5.0],
            femur_rotation_ap_deg: [-2.0, 2.0],
            translation_lr_mm: [-2.5, 7.5],
            translation_is_mm: [-4.0, 0.0],
            translation_ap_mm: [-1.0, 5.0],
            max_draws: 10_000,
        }
    }
}

impl MovementParameters {
    /// (field, what is wrong and what is expected) for every value out of range.
    pub fn problems(&self) -> Vec<(String, String)> {
        let ranges = [
            (
                "fragment_rotation_lr_deg",
                self.fragment_rotation_lr_deg,
                90.0,
            ),
            (
                "fragment_rotation_is_deg",
                self.fragment_rotation_is_deg,
                90.0,
            ),
            (
                "fragment_rotation_ap_deg",
                self.fragment_rotation_ap_deg,
                90.0,
            ),
            ("femur_flexion_deg", self.femur_flexion_deg, 90.0),
            ("femur_rotation_is_deg", self.femur_rotation_is_deg, 90.0),
            ("femur_rotation_ap_deg", self.femur_rotation_ap_deg, 90.0),
            ("translation_lr_mm", self.translation_lr_mm, 100.0),
            ("translation_is_mm", self.translation_is_mm, 100.0),
            ("translation_ap_mm", self.translation_ap_mm, 100.0),
        ];
        let mut problems: Vec<(String, String)> = ranges
            .into_iter()
            .filter(|(_, [low, high], limit)| !(-limit <= *low && low <= high && high <= limit))
            .map(|(field, [low, high], limit)| {
                let text =
                    format!("is [{low}, {high}]; expected [low, high] within -{limit} and {limit}");
                (field.to_owned(), text)
            })
            .collect();
        if self.max_draws == 0 {
            let text = "is 0; expected at least 1".to_owned();
            problems.push(("max_draws".to_owned(), text));
        }
        problems
    }

    /// One draw from the ranges, collisions or not: nine uniform numbers from the stream, always.
    pub fn draw(&self, side: Side, stream: &mut Stream) -> Movement {
        let mut uniform = |[low, high]: [f64; 2]| low + (high - low) * stream.random::<f64>();
        let lr = uniform(self.fragment_rotation_lr_deg);
        let is = uniform(self.fragment_rotation_is_deg);
        let ap = uniform(self.fragment_rotation_ap_deg);
        let medial = uniform(self.translation_lr_mm);
        let superior = uniform(self.translation_is_mm);
        let anterior = uniform(self.translation_ap_mm);
        let flexion = uniform(self.femur_flexion_deg);
        let femur_is = uniform(self.femur_rotation_is_deg);
        let femur_ap = uniform(self.femur_rotation_ap_deg);
        // In the APP (x left, y superior, z anterior) a positive turn about x takes superior to
        // anterior: the fragment's top goes forward, and the knee, which is inferior, backward.
        // A positive turn about y takes anterior to the left, a positive one about z superior to
        // the right: lateral on one side, medial on the other.
        let s = side.lateral_sign();
        let turn = |x: f64, y: f64, z: f64| {
            euler::from_xyz(&Vector::new(x, s * y, -s * z).map(f64::to_radians))
        };
        let translation = Vector::new(-s * medial, superior, anterior);
        Movement {
            fragment: Rigid::from_parts(translation.into(), turn(lr, is, ap)),
            femur: Rigid::from_parts(translation.into(), turn(-flexion, femur_is, femur_ap)),
        }
    }
}

/// How many draws were rejected, each counted under the first cause found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MovementRejections {
    /// The fragment's surface crosses the pelvis'.
    pub fragment_pelvis: u32,
    /// The femur's surface crosses the pelvis' when it moves as one body with the fragment.
    pub joined_femur_pelvis: u32,
    /// The femur's surface crosses the pelvis' with its own movement.
    pub femur_pelvis: u32,
    /// The femur's surface crosses the fragment's.
    pub femur_fragment: u32,
    /// One body lies inside another.
    pub containment: u32,
}

impl MovementRejections {
    /// All rejections.
    pub fn total(&self) -> u32 {
        self.fragment_pelvis
            + self.joined_femur_pelvis
            + self.femur_pelvis
            + self.femur_fragment
            + self.containment
    }

    fn count(&mut self, pair: Pair, contact: Contact) {
        *match (contact, pair) {
            (Contact::Containment, _) => &mut self.containment,
            (Contact::Crossing, Pair::FragmentPelvis) => &mut self.fragment_pelvis,
            (Contact::Crossing, Pair::JoinedFemurPelvis) => &mut self.joined_femur_pelvis,
            (Contact::Crossing, Pair::FemurPelvis) => &mut self.femur_pelvis,
            (Contact::Crossing, Pair::FemurFragment) => &mut self.femur_fragment,
        } += 1;
    }
}

impl std::fmt::Display for MovementRejections {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} fragment against pelvis, {} femur against pelvis as one body with the fragment, \
             {} femur against pelvis, {} femur against fragment, {} one inside another",
            self.fragment_pelvis,
            self.joined_femur_pelvis,
            self.femur_pelvis,
            self.femur_fragment,
            self.containment
        )
    }
}

/// No collision-free movement was found.
#[derive(Debug, thiserror::Error)]
pub enum MovementError {
    #[error(
        "no collision-free movement of {hip} in {draws} draws ({counts}); the bones do not overlap before \
         any movement, so allow more draws (max_draws), smaller ranges or a larger tolerance \
         (tolerance_mm, now {tolerance_mm})"
    )]
    NoneFree {
        hip: String,
        draws: u32,
        counts: MovementRejections,
        tolerance_mm: f64,
    },
    #[error(
        "no collision-free movement of {hip} in {draws} draws ({counts}); {pair:?} overlap already before \
         any movement by more than the tolerance of {tolerance_mm} mm: check the label map, or \
         raise tolerance_mm"
    )]
    OverlapAtRest {
        hip: String,
        draws: u32,
        counts: MovementRejections,
        pair: Pair,
        tolerance_mm: f64,
    },
}

/// The first movement of the stream in which no bones overlap, and why the draws before it were
/// rejected. `hip` is the one that the model was made for.
///
/// # Errors
/// When none of `max_draws` movements is free of collisions.
pub fn sample_movement(
    collision: &CollisionModel,
    hip: &Hip,
    parameters: &MovementParameters,
    stream: &mut Stream,
) -> Result<(Movement, MovementRejections), MovementError> {
    let mut counts = MovementRejections::default();
    for _ in 0..parameters.max_draws {
        let movement = parameters.draw(hip.side, stream);
        match collision.first_collision(&movement.fragment, &movement.femur) {
            None => return Ok((movement, counts)),
            Some((pair, contact)) => counts.count(pair, contact),
        }
    }
    let (draws, tolerance_mm) = (parameters.max_draws, collision.tolerance_mm());
    let hip = hip.key();
    let rest = Rigid::identity();
    Err(match collision.first_collision(&rest, &rest) {
        None => MovementError::NoneFree {
            hip,
            draws,
            counts,
            tolerance_mm,
        },
        Some((pair, _)) => MovementError::OverlapAtRest {
            hip,
            draws,
            counts,
            pair,
            tolerance_mm,
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::lce_angle;
    use crate::geometry::PoseError;
    use crate::random::{Purpose, stream};
    use crate::surgery::toy_hip::{hip_of, toy_hip};

    fn draws(side: Side, count: usize) -> Vec<Movement> {
        let mut stream = stream(1, Purpose::Movement, "movement test");
        let parameters = MovementParameters::default();
        (0..count)
            .map(|_| parameters.draw(side, &mut stream))
            .collect()
    }

    fn mean_and_sd(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
        let n = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / n;
        let variance = values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, variance.sqrt())
    }

    /// Table S-5 without any rejection (DESIGN section 3, "collision").
    #[test]
    fn unrejected_movements_have_the_known_means() {
        for side in Side::BOTH {
            let errors: Vec<PoseError> = draws(side, 40_000)
                .iter()
                .map(|m| PoseError::of(&m.fragment))
                .collect();
            let rotation = mean_and_sd(errors.iter().map(|e| e.rotation_deg));
            let translation = mean_and_sd(errors.iter().map(|e| e.translation_mm));
            // Standard errors are 0.03 deg and 0.01 mm.
            assert!((rotation.0 - 17.53).abs() < 0.12, "{rotation:?}");
            assert!((rotation.1 - 6.29).abs() < 0.08, "{rotation:?}");
            assert!((translation.0 - 4.86).abs() < 0.04, "{translation:?}");
            assert!((translation.1 - 1.83).abs() < 0.03, "{translation:?}");
        }
    }

    #[test]
    fn sides_mirror_each_other() {
        let flip = |p: Point| Point::new(-p.x, p.y, p.z);
        let p = Point::new(21.0, -13.0, 8.0);
        for (l, r) in draws(Side::Left, 50).iter().zip(draws(Side::Right, 50)) {
            assert!((flip(l.fragment * flip(p)) - r.fragment * p).norm() < 1e-12);
            assert!((flip(l.femur * flip(p)) - r.femur * p).norm() < 1e-12);
        }
    }

    /// Each rotation on its own does what the parameters' documentation says.
    #[test]
    fn rotations_turn_the_way_they_are_named() {
        let still = motionless();
        let (top, knee) = (Point::new(0.0, 50.0, 0.0), Point::new(0.0, -150.0, 0.0));
        let front = Point::new(0.0, 0.0, 30.0);
        for side in Side::BOTH {
            let s = side.lateral_sign();
            let draw =
                |p: MovementParameters| p.draw(side, &mut stream(1, Purpose::Movement, "named"));
            let ten = [10.0; 2];
            let m = draw(MovementParameters {
                fragment_rotation_lr_deg: ten,
                ..still.clone()
            });
            assert!((m.fragment * top).z > 5.0, "the top goes forward");
            assert!(
                (m.fragment * front).y < -5.0,
                "the front goes down over the head"
            );
            let m = draw(MovementParameters {
                fragment_rotation_is_deg: ten,
                ..still.clone()
            });
            assert!((m.fragment * front).x * s > 5.0, "the front goes laterally");
            let m = draw(MovementParameters {
                fragment_rotation_ap_deg: ten,
                ..still.clone()
            });
            assert!((m.fragment * top).x * s > 5.0, "the top goes laterally");
            let m = draw(MovementParameters {
                femur_flexion_deg: ten,
                ..still.clone()
            });
            assert!((m.femur * knee).z > 20.0, "the knee goes forward");
            let m = draw(MovementParameters {
                femur_rotation_is_deg: ten,
                ..still.clone()
            });
            assert!((m.femur * front).x * s > 5.0, "the front goes laterally");
            let m = draw(MovementParameters {
                femur_rotation_ap_deg: ten,
                ..still.clone()
            });
            assert!((m.femur * knee).x * s < -20.0, "the knee goes medially");
            let m = draw(MovementParameters {
                translation_lr_mm: ten,
                ..still.clone()
            });
            assert_eq!(m.head(), Point::new(-10.0 * s, 0.0, 0.0));
            assert_eq!(m.fragment.translation, m.femur.translation);
        }
    }

    /// DESIGN section 3: the AP rotation raises the LCE angle on both sides.
    #[test]
    fn the_ap_rotation_raises_the_lce_angle_on_both_sides() {
        for side in Side::BOTH {
            let s = side.lateral_sign();
            let rim: Vec<Point> = (0..60)
                .map(|i| {
                    let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / 60.0).sin_cos();
                    // An opening that faces laterally, down and forward.
                    let (u, y) = (18.0 * cos - 4.0 * sin, 18.0 * cos + 4.0 * sin);
                    Point::new(s * (u + 3.0), y, 24.0 * sin)
                })
                .collect();
            let lce = |ap: f64| {
                let parameters = MovementParameters {
                    fragment_rotation_ap_deg: [ap; 2],
                    ..motionless()
                };
                let m = parameters.draw(side, &mut stream(1, Purpose::Movement, "lce"));
                lce_angle(&rim, side, &m.fragment, &Point::origin())
                    .unwrap()
                    .to_degrees()
            };
            let angles = [0.0, 5.0, 10.0, 25.0].map(lce);
            assert!(
                angles.is_sorted_by(|a, b| a + 3.0 < *b),
                "{side}: {angles:?}"
            );
        }
    }

    #[test]
    fn ranges_out_of_order_are_named() {
        assert!(MovementParameters::default().problems().is_empty());
        let wrong = MovementParameters {
            translation_ap_mm: [5.0, -1.0],
            max_draws: 0,
            ..Default::default()
        };
        let fields: Vec<String> = wrong.problems().into_iter().map(|p| p.0).collect();
        assert_eq!(fields, ["translation_ap_mm", "max_draws"]);
    }

    fn toy_model(side: Side) -> (Hip, CollisionModel) {
        let hip = toy_hip(side);
        let model = CollisionModel::new(&hip, &hip.specimen.labels, &Default::default()).unwrap();
        (hip, model)
    }

    #[test]
    fn sampled_movements_are_free_repeatable_and_mirrored() {
        let (left, right) = (toy_model(Side::Left), toy_model(Side::Right));
        let parameters = MovementParameters::default();
        let sample = |(hip, model): &(Hip, CollisionModel), key: &str| {
            sample_movement(
                model,
                hip,
                &parameters,
                &mut stream(1, Purpose::Movement, key),
            )
            .unwrap()
        };
        let mut rejected = 0;
        for key in ["m00", "m01", "m02", "m03", "m04"] {
            let (l, counts) = sample(&left, key);
            assert_eq!(left.1.first_collision(&l.fragment, &l.femur), None);
            assert_eq!(sample(&left, key), (l, counts));
            let (r, mirrored_counts) = sample(&right, key);
            assert_eq!(counts, mirrored_counts);
            let p = Point::new(21.0, -13.0, 8.0);
            let mirrored = l.fragment * Point::new(-p.x, p.y, p.z);
            assert!(
                (Point::new(-mirrored.x, mirrored.y, mirrored.z) - r.fragment * p).norm() < 1e-12
            );
            rejected += counts.total();
        }
        assert!(rejected > 0, "the toy hip rejects some");
    }

    #[test]
    fn giving_up_says_why() {
        let (hip, model) = toy_model(Side::Left);
        let parameters = MovementParameters {
            translation_is_mm: [8.0, 9.0],
            max_draws: 7,
            ..Default::default()
        };
        let mut s = stream(1, Purpose::Movement, "up");
        let error = sample_movement(&model, &hip, &parameters, &mut s).unwrap_err();
        let MovementError::NoneFree { draws, counts, .. } = &error else {
            panic!("{error}");
        };
        assert_eq!((*draws, counts.fragment_pelvis, counts.total()), (7, 7, 7));
        assert!(error.to_string().contains("toy/left"), "{error}");
    }

    /// Touching labels have the same surface between them; only a tolerance tells it from overlap.
    #[test]
    fn touching_bones_overlap_at_rest_without_a_tolerance() {
        use crate::anatomy::Label;
        let hip = hip_of(Side::Left, |u, y, z| {
            let inside = u * u + z * z < 900.0;
            match y - 0.3 * u {
                d if inside && (0.0..40.0).contains(&d) => Label::Fragment,
                d if inside && (-60.0..0.0).contains(&d) => Label::FemurLeft,
                _ if y > 80.0 => Label::Pelvis,
                _ => Label::Background,
            }
        });
        let model = CollisionModel::new(&hip, &hip.specimen.labels, &Default::default()).unwrap();
        let parameters = MovementParameters {
            max_draws: 3,
            ..motionless()
        };
        let sample = |model: &CollisionModel| {
            let mut s = stream(1, Purpose::Movement, "rest");
            sample_movement(model, &hip, &parameters, &mut s)
        };
        assert_eq!(sample(&model).unwrap().0, Movement::identity());
        let error = sample(&model.with_tolerance(0.0)).unwrap_err();
        assert!(
            matches!(
                error,
                MovementError::OverlapAtRest {
                    pair: Pair::FemurFragment,
                    ..
                }
            ),
            "{error}"
        );
    }

    /// Every range is zero.
    fn motionless() -> MovementParameters {
        MovementParameters {
            fragment_rotation_lr_deg: [0.0; 2],
            fragment_rotation_is_deg: [0.0; 2],
            fragment_rotation_ap_deg: [0.0; 2],
            femur_flexion_deg: [0.0; 2],
            femur_rotation_is_deg: [0.0; 2],
            femur_rotation_ap_deg: [0.0; 2],
            translation_lr_mm: [0.0; 2],
            translation_is_mm: [0.0; 2],
            translation_ap_mm: [0.0; 2],
            max_draws: 1,
        }
    }
}

//! A specimen's landmarks and rims: those found by rule, and those that people placed in their stead.

use super::{DetectError, Detected, Head, Missing, Place};
use crate::anatomy::{Landmarks, Rim, Side};
use crate::geometry::Point;
use std::fmt;

/// A given point this near a found one is the found one (mm): it went to a file and came back.
const SAME_MM: f64 = 1e-6;

/// Landmarks and rims that people placed (LPS, mm).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Given {
    pub landmarks: Landmarks,
    /// By [`Side::index`].
    pub rims: [Option<Vec<Point>>; 2],
}

/// All landmarks and both rims of a specimen (LPS, mm).
#[derive(Clone, Debug)]
pub struct Marks {
    pub landmarks: Landmarks,
    /// By [`Side::index`].
    pub rims: [Rim; 2],
    /// As of [`Detected`].
    pub heads: [Option<Head>; 2],
    /// Names of those that were given.
    pub given: Vec<String>,
    /// Those of the given ones that were not found.
    pub not_found: Vec<Missing>,
}

/// Landmarks or rims that were neither found nor given, and those that were (LPS, mm). It reads as a
/// list, a line for each reason.
#[derive(Clone, Debug)]
pub struct Unfound {
    pub landmarks: Landmarks,
    /// By [`Side::index`].
    pub rims: [Option<Rim>; 2],
    /// Not empty.
    pub missing: Vec<Missing>,
}

impl Detected {
    /// Nothing at all, for the reason of [`super::detect`].
    pub fn nothing(error: &DetectError) -> Self {
        Self {
            landmarks: Landmarks::default(),
            rims: [None, None],
            heads: [None; 2],
            pubic_tubercles: [None; 2],
            ischial_spines: [None; 2],
            missing: Place::all()
                .map(|(place, side)| Missing::new(place, side, error.clone()))
                .collect(),
        }
    }

    /// What was found, with the given ones in place of those found. Given ones that lie where the rule
    /// finds them count as found: an edited file brings those back that nobody moved.
    ///
    /// # Errors
    /// When something is neither found nor given.
    pub fn completed(self, given: &Given) -> Result<Marks, Box<Unfound>> {
        let (mut landmarks, mut rims) = (self.landmarks, self.rims);
        let mut names = Vec::new();
        for (landmark, side, point) in given.landmarks.iter() {
            let found = landmarks.get(landmark, side);
            if found.is_none_or(|found| apart(&found, &point)) {
                landmarks.set(landmark, side, point);
                names.push(Place::Landmark(landmark).name(side));
            }
        }
        for side in Side::BOTH {
            let found = &mut rims[side.index()];
            if let Some(points) = &given.rims[side.index()]
                && found.as_ref().is_none_or(|found| differ(found, points))
            {
                *found = Some(points.clone().into());
                names.push(Place::Rim.name(side));
            }
        }
        let is_given = |missing: &Missing| match missing.place {
            Place::Landmark(landmark) => given.landmarks.get(landmark, missing.side).is_some(),
            Place::Rim => given.rims[missing.side.index()].is_some(),
        };
        let (not_found, missing) = self.missing.into_iter().partition(is_given);
        match rims {
            [Some(left), Some(right)] if Vec::is_empty(&missing) => Ok(Marks {
                landmarks,
                rims: [left, right],
                heads: self.heads,
                given: names,
                not_found,
            }),
            rims => Err(Box::new(Unfound {
                landmarks,
                rims,
                missing,
            })),
        }
    }
}

/// Where landmarks and rims come from, for people.
pub(in crate::anatomy) fn by_rule_but(given: &[String]) -> String {
    match given {
        [] => "found by rule".to_owned(),
        given => format!("found by rule but for those given: {}", given.join(", ")),
    }
}

fn apart(a: &Point, b: &Point) -> bool {
    !((a - b).norm() <= SAME_MM)
}

fn differ(a: &[Point], b: &[Point]) -> bool {
    a.len() != b.len() || a.iter().zip(b).any(|(a, b)| apart(a, b))
}

/// Each reason once, with the names of all that it keeps from being found.
pub(in crate::anatomy) fn by_reason(missing: &[Missing]) -> Vec<(String, String)> {
    let mut groups: Vec<(String, String)> = Vec::new();
    for missing in missing {
        let reason = missing.error.to_string();
        match groups.iter_mut().find(|(_, other)| *other == reason) {
            Some((names, _)) => *names += &format!(", {}", missing.name()),
            None => groups.push((missing.name(), reason)),
        }
    }
    groups
}

impl fmt::Display for Unfound {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let lines = by_reason(&self.missing).into_iter();
        let lines: Vec<String> = lines
            .map(|(names, reason)| format!("- {names}: {reason}"))
            .collect();
        f.write_str(&lines.join("\n"))
    }
}

impl std::error::Error for Unfound {}

//! The landmarks and rims that a file sets in place of detected ones.

use super::error::PointsFileError;
use super::names::{Meaning, meaning};
use super::points::{PointsFile, read_points};
use crate::anatomy::problem::{MAX_RIM_GAP_MM, MIN_RIM_POINTS};
use crate::anatomy::{Landmark, Landmarks, Side};
use crate::geometry::Point;
use std::collections::BTreeMap;
use std::path::Path;

/// Landmarks and rims that a file sets in place of detected ones. LPS, mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LandmarkOverrides {
    /// Those that the file has.
    pub landmarks: Landmarks,
    /// Whole rims, by [`Side::index`], ordered as in the file.
    pub rims: [Option<Vec<Point>>; 2],
    /// A line for each point and curve that means neither.
    pub ignored: Vec<String>,
}

impl LandmarkOverrides {
    /// The names of the landmarks and rims, for people.
    pub fn names(&self) -> Vec<String> {
        let landmarks = self.landmarks.iter().map(|(l, side, _)| l.key(side));
        let rims = Side::BOTH
            .into_iter()
            .filter(|side| self.rims[side.index()].is_some())
            .map(|side| format!("{side} rim"));
        landmarks.chain(rims).collect()
    }

    /// Takes those of another file too.
    ///
    /// # Errors
    /// The names of those that both have, of which nothing is taken then.
    pub fn join(&mut self, other: Self) -> Result<(), String> {
        let mine = self.names();
        let twice = other.names().into_iter();
        let twice: Vec<String> = twice.filter(|name| mine.contains(name)).collect();
        if !twice.is_empty() {
            return Err(twice.join(", "));
        }
        self.landmarks.set_all(&other.landmarks);
        for (rim, given) in self.rims.iter_mut().zip(other.rims) {
            *rim = rim.take().or(given);
        }
        self.ignored.extend(other.ignored);
        Ok(())
    }
}

/// Reads the landmarks and rims that a file names ([`super::names`] is the rule).
///
/// A rim is a closed curve named as one, or points named as one and numbered along it; numbers may
/// have gaps. It must be as dense as a specimen's rim.
///
/// # Errors
/// As [`read_points`]; and when two names mean the same landmark or rim, when a rim has too few
/// points or jumps, and when the file has nothing but what is ignored.
pub fn read_landmark_overrides(path: &Path) -> Result<LandmarkOverrides, PointsFileError> {
    let file = read_points(path)?;
    let overrides = Reading {
        path,
        landmarks: BTreeMap::new(),
        curves: [None, None],
        points: [BTreeMap::new(), BTreeMap::new()],
        ignored: Vec::new(),
    }
    .read(file)?;
    if overrides.landmarks == Landmarks::default() && overrides.rims == [None, None] {
        return Err(PointsFileError::Nothing {
            path: path.into(),
            ignored: overrides.ignored,
        });
    }
    for line in &overrides.ignored {
        tracing::info!("{}: {line}; ignored", path.display());
    }
    Ok(overrides)
}

/// What is found so far, with the names as the file spells them.
struct Reading<'a> {
    path: &'a Path,
    landmarks: BTreeMap<(Landmark, Side), (String, Point)>,
    /// By [`Side::index`].
    curves: [Option<(String, Vec<Point>)>; 2],
    /// By [`Side::index`] and number.
    points: [BTreeMap<u64, (String, Point)>; 2],
    ignored: Vec<String>,
}

impl Reading<'_> {
    fn read(mut self, file: PointsFile) -> Result<LandmarkOverrides, PointsFileError> {
        for point in file.points {
            let (name, at) = (point.name, point.point);
            match meaning(&name) {
                Meaning::Landmark(landmark, side) => {
                    let before = self.landmarks.insert((landmark, side), (name.clone(), at));
                    self.refuse_second(before, &name, landmark.key(side))?;
                }
                Meaning::Rim(side, Some(number)) => {
                    let before = self.points[side.index()].insert(number, (name.clone(), at));
                    self.refuse_second(before, &name, format!("{side} rim point {number}"))?;
                }
                Meaning::Rim(_, None) => self.ignored.push(format!(
                    "'{name}' is a point of a rim without its number; is {name}_1 meant?"
                )),
                Meaning::Nothing(near) => self.ignored.push(nothing("", &name, near)),
            }
        }
        for curve in file.closed_curves {
            match meaning(&curve.name) {
                // As of a file in which nobody drew it yet.
                Meaning::Rim(..) if curve.points.is_empty() => self
                    .ignored
                    .push(format!("closed curve '{}' has no points", curve.name)),
                Meaning::Rim(side, _) => {
                    let curve = (curve.name, curve.points);
                    let name = curve.0.clone();
                    let before = self.curves[side.index()].replace(curve);
                    self.refuse_second(before, &name, format!("the {side} rim"))?;
                }
                _ => self
                    .ignored
                    .push(nothing("closed curve ", &curve.name, None)),
            }
        }
        self.ignored.extend(file.passed_over);
        self.finish()
    }

    fn refuse_second<T>(
        &self,
        before: Option<(String, T)>,
        second: &str,
        meaning: String,
    ) -> Result<(), PointsFileError> {
        match before {
            None => Ok(()),
            Some((first, _)) => Err(PointsFileError::SameMeaning {
                path: self.path.into(),
                first,
                second: second.to_owned(),
                meaning,
            }),
        }
    }

    fn finish(self) -> Result<LandmarkOverrides, PointsFileError> {
        let mut landmarks = Landmarks::default();
        for ((landmark, side), (_, at)) in &self.landmarks {
            landmarks.set(*landmark, *side, *at);
        }
        let mut rims = [None, None];
        for side in Side::BOTH {
            let curve = &self.curves[side.index()];
            let points = &self.points[side.index()];
            if let (Some(curve), Some(point)) = (curve, points.values().next()) {
                let meaning = format!("the {side} rim");
                self.refuse_second(Some(curve.clone()), &point.0, meaning)?;
            }
            let rim = match curve {
                Some((_, along)) => along.clone(),
                None if points.is_empty() => continue,
                None => points.values().map(|(_, at)| *at).collect(),
            };
            check_rim(&rim).map_err(|reason| PointsFileError::Rim {
                path: self.path.into(),
                side,
                reason,
            })?;
            rims[side.index()] = Some(rim);
        }
        Ok(LandmarkOverrides {
            landmarks,
            rims,
            ignored: self.ignored,
        })
    }
}

fn nothing(what: &str, name: &str, near: Option<String>) -> String {
    match near {
        Some(near) => format!("{what}'{name}' is no landmark; is {near} meant?"),
        None => format!("{what}'{name}' is neither a landmark nor a rim"),
    }
}

/// Says what a specimen would refuse about a rim.
fn check_rim(rim: &[Point]) -> Result<(), String> {
    if rim.len() < MIN_RIM_POINTS {
        return Err(format!(
            "has {} points; expected {MIN_RIM_POINTS} or more",
            rim.len()
        ));
    }
    for (n, point) in rim.iter().enumerate() {
        let gap_mm = (rim[(n + 1) % rim.len()] - point).norm();
        // Points so far off that their distance is no number are too far apart as well.
        if !(gap_mm <= MAX_RIM_GAP_MM) {
            return Err(format!(
                "jumps {gap_mm:.1} mm after point {n}; expected {MAX_RIM_GAP_MM} mm at most"
            ));
        }
    }
    Ok(())
}

//! The landmarks of DESIGN section 1.

use super::{Provenance, Side};
use crate::geometry::Point;
use std::collections::BTreeMap;
use std::str::FromStr;

/// A bilateral anatomical landmark.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Landmark {
    /// Anterior superior iliac spine.
    Asis,
    /// Anterior inferior iliac spine.
    Aiis,
    /// Centre of the femoral head.
    Fh,
    /// Superior pubic symphysis.
    Sps,
    /// Inferior pubic symphysis.
    Ips,
    /// Medial point of maximal curvature of the obturator foramen: the picked landmark.
    Mof,
    /// Inferior point of maximal curvature of the obturator foramen.
    Iof,
    /// Greater sciatic notch.
    Gsn,
}

impl Landmark {
    /// All of them, in the order in which files list them.
    pub const ALL: [Self; 8] = [
        Self::Asis,
        Self::Aiis,
        Self::Fh,
        Self::Sps,
        Self::Ips,
        Self::Mof,
        Self::Iof,
        Self::Gsn,
    ];

    /// The abbreviation that files use, without the side.
    pub fn name(self) -> &'static str {
        match self {
            Self::Asis => "ASIS",
            Self::Aiis => "AIIS",
            Self::Fh => "FH",
            Self::Sps => "SPS",
            Self::Ips => "IPS",
            Self::Mof => "MOF",
            Self::Iof => "IOF",
            Self::Gsn => "GSN",
        }
    }

    /// The name with the side, `ASIS_l` for instance.
    pub fn key(self, side: Side) -> String {
        let suffix = match side {
            Side::Left => "l",
            Side::Right => "r",
        };
        format!("{}_{suffix}", self.name())
    }
}

impl FromStr for Landmark {
    type Err = ();

    fn from_str(name: &str) -> Result<Self, ()> {
        Self::ALL
            .into_iter()
            .find(|landmark| landmark.name() == name)
            .ok_or(())
    }
}

/// The landmarks of a specimen, in the world of its CT (LPS, mm).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Landmarks {
    points: BTreeMap<(Landmark, Side), (Point, Provenance)>,
}

impl Landmarks {
    /// Sets one landmark that came with the data; one that was found before is overridden.
    pub fn set(&mut self, landmark: Landmark, side: Side, point: Point) {
        self.set_with(landmark, side, point, Provenance::GIVEN);
    }

    /// Sets one landmark and how it came to be known.
    pub fn set_with(&mut self, landmark: Landmark, side: Side, point: Point, from: Provenance) {
        self.points.insert((landmark, side), (point, from));
    }

    /// Sets every landmark that `others` has, and how it came to be known.
    pub fn set_all(&mut self, others: &Self) {
        self.points
            .extend(others.points.iter().map(|(&key, &of)| (key, of)));
    }

    /// One landmark, or `None` if the specimen lacks it.
    pub fn get(&self, landmark: Landmark, side: Side) -> Option<Point> {
        self.points.get(&(landmark, side)).map(|of| of.0)
    }

    /// How a landmark came to be known, or `None` if the specimen lacks it.
    pub fn provenance(&self, landmark: Landmark, side: Side) -> Option<Provenance> {
        self.points.get(&(landmark, side)).map(|of| of.1)
    }

    /// Every landmark that is there, in a fixed order.
    pub fn iter(&self) -> impl Iterator<Item = (Landmark, Side, Point)> + '_ {
        self.points.iter().map(|(&(l, s), of)| (l, s, of.0))
    }

    /// The names of those that are missing, for error messages.
    pub fn missing(&self) -> Vec<String> {
        Landmark::ALL
            .into_iter()
            .flat_map(|l| Side::BOTH.map(|s| (l, s)))
            .filter(|key| !self.points.contains_key(key))
            .map(|(l, s)| l.key(s))
            .collect()
    }
}

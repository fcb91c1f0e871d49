//! An acetabular rim's trace.

use super::Provenance;
use crate::geometry::Point;
use std::ops::{Deref, DerefMut};

/// An ordered closed polyline of points a few mm apart, in the world of the specimen's CT (LPS,
/// mm), with where it comes from. A rim made from points alone counts as given.
#[derive(Clone, Debug, PartialEq)]
pub struct Rim {
    points: Vec<Point>,
    pub provenance: Provenance,
}

impl Rim {
    /// A rim of known provenance.
    pub fn new(points: Vec<Point>, provenance: Provenance) -> Self {
        Self { points, provenance }
    }
}

impl Default for Rim {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl From<Vec<Point>> for Rim {
    fn from(points: Vec<Point>) -> Self {
        Self::new(points, Provenance::GIVEN)
    }
}

impl FromIterator<Point> for Rim {
    fn from_iter<I: IntoIterator<Item = Point>>(points: I) -> Self {
        Vec::from_iter(points).into()
    }
}

impl Deref for Rim {
    type Target = Vec<Point>;

    fn deref(&self) -> &Vec<Point> {
        &self.points
    }
}

impl DerefMut for Rim {
    fn deref_mut(&mut self) -> &mut Vec<Point> {
        &mut self.points
    }
}

//! What was not found, by name.

use super::DetectError;
use crate::anatomy::{Landmark, Side};

/// What a specimen wants on each side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    Landmark(Landmark),
    /// The acetabular rim.
    Rim,
}

impl Place {
    /// All that a specimen wants: landmarks in the order of files, then rims.
    pub fn all() -> impl Iterator<Item = (Self, Side)> {
        let landmarks = Landmark::ALL.into_iter().map(Self::Landmark);
        landmarks
            .chain([Self::Rim])
            .flat_map(|place| Side::BOTH.map(|side| (place, side)))
    }

    /// `ASIS_l` or `left rim`, for people.
    pub fn name(self, side: Side) -> String {
        match self {
            Self::Landmark(landmark) => landmark.key(side),
            Self::Rim => format!("{side} rim"),
        }
    }
}

/// A landmark or rim that was not found, and why.
#[derive(Clone, Debug)]
pub struct Missing {
    pub place: Place,
    pub side: Side,
    pub error: DetectError,
}

impl Missing {
    pub(super) fn new(place: Place, side: Side, error: DetectError) -> Self {
        Self { place, side, error }
    }

    /// `ASIS_l` or `left rim`, for people.
    pub fn name(&self) -> String {
        self.place.name(self.side)
    }
}

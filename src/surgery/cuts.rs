//! The four osteotomy planes.

use crate::geometry::Plane;
use serde::{Deserialize, Serialize};

/// One of the four osteotomies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Cut {
    Ilium,
    Ischium,
    Posterior,
    Pubis,
}

impl Cut {
    /// All four, in the order in which [`CutPlanes`] stores them.
    pub const ALL: [Self; 4] = [Self::Ilium, Self::Ischium, Self::Posterior, Self::Pubis];

    /// `ilium`, `ischium`, `posterior` or `pubis`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ilium => "ilium",
            Self::Ischium => "ischium",
            Self::Posterior => "posterior",
            Self::Pubis => "pubis",
        }
    }
}

/// The four planes in the APP with the origin at the ipsilateral femoral head. Normals point OUT
/// of the fragment, so the femoral head has a negative signed distance to each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutPlanes {
    planes: [Plane; 4],
}

impl CutPlanes {
    /// Planes in the order of [`Cut::ALL`].
    pub fn new(planes: [Plane; 4]) -> Self {
        Self { planes }
    }

    /// One plane.
    pub fn get(&self, cut: Cut) -> &Plane {
        &self.planes[cut as usize]
    }

    /// The same planes with one of them replaced.
    pub fn with(mut self, cut: Cut, plane: Plane) -> Self {
        self.planes[cut as usize] = plane;
        self
    }
}

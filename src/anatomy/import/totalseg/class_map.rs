//! TotalSegmentator's numbers of the bones, in the task `total`.

use crate::anatomy::{Side, Structure};

/// A version of the class map: 1 (104 classes) or 2 (117 classes, also in later versions of the
/// program).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TotalsegVersion {
    V1,
    V2,
}

impl TotalsegVersion {
    pub const ALL: [Self; 2] = [Self::V1, Self::V2];

    /// 1 or 2.
    pub fn number(self) -> u8 {
        match self {
            Self::V1 => 1,
            Self::V2 => 2,
        }
    }

    /// The highest value of the map.
    pub fn classes(self) -> u8 {
        match self {
            Self::V1 => 104,
            Self::V2 => 117,
        }
    }

    /// The value of a bone (package totalsegmentator 2.18.0, `class_map`: `total_v1` and `total`).
    pub fn value(self, structure: Structure) -> u8 {
        let [sacrum, hips, femurs] = match self {
            Self::V1 => [92, 90, 88],
            Self::V2 => [25, 77, 75],
        };
        let right = |side: Side| side.index() as u8;
        match structure {
            Structure::Sacrum => sacrum,
            Structure::Hip(side) => hips + right(side),
            Structure::Femur(side) => femurs + right(side),
        }
    }
}

//! One body.

use super::{Landmarks, Rim, Side};
use crate::geometry::Point;
use crate::volume::Volume;
use serde::{Deserialize, Serialize};

/// One body: CT, label map, landmarks and rim traces (DESIGN section 1). The world of all of them
/// is LPS in mm.
#[derive(Clone, Debug)]
pub struct Specimen {
    /// The name that keys and tables use: letters, digits and `-`.
    pub name: String,
    pub source: Source,
    /// Hounsfield units.
    pub ct: Volume<i16>,
    /// [`super::Label`] values on the same grid as `ct`.
    pub labels: Volume<u8>,
    pub landmarks: Landmarks,
    /// The acetabular rim's trace of each side ([`Side::index`]).
    pub rims: [Rim; 2],
}

impl Specimen {
    /// The rim's trace of one side.
    pub fn rim(&self, side: Side) -> &[Point] {
        &self.rims[side.index()]
    }
}

/// Where a specimen comes from, as reports print it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// `phantom`, `surfaces`, ...
    pub kind: String,
    /// A sentence for people: which data, which parameters.
    pub description: String,
    /// Licence of the anatomy, or "none" for a phantom.
    pub licence: String,
    /// `male`, `female` or `unknown`.
    pub sex: String,
    /// True when the Hounsfield values were assigned by rule rather than measured.
    pub assigned_density: bool,
}

//! The two frames in which files state points of a patient.

use crate::geometry::Point;
use serde::Deserialize;
use std::str::FromStr;

/// Which way the axes of a file's coordinates point. Inside the program all points are LPS; a
/// reader converts what it reads and nothing else does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum PatientFrame {
    /// x to the patient's left, y posterior, z superior.
    #[serde(rename = "LPS")]
    Lps,
    /// x to the patient's right, y anterior, z superior.
    #[serde(rename = "RAS")]
    Ras,
}

impl PatientFrame {
    /// A point of this frame in LPS. No coordinate becomes -0, so equal places have equal bits.
    pub fn to_lps(self, [x, y, z]: [f64; 3]) -> Point {
        match self {
            Self::Lps => Point::new(x + 0.0, y + 0.0, z + 0.0),
            Self::Ras => Point::new(-x + 0.0, -y + 0.0, z + 0.0),
        }
    }
}

impl FromStr for PatientFrame {
    type Err = ();

    /// `LPS` or `RAS`, in letters of either case.
    fn from_str(name: &str) -> Result<Self, ()> {
        match name.to_ascii_uppercase().as_str() {
            "LPS" => Ok(Self::Lps),
            "RAS" => Ok(Self::Ras),
            _ => Err(()),
        }
    }
}

impl std::fmt::Display for PatientFrame {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Lps => "LPS",
            Self::Ras => "RAS",
        })
    }
}

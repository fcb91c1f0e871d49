//! Pictures of a specimen: the AP radiograph with its landmarks, and for each hip slices and surfaces
//! with the planned cuts.

mod hip;
mod painting;
mod radiograph;
mod shading;
mod sheet;

pub use hip::{HipPlan, hip_picture};
pub use painting::Painting;
pub use radiograph::ap_radiograph;
pub use sheet::check_sheet;

use super::picture::Colour;

/// Landmarks and rim of the left and of the right side.
const SIDES: [Colour; 2] = [[0, 230, 90], [255, 150, 40]];

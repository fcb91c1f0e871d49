//! Cuts, the fragment, collisions and K-wires.

pub mod acetabulum;
pub mod collision;
pub mod cuts;
pub mod fragment;
pub mod insertion_zone;
pub mod kwire;
pub mod nominal_cuts;
mod posterior_column;
mod ranges;
#[cfg(test)]
pub(crate) mod toy_hip;

pub use acetabulum::Acetabulum;
pub use collision::{CollisionError, CollisionModel, CollisionParameters};
pub use cuts::{Cut, CutPlanes};
pub use fragment::{FragmentError, FragmentParameters, SurgeryMap, cut_fragment};
pub use insertion_zone::ZoneParameters;
pub use kwire::{KWire, KWireError, KWireModel, KWireParameters, place_kwires};
pub use nominal_cuts::{NominalCutError, NominalCutParameters, nominal_cuts};

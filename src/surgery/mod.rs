//! Cuts, the fragment, collisions and K-wires.

pub mod acetabulum;
#[cfg(test)]
pub(crate) mod block_hip;
pub mod collision;
pub mod cuts;
pub mod fragment;
pub mod insertion_zone;
pub mod kwire;
pub mod nominal_cuts;
pub mod plausibility;
pub mod posterior_column;
pub mod random_cuts;
mod ranges;
pub mod sampling;
pub mod site;
#[cfg(test)]
pub(crate) mod toy_hip;

pub use acetabulum::Acetabulum;
pub use collision::{CollisionError, CollisionModel, CollisionParameters};
pub use cuts::{Cut, CutPlanes};
pub use fragment::{FragmentError, FragmentParameters, SurgeryMap, cut_fragment};
pub use insertion_zone::ZoneParameters;
pub use kwire::{KWire, KWireError, KWireModel, KWireParameters, place_kwires};
pub use nominal_cuts::{NominalCutError, NominalCutParameters, nominal_cuts};
pub use plausibility::{PlausibilityParameters, Rejection, plausible_estimate, plausible_fragment};
pub use posterior_column::PosteriorColumn;
pub use random_cuts::{CutPivots, RandomCutParameters, random_cuts};
pub use sampling::{FragmentSamplingParameters, RejectionCounts, SampleError, sample_fragment};
pub use site::{OsteotomySite, SiteError};

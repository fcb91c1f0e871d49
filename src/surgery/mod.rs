//! Cuts, the fragment, collisions and K-wires.

pub mod acetabulum;
pub mod cuts;
pub mod fragment;
pub mod nominal_cuts;
mod posterior_column;
mod ranges;

pub use acetabulum::Acetabulum;
pub use cuts::{Cut, CutPlanes};
pub use fragment::{FragmentError, FragmentParameters, SurgeryMap, cut_fragment};
pub use nominal_cuts::{NominalCutError, NominalCutParameters, nominal_cuts};

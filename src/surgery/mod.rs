//! Cuts, the fragment, collisions and K-wires.

pub mod cuts;
pub mod fragment;

pub use cuts::{Cut, CutPlanes};
pub use fragment::{FragmentError, FragmentParameters, SurgeryMap, cut_fragment};

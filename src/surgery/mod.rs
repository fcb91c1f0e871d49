//! Cuts, the fragment, collisions and K-wires.

pub mod cuts;

pub use cuts::{Cut, CutPlanes};

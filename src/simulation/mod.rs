//! One case: perturb, move, wires, warp, views, fluoroscopy, picks, annotations. Holds the truth.

pub mod fluoroscopy;
pub mod movement;
pub mod noise;
pub mod pick;
pub mod views;
pub mod warp;

#[cfg(test)]
mod testing;

pub use fluoroscopy::{FluoroscopyParameters, fluoroscopy};
pub use movement::{Movement, MovementError, MovementParameters, RejectionCounts, sample_movement};
pub use pick::{Pick, PickParameters};
pub use views::{ViewParameters, Views};
pub use warp::{MovedAnatomy, WarpParameters};

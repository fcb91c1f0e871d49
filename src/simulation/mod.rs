//! One case: perturb, move, wires, warp, views, fluoroscopy, picks, annotations. Holds the truth.

pub mod annotate;
pub mod case;
pub mod fluoroscopy;
pub mod movement;
pub mod noise;
pub mod pick;
pub mod views;
pub mod warp;
pub mod wires;

#[cfg(test)]
mod case_tests;
#[cfg(test)]
mod shape_tests;
#[cfg(test)]
mod testing;

pub use annotate::{AnnotationParameters, CutLines};
pub use case::{Case, CaseError, CaseParameters, CaseTruth, Operation, pelvis_surface};
pub use fluoroscopy::{FluoroscopyParameters, fluoroscopy};
pub use movement::{
    Movement, MovementError, MovementParameters, MovementRejections, sample_movement,
};
pub use pick::{Pick, PickParameters};
pub use views::{ViewParameters, Views};
pub use warp::{MovedAnatomy, WarpParameters};
pub use wires::{WireInsertionParameters, insert_wires};

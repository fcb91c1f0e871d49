//! The strategy `paper`: the method of Grupp et al. to the letter; and `paper_slice`, its search with
//! DRRs by slice resampling.

mod initialization;
mod multi_view;
mod parameters;
mod pipeline;
mod single_view;
mod slice;
mod views;

pub use initialization::from_single_landmark;
pub use parameters::{MultiViewParameters, PaperParameters, SingleViewParameters};
pub use pipeline::Paper;
pub use slice::{PaperSlice, PaperSliceParameters};

//! Optimizers over vectors and costs: CMA-ES and BOBYQA. They know nothing of imaging.

mod bobyqa_box;
mod cmaes;

pub use bobyqa_box::{BoxError, BoxOutcome, BoxSearch, minimize_in_box};
pub use cmaes::{CmaEs, CmaEsParameters, CmaEsStop};

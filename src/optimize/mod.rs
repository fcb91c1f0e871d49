//! Optimizers over vectors and costs: CMA-ES and BOBYQA.

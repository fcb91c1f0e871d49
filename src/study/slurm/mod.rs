//! A study on a cluster with Slurm: job scripts, the copies of what they run, and their submission.
//!
//! A job array runs the study's shares, each task one; a report job follows. The scripts name a copy of
//! the program and of the configuration that never change, so that neither a new build nor an edit reaches
//! a job that still waits in the queue.

mod client;
mod error;
mod install;
mod quoting;
mod request;
mod script;
mod wall_time;

pub use client::{JobId, Submitted, max_array_size, queued, submit};
pub use error::SlurmError;
pub use install::{Installed, install};
pub use quoting::shell_words;
pub use request::{Array, MAX_ARRAY_SIZE, Request};
pub use wall_time::WallTime;

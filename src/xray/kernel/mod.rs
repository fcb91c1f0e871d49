//! The loops that project bones: one file for each level of vector instructions.

pub(crate) mod occupancy;
pub(crate) mod portable;
mod volume;

pub(crate) use volume::KernelVolume;

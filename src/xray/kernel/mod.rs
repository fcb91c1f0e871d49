//! The loops that project bones: one file for each level of vector instructions.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod fixed;
mod occupancy;
mod portable;
mod projection;
#[cfg(target_arch = "x86_64")]
mod tile;
mod volume;

pub(crate) use projection::Projection;
pub(crate) use volume::KernelVolume;

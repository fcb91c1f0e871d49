//! Slice resampling: a perspective shear-warp, which needs no gathers.
//!
//! In a slice of voxels across the direction of the rays, the points where rays meet the slice form
//! an affine image of a regular lattice of ray directions, separable in rows and columns. So all
//! slices are resampled to one lattice and summed there, with contiguous loads only, and the sum is
//! warped to the detector once. The rule of integration is Joseph's (IEEE TMI 1982,
//! doi 10.1109/TMI.1982.4307572): bilinear in each slice, one sample a slice, each times the length
//! of the ray between slices. The factorization is Lacroute and Levoy's (SIGGRAPH 1994,
//! doi 10.1145/192161.192283).
//!
//! `stack.rs` holds the voxels, one copy for each axis; `lattice.rs` the geometry of one pose;
//! `tables.rs` what a group of slices shares among its rows; `portable.rs`, `avx2.rs` and
//! `avx512.rs` the sums, in integers, so that all levels give the same bits; `warp.rs` the way to
//! the detector.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod four;
mod lattice;
mod portable;
mod stack;
mod sums;
mod tables;
mod warp;

pub(crate) use lattice::Lattice;
pub(crate) use stack::SliceStack;
pub(crate) use sums::{Sums, add_group, groups};
pub(crate) use tables::Tables;
pub(crate) use warp::add_pixels;

//! Closed triangle surfaces from files: PLY, STL, VTK (legacy polydata) and OBJ.
//!
//! A format's file yields vertices and faces as they stand there, and the frame if it is stated
//! ([`mesh::Mesh`]); merging, closedness and orientation are one piece of code for all.

mod mesh;
mod obj;
mod ply;
mod read;
mod stated_frame;
mod stl;
#[cfg(test)]
mod tests;
mod vtk;
mod vtk_bytes;

pub use read::{MeshFormat, read_closed_surface};

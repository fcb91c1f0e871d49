//! `pao-sim specimen import`: a specimen's folder from other data.

mod common;
mod deepfluoro;
mod labels;
mod surfaces;
mod totalseg;
mod vsd;

use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use clap::Subcommand;

#[derive(Debug, Subcommand)]
pub enum From {
    /// From closed surfaces of the bones (.ply, .stl, .vtk or .obj; mm): Sacrum, Hip_L, Hip_R, Femur_L
    /// and Femur_R. Landmarks and rims are found by rule, densities assigned.
    Surfaces(surfaces::Arguments),
    /// From a CT and what TotalSegmentator made of it: a folder with one mask a structure, or one file
    /// of all (task total).
    Totalseg(totalseg::Arguments),
    /// From a CT, a label map and a table that says which value is which bone; a segmentation by 3D Slicer
    /// (.seg.nrrd) names its values itself.
    Labels(labels::Arguments),
    /// From the HDF5 file (full resolution) of the DeepFluoro data set.
    Deepfluoro(deepfluoro::Arguments),
    /// From a subject of VSDFullBodyBoneReconstruction: CT and Slicer segmentation.
    Vsd(vsd::Arguments),
}

pub fn main(from: &From, common: &Common) -> Result<Exit, Failure> {
    match from {
        From::Surfaces(own) => surfaces::main(own, common),
        From::Totalseg(own) => totalseg::main(own, common),
        From::Labels(own) => labels::main(own, common),
        From::Deepfluoro(own) => deepfluoro::main(own, common),
        From::Vsd(own) => vsd::main(own, common),
    }
}

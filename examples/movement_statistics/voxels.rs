//! The test for overlap of the authors' public program, on voxels (facts 2.14): fragment and femur as
//! one body against the pelvis.

use pao_sim::anatomy::{Hip, Label};
use pao_sim::geometry::{Point, Rigid};
use pao_sim::volume::{Volume, morphology};

/// Pelvis farther than this from the femoral head is left out, in mm: neither fragment nor femoral
/// head gets there.
const REACH_MM: f64 = 120.0;

/// Opened labels of one surgery.
pub struct VoxelTest {
    /// Centres of the pelvis' voxels in the APP.
    pelvis: Vec<Point>,
    moving: Volume<bool>,
}

impl VoxelTest {
    pub fn new(hip: &Hip, labels: &Volume<u8>, opening_radius_mm: f64) -> Self {
        let opened = |label: Label| {
            let mask = labels.map(|v| v == label.value());
            morphology::open(&mask, opening_radius_mm)
        };
        let grid = &labels.grid;
        let pelvis = opened(Label::Pelvis);
        let pelvis = (0..grid.len())
            .filter(|&o| pelvis.data[o])
            .map(|o| hip.app_from_volume * grid.center(grid.voxel(o)))
            .filter(|p| p.coords.norm() < REACH_MM)
            .collect();
        let mut moving = opened(Label::Fragment);
        for (moves, femur) in moving
            .data
            .iter_mut()
            .zip(opened(Label::femur(hip.side)).data)
        {
            *moves |= femur;
        }
        Self { pelvis, moving }
    }

    /// True if the centre of a pelvis voxel lies in a voxel of fragment or femur once these have made
    /// the fragment's movement.
    pub fn overlaps(&self, hip: &Hip, fragment: &Rigid) -> bool {
        let back = hip.app_from_volume.inverse() * fragment.inverse();
        let hit = |p: &Point| self.moving.nearest(&(back * p)) == Some(true);
        self.pelvis.iter().any(hit)
    }
}

//! The posterior column's border: the bone's back edge between sciatic notch and ischium.

use super::acetabulum::Acetabulum;
use crate::anatomy::{Hip, Label};
use crate::geometry::{Point, Vector};
use crate::volume::components::components;
use crate::volume::{Grid, Volume};
use std::ops::RangeInclusive;

/// Part of each axial slice that is looked at, in mm from the femoral head: medial, lateral,
/// backward, forward.
const SLICE_MM: [f64; 4] = [70.0, 50.0, 110.0, 60.0];
/// Distance in mm of slices, and of the points in them.
const STEP_MM: f64 = 1.0;
/// Fewest slices that make a border.
const FEWEST_SLICES: usize = 15;

/// Why the border is not found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ColumnError {
    #[error(
        "the sciatic notch (GSN) of {hip} lies {height_mm:.1} mm above the lowest rim point, expected {FEWEST_SLICES} mm or more; check both"
    )]
    NotchTooLow { hip: String, height_mm: f64 },
    #[error(
        "no pelvis behind the femoral head of {hip} at a height of {height_mm:.1} mm above its centre; check that the label map holds the pelvis as 1"
    )]
    NoBone { hip: String, height_mm: f64 },
}

/// The hindmost points of the posterior column, seen from the side (x = 0), at `heights` (y in the
/// APP) from low to high in steps of 1 mm.
///
/// In each axial slice the bone that is connected with the posterior wall of the acetabulum
/// counts: below the notch the sacrum is not.
///
/// # Errors
/// When the heights span too little, or there is no bone at one of them.
pub fn posterior_border(
    hip: &Hip,
    acetabulum: &Acetabulum,
    heights: RangeInclusive<f64>,
) -> Result<Vec<Vector>, ColumnError> {
    let span = heights.end() - heights.start();
    if span < FEWEST_SLICES as f64 * STEP_MM {
        return Err(ColumnError::NotchTooLow {
            hip: hip.key(),
            height_mm: span,
        });
    }
    let mut wall = Point::origin();
    for p in &acetabulum.rim {
        if p.z < wall.z {
            wall = *p;
        }
    }
    (0..=(span / STEP_MM) as usize)
        .map(|n| {
            let y = heights.start() + n as f64 * STEP_MM;
            let z = hindmost(hip, y, &wall).ok_or_else(|| ColumnError::NoBone {
                hip: hip.key(),
                height_mm: y,
            })?;
            Ok(Vector::new(0.0, y, z))
        })
        .collect()
}

/// The smallest z of the bone in the slice at height `y` that is connected with the bone nearest to
/// `wall`.
fn hindmost(hip: &Hip, y: f64, wall: &Point) -> Option<f64> {
    let [medial, lateral, backward, forward] = SLICE_MM;
    let sign = hip.side.lateral_sign();
    // The slice's own axes: i laterally, j forward.
    let grid = Grid::axis_aligned(
        [
            ((medial + lateral) / STEP_MM) as usize + 1,
            ((backward + forward) / STEP_MM) as usize + 1,
            1,
        ],
        STEP_MM,
        Point::new(-medial, -backward, 0.0),
    );
    let volume_from_app = hip.app_from_volume.inverse();
    let labels = &hip.specimen.labels;
    let bone = Volume::new(
        grid.clone(),
        (0..grid.len())
            .map(|offset| {
                let p = grid.center(grid.voxel(offset));
                let in_volume = volume_from_app * Point::new(p.x * sign, y, p.y);
                labels.nearest(&in_volume) == Some(Label::Pelvis.value())
            })
            .collect(),
    );
    let pieces = components(&bone);
    let seed = Point::new(wall.x * sign, wall.z, 0.0);
    let mut nearest: Option<(f64, u32)> = None;
    for (offset, &piece) in pieces.labels.data.iter().enumerate() {
        if piece != 0 {
            let distance = (grid.center(grid.voxel(offset)) - seed).norm_squared();
            if nearest.is_none_or(|(best, _)| distance < best) {
                nearest = Some((distance, piece));
            }
        }
    }
    let (_, column) = nearest?;
    let bounds = pieces.labels.bounds(|piece| piece == column);
    bounds.map(|(min, _)| grid.center(min).y)
}

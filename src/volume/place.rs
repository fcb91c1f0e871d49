//! The grid that a file's affine describes.

use super::Grid;
use crate::geometry::Point;
use nalgebra::{Matrix3, Matrix3x4};

/// How far from a right angle two axes may be (the cosine): the rounding of a header's 32-bit
/// floats stays far below, a gantry tilt far above.
const MAX_COSINE: f64 = 1e-3;

/// The voxel sizes that are believed; beyond them the arithmetic of the axes may overflow.
const SPACING_MM: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

/// Says so when a number of an affine is none.
pub(super) fn check_finite(affine: &Matrix3x4<f64>) -> Result<(), String> {
    if affine.iter().all(|v| v.is_finite()) {
        return Ok(());
    }
    Err(format!("its affine is not finite: {}", rows(affine)))
}

/// The grid whose voxel (i, j, k) lies at `lps_from_index` (i, j, k, 1), in LPS mm.
///
/// # Errors
/// With what is wrong with the affine: not finite, without extent, or its axes not at right angles.
pub(crate) fn grid_from_affine(
    lps_from_index: &Matrix3x4<f64>,
    dims: [usize; 3],
) -> Result<Grid, String> {
    check_finite(lps_from_index)?;
    let lps = lps_from_index;
    let axes = lps.fixed_view::<3, 3>(0, 0).into_owned();
    let spacing: [f64; 3] = std::array::from_fn(|a| axes.column(a).norm());
    if !spacing.iter().all(|s| SPACING_MM.contains(s)) {
        return Err(format!("its voxels have the size {spacing:?} mm"));
    }
    let mut direction = axes;
    for (axis, size) in spacing.iter().enumerate() {
        direction.column_mut(axis).scale_mut(1.0 / size);
    }
    for (a, b) in [(0, 1), (0, 2), (1, 2)] {
        let cosine = direction.column(a).dot(&direction.column(b));
        if cosine.abs() > MAX_COSINE {
            return Err(format!(
                "its axes {a} and {b} are not at right angles (a tilted gantry?); resample it to a \
                 grid with right angles"
            ));
        }
    }
    Ok(Grid {
        dims,
        spacing,
        origin: Point::from(lps.column(3).into_owned()),
        direction: nearest_orthogonal(&direction),
    })
}

/// The orthogonal matrix nearest to an almost orthogonal one: the header's 32-bit floats leave a
/// rounding that would make a grid's two directions of mapping disagree.
fn nearest_orthogonal(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    if exactly_orthogonal(matrix) {
        return *matrix;
    }
    let mut m = *matrix;
    // Newton's iteration for the polar factor converges quadratically from here.
    for _ in 0..6 {
        let inverse = m
            .try_inverse()
            .expect("axes checked to be at right angles have an inverse");
        m = (m + inverse.transpose()) * 0.5;
    }
    m
}

/// True for the matrices of axis-aligned grids, which must pass without a change of any bit.
fn exactly_orthogonal(matrix: &Matrix3<f64>) -> bool {
    matrix.transpose() * matrix == Matrix3::identity()
}

fn rows(m: &Matrix3x4<f64>) -> String {
    let row = |r: usize| {
        format!(
            "[{}, {}, {}, {}]",
            m[(r, 0)],
            m[(r, 1)],
            m[(r, 2)],
            m[(r, 3)]
        )
    };
    format!("[{}, {}, {}]", row(0), row(1), row(2))
}

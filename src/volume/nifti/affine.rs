//! A grid's place in the world, in a NIfTI header.

use crate::geometry::Vector;
use crate::volume::Grid;
use crate::volume::place::{check_finite, grid_from_affine};
use ::nifti::NiftiHeader;
use nalgebra::{Matrix3, Matrix3x4, Quaternion, Rotation3, UnitQuaternion};

/// NIFTI_XFORM_SCANNER_ANAT: the coordinates are those of the scanner.
const SCANNER_ANAT: i16 = 1;

/// How far, in voxels, the sform and the qform may place the same voxel apart.
const MAX_DISAGREEMENT_VOXELS: f64 = 0.5;

/// The grid (LPS) that a header (RAS) describes. The sform is taken where there is one, else the
/// qform; a file with neither has no place in the world, and one whose two forms disagree has
/// two: both are refused.
pub(super) fn grid_of(header: &NiftiHeader, dims: [usize; 3]) -> Result<Grid, String> {
    let sform = (header.sform_code > 0).then(|| sform(header));
    let qform = (header.qform_code > 0).then(|| qform(header)).transpose()?;
    let ras_from_index = match (sform, qform) {
        (Some(s), Some(q)) => {
            check_finite(&s)?;
            check_finite(&q)?;
            check_agreement(&s, &q, dims)?;
            s
        }
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => return Err("neither its sform code nor its qform code is set".into()),
    };
    grid_from_ras(&ras_from_index, dims)
}

fn sform(header: &NiftiHeader) -> Matrix3x4<f64> {
    let rows = [header.srow_x, header.srow_y, header.srow_z];
    Matrix3x4::from_fn(|r, c| f64::from(rows[r][c]))
}

fn qform(header: &NiftiHeader) -> Result<Matrix3x4<f64>, String> {
    let [b, c, d] = [header.quatern_b, header.quatern_c, header.quatern_d].map(f64::from);
    let square = b * b + c * c + d * d;
    // Three rounded components of a half turn may exceed 1 by a few units in the last place.
    if !(square <= 1.0 + 1e-5) {
        return Err(format!(
            "its qform's quaternion ({b}, {c}, {d}) is longer than 1"
        ));
    }
    let a = (1.0 - square).max(0.0).sqrt();
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(a, b, c, d));
    // The standard reads a qfac (pixdim[0]) of 0 as 1.
    let qfac = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    let [i, j, k] = [1, 2, 3].map(|n| f64::from(header.pixdim[n]));
    let axes = rotation.to_rotation_matrix().into_inner()
        * Matrix3::from_diagonal(&Vector::new(i, j, k * qfac));
    let offset = Vector::new(
        f64::from(header.quatern_x),
        f64::from(header.quatern_y),
        f64::from(header.quatern_z),
    );
    Ok(Matrix3x4::from_columns(&[
        axes.column(0).into_owned(),
        axes.column(1).into_owned(),
        axes.column(2).into_owned(),
        offset,
    ]))
}

fn check_agreement(s: &Matrix3x4<f64>, q: &Matrix3x4<f64>, dims: [usize; 3]) -> Result<(), String> {
    let voxel_mm = s
        .columns(0, 3)
        .column_iter()
        .map(|c| c.norm())
        .fold(f64::MAX, f64::min);
    for corner in 0..8 {
        let mut index = nalgebra::Vector4::new(0.0, 0.0, 0.0, 1.0);
        for axis in 0..3 {
            if corner >> axis & 1 == 1 {
                index[axis] = (dims[axis] - 1) as f64;
            }
        }
        let apart = ((s - q) * index).norm();
        if apart > MAX_DISAGREEMENT_VOXELS * voxel_mm {
            return Err(format!(
                "its sform and its qform place the same voxel {apart:.3} mm apart; set the code of \
                 the wrong one to 0"
            ));
        }
    }
    Ok(())
}

fn grid_from_ras(ras_from_index: &Matrix3x4<f64>, dims: [usize; 3]) -> Result<Grid, String> {
    let lps_from_ras = Matrix3::from_diagonal(&Vector::new(-1.0, -1.0, 1.0));
    grid_from_affine(&(lps_from_ras * ras_from_index), dims)
}

/// Writes a grid's place into both forms of a header, which then agree.
pub(super) fn set_grid(header: &mut NiftiHeader, grid: &Grid) {
    let ras_from_lps = Matrix3::from_diagonal(&Vector::new(-1.0, -1.0, 1.0));
    let axes = ras_from_lps * grid.direction;
    let origin = ras_from_lps * grid.origin.coords;
    let row = |r: usize| -> [f32; 4] {
        std::array::from_fn(|c| match c {
            3 => origin[r] as f32,
            _ => (axes[(r, c)] * grid.spacing[c]) as f32,
        })
    };
    (header.srow_x, header.srow_y, header.srow_z) = (row(0), row(1), row(2));
    header.sform_code = SCANNER_ANAT;

    let qfac = if axes.determinant() < 0.0 { -1.0 } else { 1.0 };
    let mut rotation = axes;
    rotation.column_mut(2).scale_mut(qfac);
    let mut q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation))
        .into_inner();
    // The header keeps three components and takes the fourth as positive.
    if q.w < 0.0 {
        q = -q;
    }
    (header.quatern_b, header.quatern_c, header.quatern_d) = (q.i as f32, q.j as f32, q.k as f32);
    header.quatern_x = origin.x as f32;
    header.quatern_y = origin.y as f32;
    header.quatern_z = origin.z as f32;
    header.pixdim = [1.0; 8];
    header.pixdim[0] = qfac as f32;
    for axis in 0..3 {
        header.pixdim[axis + 1] = grid.spacing[axis] as f32;
    }
    header.qform_code = SCANNER_ANAT;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    fn oblique(mirrored: bool) -> Grid {
        let mut direction = *Rotation3::from_euler_angles(0.3, -2.2, 0.9).matrix();
        if mirrored {
            direction.column_mut(2).neg_mut();
        }
        Grid {
            dims: [40, 50, 60],
            spacing: [0.7, 0.8, 2.5],
            origin: Point::new(-123.5, 77.25, 500.125),
            direction,
        }
    }

    fn corners_apart(a: &Grid, b: &Grid) -> f64 {
        let last = [a.dims[0] - 1, a.dims[1] - 1, a.dims[2] - 1];
        (a.center([0; 3]) - b.center([0; 3]))
            .norm()
            .max((a.center(last) - b.center(last)).norm())
    }

    #[test]
    fn each_form_alone_keeps_an_oblique_grid() {
        for mirrored in [false, true] {
            let grid = oblique(mirrored);
            for keep in ["sform", "qform"] {
                let mut header = NiftiHeader::default();
                set_grid(&mut header, &grid);
                if keep == "sform" {
                    header.qform_code = 0;
                } else {
                    header.sform_code = 0;
                    header.srow_x = [f32::NAN; 4];
                }
                let back = grid_of(&header, grid.dims).unwrap();
                let apart = corners_apart(&back, &grid);
                assert!(apart < 1e-4, "{keep}, mirrored {mirrored}: {apart} mm");
                let unit = back.direction.transpose() * back.direction;
                assert!((unit - Matrix3::identity()).norm() < 1e-14);
            }
        }
    }

    /// The identity in LPS is what other tools write as diag(-1, -1, 1).
    #[test]
    fn the_header_is_ras() {
        let grid = Grid::axis_aligned([3, 4, 5], 2.0, Point::new(10.0, 20.0, 30.0));
        let mut header = NiftiHeader::default();
        set_grid(&mut header, &grid);
        assert_eq!(header.srow_x, [-2.0, 0.0, 0.0, -10.0]);
        assert_eq!(header.srow_y, [0.0, -2.0, 0.0, -20.0]);
        assert_eq!(header.srow_z, [0.0, 0.0, 2.0, 30.0]);
        assert_eq!(grid_of(&header, grid.dims).unwrap(), grid);
    }

    #[test]
    fn what_has_no_place_or_two_is_refused() {
        let grid = oblique(false);
        let mut header = NiftiHeader::default();
        set_grid(&mut header, &grid);
        let refusal = |change: fn(&mut NiftiHeader)| {
            let mut changed = header.clone();
            change(&mut changed);
            grid_of(&changed, grid.dims).unwrap_err()
        };
        let neither = refusal(|h| (h.sform_code, h.qform_code) = (0, 0));
        assert!(neither.contains("neither"), "{neither}");
        let two = refusal(|h| h.quatern_x += 2.0);
        assert!(two.contains("apart"), "{two}");
        let nan = refusal(|h| (h.srow_y[1], h.qform_code) = (f32::NAN, 0));
        assert!(nan.contains("not finite"), "{nan}");
        let both_nan = refusal(|h| h.srow_y[1] = f32::NAN);
        assert!(both_nan.contains("not finite"), "{both_nan}");
        let sheared = refusal(|h| (h.srow_x[1], h.qform_code) = (0.3, 0));
        assert!(sheared.contains("right angles"), "{sheared}");
        let long = refusal(|h| (h.quatern_b, h.sform_code) = (1.5, 0));
        assert!(long.contains("longer than 1"), "{long}");
    }
}

//! A grid's place in the world, in a MetaImage header.

use super::header::Header;
use crate::volume::header_fields::HeaderFields;
use crate::volume::place::grid_from_affine;
use crate::volume::{Grid, VolumeFileError};
use nalgebra::{Matrix3, Matrix3x4, Vector3};

/// The grid (LPS) that a header describes. The format lets place and orientation be left out, and readers
/// then take LPS axes; a header that does so is refused, since its author may have meant any others.
pub(super) fn grid_of(header: &Header) -> Result<Grid, VolumeFileError> {
    let dims = header.dims()?;
    check_unit(&header.fields)?;
    let spacing: [f64; 3] = match header.fields.get("ElementSpacing") {
        Some(_) => header.fields.numbers("ElementSpacing")?,
        None if header.fields.get("ElementSize").is_some() => {
            header.fields.numbers("ElementSize")?
        }
        None => {
            return Err(header
                .fields
                .no_place("its header has no 'ElementSpacing'".into()));
        }
    };
    if spacing.iter().any(|&s| s < 0.0) {
        return Err(header.fields.no_place(format!(
            "its 'ElementSpacing' is {spacing:?}; expected positive lengths"
        )));
    }
    for (key, example) in [
        (
            "TransformMatrix",
            "1 0 0 0 1 0 0 0 1' if its axes are those of LPS",
        ),
        (
            "Offset",
            "0 0 0' with the LPS position of its first voxel's centre",
        ),
    ] {
        if header.fields.get(key).is_none() {
            return Err(header.fields.no_place(format!(
                "its header has no '{key}'; write '{key} = {example}"
            )));
        }
    }
    // The numbers of one axis' direction follow each other: columns, as nalgebra stores them.
    let direction = Matrix3::from_column_slice(&header.fields.numbers::<9>("TransformMatrix")?);
    let offset = Vector3::from(header.fields.numbers::<3>("Offset")?);
    let axes = direction * Matrix3::from_diagonal(&spacing.into());
    let columns = [0, 1, 2].map(|axis| axes.column(axis).into_owned());
    let lps_from_index = Matrix3x4::from_columns(&[columns[0], columns[1], columns[2], offset]);
    let grid = grid_from_affine(&lps_from_index, dims).map_err(|r| header.fields.no_place(r))?;
    if let Some(letters) = header.fields.get("AnatomicalOrientation")
        && contradicts(letters, &grid.direction)
    {
        tracing::warn!(
            "{} says AnatomicalOrientation = {letters} (where axes come from), which its TransformMatrix \
             contradicts; the matrix is followed",
            header.fields.path().display()
        );
    }
    Ok(grid)
}

fn check_unit(fields: &HeaderFields) -> Result<(), VolumeFileError> {
    match fields.get("DistanceUnits") {
        None | Some("mm" | "?" | "") => Ok(()),
        Some(unit) => Err(fields.unit("DistanceUnits", unit)),
    }
}

/// True when an axis does not go away from the side that its letter names. Other words than three such
/// letters (`???`) say nothing.
fn contradicts(letters: &str, direction: &Matrix3<f64>) -> bool {
    let from = |letter: char| match letter {
        'R' => Some(Vector3::x()),
        'L' => Some(-Vector3::x()),
        'A' => Some(Vector3::y()),
        'P' => Some(-Vector3::y()),
        'I' => Some(Vector3::z()),
        'S' => Some(-Vector3::z()),
        _ => None,
    };
    let axes: Option<Vec<Vector3<f64>>> = letters.chars().map(from).collect();
    match axes.as_deref() {
        Some([i, j, k]) => [i, j, k]
            .into_iter()
            .enumerate()
            .any(|(axis, named)| direction.column(axis).dot(named) < 0.1),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_name_where_axes_come_from() {
        let lps = Matrix3::identity();
        assert!(!contradicts("RAI", &lps));
        assert!(contradicts("LPS", &lps));
        assert!(contradicts("LAI", &lps));
        assert!(!contradicts("???", &lps));
        let ras = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
        assert!(!contradicts("LPI", &ras));
        let turned = nalgebra::Rotation3::from_euler_angles(0.4, 0.3, -0.5);
        assert!(!contradicts("RAI", turned.matrix()));
    }
}

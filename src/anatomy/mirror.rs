//! The mirror image of a specimen, for the test that left and right are treated alike.

use super::{Label, Landmarks, Rim, Side, Specimen};
use crate::geometry::Point;
use crate::volume::{Grid, Volume};
use nalgebra::Matrix3;

/// The exact mirror image of a specimen through x -> -x of its world: voxels, labels (left femur
/// becomes right), landmarks (left become right) and rims. It is named `<name>-mirrored`.
pub fn mirror(specimen: &Specimen) -> Specimen {
    let mut landmarks = Landmarks::default();
    for (landmark, side, point) in specimen.landmarks.iter() {
        let from = specimen.landmarks.provenance(landmark, side);
        let point = reflected(&point);
        landmarks.set_with(landmark, side.opposite(), point, from.unwrap_or_default());
    }
    let rim = |side: Side| {
        let points = specimen.rim(side).iter().map(reflected).collect();
        Rim::new(points, specimen.rims[side.index()].provenance)
    };
    Specimen {
        name: format!("{}-mirrored", specimen.name),
        source: specimen.source.clone(),
        ct: mirrored_volume(&specimen.ct, |hu| hu),
        labels: mirrored_volume(&specimen.labels, other_side),
        landmarks,
        rims: Side::BOTH.map(|side| rim(side.opposite())),
    }
}

fn reflected(p: &Point) -> Point {
    Point::new(-p.x, p.y, p.z)
}

fn other_side(label: u8) -> u8 {
    let (left, right) = (Label::FemurLeft.value(), Label::FemurRight.value());
    match label {
        l if l == left => right,
        l if l == right => left,
        l => l,
    }
}

/// The voxels read backwards along i. The last voxel of each row becomes the first, so that the
/// grid's axes stay right-handed.
fn mirrored_volume<T: Copy>(volume: &Volume<T>, value: impl Fn(T) -> T) -> Volume<T> {
    let grid = &volume.grid;
    let through = Matrix3::from_diagonal(&nalgebra::Vector3::new(-1.0, 1.0, 1.0));
    let data = volume
        .data
        .chunks(grid.dims[0])
        .flat_map(|row| row.iter().rev())
        .map(|&v| value(v))
        .collect();
    let mirrored = Grid {
        origin: reflected(&grid.center([grid.dims[0] - 1, 0, 0])),
        direction: through * grid.direction * through,
        ..grid.clone()
    };
    Volume::new(mirrored, data)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::anatomy::{Landmark, Source};

    fn small() -> Specimen {
        let grid = Grid {
            dims: [4, 3, 2],
            spacing: [0.5, 1.0, 2.0],
            origin: Point::new(-7.25, 3.0, 11.5),
            direction: *nalgebra::Rotation3::from_euler_angles(0.1, 0.2, 0.3).matrix(),
        };
        let mut landmarks = Landmarks::default();
        landmarks.set(Landmark::Asis, Side::Left, Point::new(5.0, 1.0, 2.0));
        let rim = vec![Point::new(3.0, 4.0, 5.0), Point::new(4.0, 4.0, 5.0)];
        Specimen {
            name: "small".to_owned(),
            source: Source {
                kind: "test".to_owned(),
                description: String::new(),
                licence: "none".to_owned(),
                sex: "unknown".to_owned(),
                assigned_density: true,
            },
            ct: Volume::new(grid.clone(), (0..24).collect()),
            labels: Volume::new(grid, (0..24).map(|i| i % 4).collect()),
            landmarks,
            rims: [rim.into(), Rim::default()],
        }
    }

    #[test]
    fn every_voxel_lies_at_its_mirror_image() {
        let before = small();
        let after = mirror(&before);
        assert!(after.ct.grid.direction.determinant() > 0.0);
        for offset in 0..before.ct.grid.len() {
            let p = before.ct.grid.center(before.ct.grid.voxel(offset));
            let q = reflected(&p);
            let voxel = after.ct.grid.nearest(&q).unwrap();
            assert!((after.ct.grid.center(voxel) - q).norm() < 1e-12);
            assert_eq!(after.ct.nearest(&q), before.ct.nearest(&p));
            let label = before.labels.nearest(&p).unwrap();
            assert_eq!(after.labels.nearest(&q), Some([0, 1, 3, 2][label as usize]));
        }
        let asis = after.landmarks.get(Landmark::Asis, Side::Right);
        assert_eq!(asis, Some(Point::new(-5.0, 1.0, 2.0)));
        assert!(after.rim(Side::Left).is_empty());
        assert_eq!(after.rim(Side::Right)[1], Point::new(-4.0, 4.0, 5.0));
    }
}

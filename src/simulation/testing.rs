//! A small symmetric specimen for tests.

use crate::anatomy::{Hip, Landmark, Landmarks, Side, Source, Specimen};
use crate::geometry::Point;
use crate::volume::{Grid, Volume};
use std::sync::Arc;

/// The landmarks of an upright pelvis that is its own mirror image in the world's x (LPS: x left,
/// y posterior, z superior), at plausible places.
pub fn landmarks() -> Landmarks {
    let mut l = Landmarks::default();
    for side in Side::BOTH {
        let s = side.lateral_sign();
        l.set(Landmark::Asis, side, Point::new(120.0 * s, -60.0, 80.0));
        l.set(Landmark::Ips, side, Point::new(5.0 * s, -60.0, -40.0));
        l.set(Landmark::Fh, side, Point::new(88.0 * s, -10.0, 0.0));
        l.set(Landmark::Mof, side, Point::new(38.0 * s, -35.0, -38.0));
    }
    l
}

/// A hip with the given volumes and [`landmarks`].
pub fn hip_with(side: Side, ct: Volume<i16>, labels: Volume<u8>) -> Hip {
    let specimen = Specimen {
        name: "test".into(),
        source: Source {
            kind: "test".into(),
            description: String::new(),
            licence: "none".into(),
            sex: "unknown".into(),
            assigned_density: true,
        },
        ct,
        labels,
        landmarks: landmarks(),
        rims: Default::default(),
    };
    Hip::new(Arc::new(specimen), side).expect("the landmarks are there")
}

/// A hip of one voxel of air, where only landmarks matter.
pub fn hip(side: Side) -> Hip {
    let grid = Grid::axis_aligned([1; 3], 1.0, Point::origin());
    hip_with(
        side,
        Volume::filled(grid.clone(), -1000),
        Volume::filled(grid, 0),
    )
}

//! A hip made of balls and blocks for tests, its own mirror image.

use crate::anatomy::{Hip, Label, Landmark, Landmarks, Side, Source, Specimen};
use crate::geometry::Point;
use crate::volume::{Grid, Volume};
use std::sync::Arc;

/// Edge of a voxel in mm.
const VOXEL_MM: f64 = 1.5;
/// The head's centre in the world lies this far from the mid-sagittal plane.
const HEAD_LATERAL_MM: f64 = 85.0;

/// A hip whose labels are given by `label(u, y, z)` in its APP, with u lateral instead of x, within
/// 85 mm of the head's centre across and from 100 mm below it to 140 mm above. The APP's axes are
/// the world's: x left, y superior (world z), z anterior (world -y).
pub(crate) fn hip_of(side: Side, label: impl Fn(f64, f64, f64) -> Label) -> Hip {
    let s = side.lateral_sign();
    let head = Point::new(s * HEAD_LATERAL_MM, 0.0, 0.0);
    let mut landmarks = Landmarks::default();
    for either in Side::BOTH {
        let t = either.lateral_sign();
        landmarks.set(
            Landmark::Fh,
            either,
            Point::new(t * HEAD_LATERAL_MM, 0.0, 0.0),
        );
        landmarks.set(Landmark::Asis, either, Point::new(t * 120.0, -60.0, 80.0));
        landmarks.set(Landmark::Ips, either, Point::new(t * 5.0, -60.0, -40.0));
    }
    // The grid reaches as far laterally as medially, so that it mirrors onto itself.
    let n = [113, 113, 161];
    let half = |n: usize| (n as f64 - 1.0) / 2.0 * VOXEL_MM;
    let origin = Point::new(head.x - half(n[0]), head.y - half(n[1]), -100.0);
    let grid = Grid::axis_aligned(n, VOXEL_MM, origin);
    let data = (0..grid.len())
        .map(|offset| {
            let p = grid.center(grid.voxel(offset)) - head;
            label(s * p.x, p.z, -p.y).value()
        })
        .collect();
    let labels = Volume::new(grid, data);
    let specimen = Specimen {
        name: "toy".into(),
        source: Source {
            kind: "test".into(),
            description: String::new(),
            licence: "none".into(),
            sex: "unknown".into(),
            assigned_density: true,
        },
        ct: labels.map(i16::from),
        labels,
        landmarks,
        rims: Default::default(),
    };
    Hip::new(Arc::new(specimen), side).expect("the landmarks are there")
}

/// A surgery already done: the fragment is the upper half of a shell of 27 to 45 mm radius around
/// the head, the femur a ball of 24 mm with a slanted neck, and the pelvis the medial lower half of
/// the shell with a wing above the fragment, 2 mm from it, 24 mm thick, that rises to 120 mm.
pub(crate) fn toy_hip(side: Side) -> Hip {
    hip_of(side, |u, y, z| {
        let r = (u * u + y * y + z * z).sqrt();
        let along = (u - y) / 2.0f64.sqrt();
        if r <= 24.0 || (along > 0.0 && along < 70.0 && r * r - along * along < 120.0) {
            Label::femur(side)
        } else if (27.0..=45.0).contains(&r) && y > 2.0 {
            Label::Fragment
        } else if ((27.0..=45.0).contains(&r) && y < 0.0 && u < 0.0)
            || (u.abs() < 12.0 && z.abs() < 60.0 && (47.0..=120.0).contains(&y))
        {
            Label::Pelvis
        } else {
            Label::Background
        }
    })
}

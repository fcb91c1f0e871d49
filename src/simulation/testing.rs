//! Small specimens for tests.

use crate::anatomy::{Hip, Label, Landmark, Landmarks, Side, Source, Specimen};
use crate::geometry::{Plane, Point, Vector};
use crate::surgery::CutPlanes;
use crate::volume::{Grid, Surface, SurfaceParameters, Volume};
use std::sync::{Arc, OnceLock};

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
        l.set(Landmark::Gsn, side, Point::new(70.0 * s, 48.0, 25.0));
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

/// [`toy_hip`] of a side with the surface of its pelvis, made once for all tests.
pub fn toy(side: Side) -> &'static (Hip, Surface) {
    static TOYS: [OnceLock<(Hip, Surface)>; 2] = [const { OnceLock::new() }; 2];
    TOYS[side.index()].get_or_init(|| {
        let hip = toy_hip(side);
        let pelvis = Surface::from_mask(
            &hip.specimen.labels,
            |l| l == Label::Pelvis.value(),
            &SurfaceParameters::default(),
        );
        (hip, pelvis)
    })
}

/// A hip with a pelvis of simple shapes: half a shell around the head, a plate above it (ilium) that
/// is curved, bars to the midline (pubis), down (ischium) and back and up (posterior column). Given by
/// a rule on APP coordinates with x lateral, so the two sides are mirror images. Voxels of 1 mm.
fn toy_hip(side: Side) -> Hip {
    let marks = landmarks();
    let head = marks.get(Landmark::Fh, side).expect("set above");
    let app = crate::anatomy::frame::app_from_volume(&marks, &head).expect("not degenerate");
    let s = side.lateral_sign();
    let low = if side == Side::Left { -25.0 } else { -145.0 };
    let grid = Grid::axis_aligned([171, 141, 231], 1.0, Point::new(low, -100.0, -100.0));
    let labels = (0..grid.len())
        .map(|offset| {
            let p = app * grid.center(grid.voxel(offset));
            toy_label(&Point::new(p.x * s, p.y, p.z), side)
        })
        .collect();
    let labels = Volume::new(grid.clone(), labels);
    let ct = labels.map(|label| if label == 0 { 40 } else { 600 });
    let mut hip = hip_with(side, ct, labels);
    let mut specimen = (*hip.specimen).clone();
    let volume_from_app = app.inverse();
    specimen.rims[side.index()] = (0..72)
        .map(|n| {
            let (sin, cos) = f64::from(n * 5).to_radians().sin_cos();
            volume_from_app * Point::new(5.0 * s, 29.0 * sin, 29.0 * cos)
        })
        .collect();
    hip.specimen = Arc::new(specimen);
    hip
}

/// The label at a place of the APP, x positive laterally.
fn toy_label(p: &Point, side: Side) -> u8 {
    let r = p.coords.norm();
    if r < 24.0 {
        return Label::femur(side).value();
    }
    let shell = (26.0..34.0).contains(&r) && p.x < 5.0;
    let outside = r > 27.0;
    let wing = p.y > 15.0 && p.y < 110.0 && (-60.0..40.0).contains(&p.z) && {
        let middle = -10.0 + 0.004 * p.z * p.z;
        (p.x - middle).abs() < 6.0
    };
    let pubis = (-88.0..-20.0).contains(&p.x) && {
        let (dy, dz) = (p.y + 8.0 - 0.1 * p.x, p.z - 20.0);
        dy.hypot(dz) < 8.0
    };
    let ischium = (-90.0..-15.0).contains(&p.y) && (p.x + 8.0).hypot(p.z + 18.0) < 12.0;
    let column = (-60.0..30.0).contains(&p.y) && (p.x + 12.0).hypot(p.z + 45.0) < 14.0;
    u8::from(shell || outside && (wing || pubis || ischium || column))
}

/// Cuts of [`toy_hip`]: one through each bar and the plate.
pub fn toy_cuts(side: Side) -> CutPlanes {
    let s = side.lateral_sign();
    let plane = |point: [f64; 3], normal: [f64; 3]| {
        Plane::through(
            &Point::new(point[0] * s, point[1], point[2]),
            &Vector::new(normal[0] * s, normal[1], normal[2]),
        )
    };
    CutPlanes::new([
        plane([0.0, 45.0, 0.0], [0.15, 1.0, 0.1]),
        plane([0.0, -45.0, 0.0], [0.0, -1.0, 0.1]),
        plane([0.0, 0.0, -40.0], [0.0, 0.1, -1.0]),
        plane([-45.0, 0.0, 0.0], [-1.0, 0.2, 0.15]),
    ])
}

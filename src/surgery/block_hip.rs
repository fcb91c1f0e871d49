//! A whole pelvis half made of blocks for tests, its own mirror image.

use super::toy_hip::hip_of;
use crate::anatomy::{Hip, Label, Landmark, Side};
use crate::geometry::Point;
use std::sync::Arc;

/// Inner and outer radius in mm of the shell that is the acetabulum, and how far lateral of the
/// head's centre it ends.
pub(crate) const SHELL_MM: [f64; 2] = [27.0, 33.0];
pub(crate) const SHELL_END_MM: f64 = 8.0;
/// z of the posterior border between notch and ischium.
pub(crate) const BORDER_MM: f64 = -50.0;
/// Radius and lateral position of the rim's circle: the middle of the shell's edge.
pub(crate) fn rim_circle() -> (f64, f64) {
    let middle = 0.5 * (SHELL_MM[0] + SHELL_MM[1]);
    (
        (middle * middle - SHELL_END_MM * SHELL_END_MM).sqrt(),
        SHELL_END_MM,
    )
}

/// Voxel size (mm) of the map.
pub(crate) const VOXEL_MM: f64 = 1.5;

/// A label of the block hip at (lateral, superior, anterior) mm from the head's centre.
fn label(side: Side, u: f64, y: f64, z: f64) -> Label {
    let r = (u * u + y * y + z * z).sqrt();
    let within = |v: f64, low: f64, high: f64| (low..=high).contains(&v);
    let shell = within(r, SHELL_MM[0], SHELL_MM[1]) && u <= SHELL_END_MM;
    let outside_ball = r >= SHELL_MM[0];
    // The wing's border steps back above the notch.
    let wing = within(u, -16.0, 8.0)
        && within(y, 22.0, 120.0)
        && within(z, if y > 40.0 { -80.0 } else { BORDER_MM }, 25.0);
    let column = within(u, -30.0, 4.0) && within(y, -75.0, 40.0) && within(z, BORDER_MM, -16.0);
    let ramus = within(u, -85.0, -20.0) && within(y, -5.0, 12.0) && within(z, 10.0, 27.0);
    let lower_ramus = within(u, -85.0, -20.0) && within(y, -75.0, -60.0) && within(z, -30.0, 27.0);
    let symphysis = within(u, -85.0, -70.0) && within(y, -75.0, 12.0) && within(z, 10.0, 27.0);
    if r < 24.0 {
        Label::femur(side)
    } else if shell || outside_ball && (wing || column || ramus || lower_ramus || symphysis) {
        Label::Pelvis
    } else {
        Label::Background
    }
}

/// Landmarks of the own side at (lateral, superior, anterior) mm from the head's centre.
pub(crate) const LANDMARKS: [(Landmark, [f64; 3]); 7] = [
    (Landmark::Asis, [30.0, 85.0, 25.0]),
    (Landmark::Aiis, [5.0, 45.0, 25.0]),
    (Landmark::Sps, [-80.0, 12.0, 25.0]),
    (Landmark::Ips, [-80.0, -60.0, 25.0]),
    (Landmark::Mof, [-70.0, -20.0, 20.0]),
    (Landmark::Iof, [-45.0, -58.0, 0.0]),
    (Landmark::Gsn, [-15.0, 38.0, BORDER_MM]),
];

/// A shell around the head with an iliac wing, a posterior column down to the ischium, both pubic
/// rami and the symphysis, 1.5 mm voxels. Its APP's axes are the world's (x left, y = world z,
/// z = - world y).
pub(crate) fn block_hip(side: Side) -> Hip {
    block_hip_without(side, |_, _, _| false)
}

/// As [`block_hip`], less the bone where `gap` is true.
pub(crate) fn block_hip_without(side: Side, gap: impl Fn(f64, f64, f64) -> bool) -> Hip {
    let body = hip_of(side, |u, y, z| match label(side, u, y, z) {
        Label::Pelvis if gap(u, y, z) => Label::Background,
        other => other,
    });
    let mut specimen = (*body.specimen).clone();
    let head = body.head();
    for either in Side::BOTH {
        // The head of the other side is the mirror image about the world's x = 0.
        let x = head.x.abs() * either.lateral_sign();
        let at = |[u, y, z]: [f64; 3]| Point::new(x + u * either.lateral_sign(), -z, y);
        for (landmark, place) in LANDMARKS {
            specimen.landmarks.set(landmark, either, at(place));
        }
        let (radius, u) = rim_circle();
        specimen.rims[either.index()] = (0..72)
            .map(|n| {
                let (sin, cos) = (f64::from(n) * 5.0_f64).to_radians().sin_cos();
                at([u, radius * cos, radius * sin])
            })
            .collect();
    }
    Hip::new(Arc::new(specimen), side).expect("the landmarks are there")
}

//! Bones made of closed forms, about as large and as dense as real ones.

use pao_sim::geometry::{Point, Rigid, Vector};
use pao_sim::volume::{Grid, Volume};
use pao_sim::xray::BoneVolume;

/// Distance of a point from the segment a-b.
fn segment(p: Vector, a: [f64; 3], b: [f64; 3]) -> f64 {
    let (a, b) = (Vector::from(a), Vector::from(b));
    let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
    (p - a - (b - a) * t).norm()
}

/// Signed depth inside pelvis-like bone at a point in mm (x left, y posterior, z superior; origin
/// between the heads), negative outside: wings, sacrum, acetabular blocks and rami of about the
/// size of a man's.
pub fn pelvis_depth(p: Vector) -> f64 {
    let q = Vector::new(p.x.abs(), p.y, p.z);
    let wing_center = Vector::new(40.0, 10.0, 70.0);
    let r = (q - wing_center).component_div(&Vector::new(95.0, 85.0, 95.0));
    let shell = 5.0 - (r.norm() - 1.0).abs() * 90.0;
    let wing = shell
        .min(q.z - 20.0)
        .min(135.0 - q.z)
        .min(q.x - 45.0)
        .min(60.0 - q.y * 0.6);
    let sacrum_r = (q - Vector::new(0.0, 75.0, 55.0)).component_div(&Vector::new(52.0, 24.0, 52.0));
    let sacrum = (1.0 - sacrum_r.norm()) * 24.0;
    let joint = 13.0 - segment(q, [45.0, 70.0, 75.0], [72.0, 62.0, 85.0]);
    let column = 16.0 - segment(q, [85.0, 15.0, 10.0], [90.0, 30.0, 45.0]);
    let cup = (34.0 - (q - Vector::new(92.0, 0.0, 0.0)).norm())
        .min((q - Vector::new(95.0, 0.0, 0.0)).norm() - 26.0)
        .min(100.0 - q.x - 0.3 * q.z.abs());
    let pubis = 7.5 - segment(q, [70.0, -10.0, 5.0], [6.0, -38.0, -20.0]);
    let ramus = 6.5 - segment(q, [10.0, -38.0, -30.0], [55.0, 18.0, -70.0]);
    let ischium = 14.0 - segment(q, [72.0, 22.0, -10.0], [60.0, 25.0, -70.0]);
    [wing, sacrum, joint, column, cup, pubis, ramus, ischium]
        .into_iter()
        .fold(f64::NEG_INFINITY, f64::max)
}

/// Signed depth inside the left femur.
pub fn femur_depth(p: Vector) -> f64 {
    let head = 24.0 - (p - Vector::new(92.0, 0.0, 0.0)).norm();
    let neck = 14.0 - segment(p, [92.0, 0.0, 0.0], [128.0, 8.0, -25.0]);
    let trochanter = 19.0 - segment(p, [132.0, 12.0, -15.0], [128.0, 12.0, -55.0]);
    let shaft = 15.0 - segment(p, [128.0, 10.0, -50.0], [122.0, 5.0, -165.0]);
    [head, neck, trochanter, shaft.min(p.z + 150.0)]
        .into_iter()
        .fold(f64::NEG_INFINITY, f64::max)
}

/// A cheap hash in 0..1 for the texture of trabecular bone.
fn speckle(at: usize) -> f32 {
    let mut x = at as u64 ^ 0x9e37_79b9_7f4a_7c15;
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 40) as f32 / (1u64 << 24) as f32
}

/// A bone of 1 mm voxels: cortex of 2 mm, trabecular bone inside.
pub fn bone(depth: impl Fn(Vector) -> f64) -> BoneVolume {
    let grid = Grid::axis_aligned([320, 260, 320], 1.0, Point::new(-160.0, -120.0, -160.0));
    let mut volume = Volume::filled(grid.clone(), 0.0f32);
    for (at, value) in volume.data.iter_mut().enumerate() {
        let d = depth(grid.center(grid.voxel(at)).coords);
        if d >= 0.0 {
            *value = if d < 2.0 {
                0.03
            } else {
                0.008 + 0.006 * speckle(at)
            };
        }
    }
    BoneVolume::from_attenuation(&volume).expect("the shapes lie in the grid")
}

/// Head first supine AP with the detector anterior, the origin at 80 % of the source-detector
/// distance and off the centre as in view 1, turned by `orbit` and tilted by `tilt` degrees.
pub fn pose(orbit_deg: f64, tilt_deg: f64) -> Rigid {
    // Columns of camera_from_volume: x stays, y (posterior) becomes +z, z (superior) becomes -y.
    let ap =
        nalgebra::UnitQuaternion::from_axis_angle(&Vector::x_axis(), std::f64::consts::FRAC_PI_2);
    let orbit =
        nalgebra::UnitQuaternion::from_axis_angle(&Vector::y_axis(), orbit_deg.to_radians());
    let tilt = nalgebra::UnitQuaternion::from_axis_angle(&Vector::x_axis(), tilt_deg.to_radians());
    let rotation = tilt * orbit * ap;
    let target = Vector::new(0.0, 0.0, -816.0);
    let center = rotation * Vector::new(67.0, 0.0, 35.0);
    Rigid::from_parts((target - center).into(), rotation)
}

/// Pelvis, femur and fragment with their names.
pub fn bones() -> [(&'static str, BoneVolume); 3] {
    let center = Vector::new(88.0, 5.0, 8.0);
    [
        ("pelvis", bone(pelvis_depth)),
        ("femur", bone(femur_depth)),
        (
            "fragment",
            bone(|p| pelvis_depth(p).min(38.0 - (p - center).amax())),
        ),
    ]
}

//! The fast caster against the plain one, on rays of every kind and at every vector level.

use super::{BoneVolume, Camera, PixelRect, SimdLevel, reference};
use crate::geometry::{Pixel, Point, Rigid, Vector};

use crate::volume::{Grid, Volume};
use nalgebra::UnitQuaternion;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A small detector with the CIOS Fusion's field of view, its principal point off the centre.
pub(super) fn small_camera() -> Camera {
    let mut camera = Camera::centered(47, 6.2, 1020.0);
    camera.height = 39;
    camera.principal = Pixel::new(21.7, 20.2);
    camera
}

/// An oblique grid with three different spacings.
pub(super) fn oblique_grid(dims: [usize; 3]) -> Grid {
    Grid {
        dims,
        spacing: [0.9, 1.3, 2.1],
        origin: Point::new(-33.0, 18.0, 71.0),
        direction: *nalgebra::Rotation3::from_euler_angles(0.4, -0.7, 2.3).matrix(),
    }
}

/// Blobs of noise in a void: 10 to 20 % of the voxels, as in a pelvis.
pub(super) fn blobs(grid: Grid, seed: u64) -> Volume<f32> {
    let mut draw = ChaCha8Rng::seed_from_u64(seed);
    let balls: Vec<(Vector, f64)> = (0..4)
        .map(|_| {
            let center = Vector::from_fn(|a, _| draw.random::<f64>() * grid.dims[a] as f64);
            (center, 2.0 + 7.0 * draw.random::<f64>())
        })
        .collect();
    let mut volume = Volume::filled(grid, 0.0f32);
    for offset in 0..volume.data.len() {
        let at = Vector::from(volume.grid.voxel(offset).map(|i| i as f64));
        if balls.iter().any(|(c, r)| (at - c).norm() < *r) {
            volume.data[offset] = 0.01 + 0.05 * draw.random::<f32>();
        }
    }
    volume
}

/// The pose that shows a grid's centre `depth` mm from the source, turned by Euler angles.
pub(super) fn pose(grid: &Grid, depth: f64, angles: [f64; 3]) -> Rigid {
    let center = grid.point(
        (grid.dims[0] as f64 - 1.0) / 2.0,
        (grid.dims[1] as f64 - 1.0) / 2.0,
        (grid.dims[2] as f64 - 1.0) / 2.0,
    );
    let rotation = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
    let target = Vector::new(3.0, -2.0, -depth);
    Rigid::from_parts((target - rotation * center.coords).into(), rotation)
}

fn full_image(bone: &BoneVolume, camera: &Camera, pose: &Rigid, step_mm: f64) -> Vec<f32> {
    let mut out = vec![0.0; camera.width * camera.height];
    bone.project_add(camera, pose, step_mm, PixelRect::full(camera), &mut out);
    out
}

#[test]
fn every_level_agrees_with_the_plain_caster() {
    let camera = small_camera();
    // 16-bit voxels and weights cost 1e-5 of the image's maximum at most.
    const TOLERANCE: f64 = 1e-5;
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut poses: Vec<(f64, [f64; 3])> = vec![
        // Along each axis of the grid, from both ends.
        (800.0, [0.0, 0.0, 0.0]),
        (800.0, [quarter, 0.0, 0.0]),
        (800.0, [0.0, quarter, 0.0]),
        (800.0, [0.0, -quarter, quarter]),
        (800.0, [2.0 * quarter, 0.0, 0.0]),
        // Diagonals.
        (800.0, [quarter / 2.0, 0.6154797, 0.0]),
        // The source inside the volume, beside it, and behind; the volume across the detector.
        (0.0, [0.3, 0.2, 0.1]),
        (20.0, [0.3, 0.2, 0.1]),
        (-300.0, [0.3, 0.2, 0.1]),
        (1015.0, [0.3, -0.2, 0.1]),
    ];
    let mut draw = ChaCha8Rng::seed_from_u64(11);
    for _ in 0..8 {
        poses.push((
            400.0 + 500.0 * draw.random::<f64>(),
            std::array::from_fn(|_| 6.3 * draw.random::<f64>()),
        ));
    }
    let grids = [
        oblique_grid([38, 29, 31]),
        Grid::axis_aligned([33, 40, 27], 1.0, Point::new(5.0, 6.0, 7.0)),
    ];
    for (number, grid) in grids.into_iter().enumerate() {
        let volume = blobs(grid, number as u64);
        let bone = BoneVolume::from_attenuation(&volume).unwrap();
        let densest = f64::from(volume.data.iter().fold(0.0f32, |a, &b| a.max(b)));
        let bones: Vec<_> = SimdLevel::available()
            .map(|level| (level, bone.clone().with_simd(level)))
            .collect();
        for &(depth, angles) in &poses {
            let pose = pose(&volume.grid, depth, angles);
            for step_mm in [1.0, 0.73] {
                let plain = reference::line_integrals(bone.attenuation(), &camera, &pose, step_mm);
                // Of the image's maximum, or where it shows less of 20 mm of the densest bone: the
                // rounding of a single sample's weights does not average out.
                let largest = plain.data.iter().fold(20.0 * densest, |a, &b| a.max(b));
                for (level, bone) in &bones {
                    let fast = full_image(bone, &camera, &pose, step_mm);
                    let worst = fast
                        .iter()
                        .zip(&plain.data)
                        .fold(0.0f64, |a, (&f, &p)| a.max((f64::from(f) - p).abs()));
                    assert!(
                        worst <= TOLERANCE * largest,
                        "{} grid {number} depth {depth} angles {angles:?} step {step_mm}: \
                         {worst:.2e} of {largest}",
                        level.name()
                    );
                }
            }
        }
    }
}

#[test]
fn a_pixel_does_not_depend_on_the_rectangle() {
    let camera = small_camera();
    let volume = blobs(oblique_grid([38, 29, 31]), 3);
    let pose = pose(&volume.grid, 800.0, [0.3, 0.7, -0.2]);
    for level in SimdLevel::available() {
        let bone = BoneVolume::from_attenuation(&volume)
            .unwrap()
            .with_simd(level);
        let whole = full_image(&bone, &camera, &pose, 1.0);
        let rect = PixelRect {
            x0: 13,
            y0: 11,
            x1: 30,
            y1: 22,
        };
        let mut part = vec![0.5f32; whole.len()];
        bone.project_add(&camera, &pose, 1.0, rect, &mut part);
        for y in 0..camera.height {
            for x in 0..camera.width {
                let at = y * camera.width + x;
                let inside = (rect.x0..rect.x1).contains(&x) && (rect.y0..rect.y1).contains(&y);
                let expected = if inside { 0.5 + whole[at] } else { 0.5 };
                assert_eq!(part[at], expected, "{} ({x}, {y})", level.name());
            }
        }
    }
}

#[test]
fn the_footprint_holds_the_shadow_and_little_more() {
    let camera = small_camera();
    let mut draw = ChaCha8Rng::seed_from_u64(5);
    for number in 0..20 {
        let volume = blobs(oblique_grid([38, 29, 31]), 100 + number);
        let bone = BoneVolume::from_attenuation(&volume).unwrap();
        let angles = std::array::from_fn(|_| 6.3 * draw.random::<f64>());
        let shift = Rigid::translation(
            150.0 * (draw.random::<f64>() - 0.5),
            150.0 * (draw.random::<f64>() - 0.5),
            0.0,
        );
        let pose = shift * pose(&volume.grid, 700.0, angles);
        let image = full_image(&bone, &camera, &pose, 1.0);
        let (mut min, mut max) = ([usize::MAX; 2], [0; 2]);
        for (at, _) in image.iter().enumerate().filter(|&(_, &v)| v != 0.0) {
            let pixel = [at % camera.width, at / camera.width];
            for a in 0..2 {
                min[a] = min[a].min(pixel[a]);
                max[a] = max[a].max(pixel[a]);
            }
        }
        let Some(rect) = bone.footprint(&camera, &pose) else {
            assert_eq!(min[0], usize::MAX, "a shadow without a footprint");
            continue;
        };
        if min[0] == usize::MAX {
            continue;
        }
        assert!(rect.x0 <= min[0] && rect.y0 <= min[1], "{rect:?} {min:?}");
        assert!(rect.x1 > max[0] && rect.y1 > max[1], "{rect:?} {max:?}");
        let loose = (min[0] - rect.x0)
            .max(min[1] - rect.y0)
            .max(rect.x1 - 1 - max[0])
            .max(rect.y1 - 1 - max[1]);
        assert!(loose <= 4, "{rect:?} is loose about {min:?} to {max:?}");
    }
    let volume = blobs(oblique_grid([38, 29, 31]), 3);
    let bone = BoneVolume::from_attenuation(&volume).unwrap();
    let behind = pose(&volume.grid, -500.0, [0.0; 3]);
    assert_eq!(bone.footprint(&camera, &behind), None);
    let around = pose(&volume.grid, 0.0, [0.0; 3]);
    assert_eq!(
        bone.footprint(&camera, &around),
        Some(PixelRect::full(&camera))
    );
}

#[test]
fn two_parts_at_rest_project_as_the_whole() {
    let camera = small_camera();
    let volume = blobs(Grid::axis_aligned([40, 40, 40], 1.0, Point::origin()), 8);
    let part = |keep_low: bool| {
        let mut part = volume.clone();
        for offset in 0..part.data.len() {
            let [i, j, _] = part.grid.voxel(offset);
            if (i + j < 40) != keep_low {
                part.data[offset] = 0.0;
            }
        }
        BoneVolume::from_attenuation(&part).unwrap()
    };
    let pose = pose(&volume.grid, 800.0, [0.2, 0.1, 0.4]);
    let whole = full_image(
        &BoneVolume::from_attenuation(&volume).unwrap(),
        &camera,
        &pose,
        1.0,
    );
    let mut sum = full_image(&part(true), &camera, &pose, 1.0);
    part(false).project_add(&camera, &pose, 1.0, PixelRect::full(&camera), &mut sum);
    let largest = whole.iter().fold(0.0f32, |a, &b| a.max(b));
    for (s, w) in sum.iter().zip(&whole) {
        assert!((s - w).abs() < 2e-5 * largest, "{s} {w} of {largest}");
    }
}

//! Slice resampling against its own rule written down plainly, at every vector level.

use super::projection_tests::{blobs, oblique_grid, pose, small_camera};
use super::rays::IndexRays;
use super::slice::Lattice;
use super::{
    BoneVolume, Camera, PixelRect, ProjectorParameters, SimdLevel, SliceResampling, reference,
};
use crate::geometry::{Pixel, Point, Rigid, Vector};
use crate::volume::{Grid, Volume};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::FRAC_PI_2;

const PARAMETERS: ProjectorParameters = ProjectorParameters::Slice { pitch_px: 1.0 };

/// Images of poses, one after the other, and what was touched of each.
fn images(
    by: ProjectorParameters,
    bone: &BoneVolume,
    camera: &Camera,
    poses: &[Rigid],
    axis: Option<usize>,
) -> (Vec<f32>, Vec<PixelRect>) {
    let mut images = vec![0.0; poses.len() * camera.width * camera.height];
    let mut touched = vec![PixelRect::EMPTY; poses.len()];
    by.projector()
        .project_add(bone, camera, poses, axis, &mut images, &mut touched);
    (images, touched)
}

/// Along and across the axes, and in between: with a roll, half way between two and three axes.
fn poses(grid: &Grid) -> Vec<Rigid> {
    let mut draw = ChaCha8Rng::seed_from_u64(31);
    let mut poses: Vec<Rigid> = [
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 0.8],
        [FRAC_PI_2, 0.0, 0.0],
        [0.0, FRAC_PI_2, 0.0],
        [0.0, -FRAC_PI_2, FRAC_PI_2],
        [2.0 * FRAC_PI_2, 0.0, 0.0],
        [FRAC_PI_2 / 2.0, 0.0, 0.3],
        [FRAC_PI_2 / 2.0, 0.6154797, 0.0],
    ]
    .map(|angles| pose(grid, 800.0, angles))
    .to_vec();
    for _ in 0..8 {
        let angles = std::array::from_fn(|_| 6.3 * draw.random::<f64>());
        let shift = std::array::from_fn(|_| 120.0 * (draw.random::<f64>() - 0.5));
        let depth = 400.0 + 500.0 * draw.random::<f64>();
        let [x, y, _]: [f64; 3] = shift;
        poses.push(Rigid::translation(x, y, 0.0) * pose(grid, depth, angles));
    }
    poses
}

fn bones() -> Vec<BoneVolume> {
    let grids = [
        oblique_grid([38, 29, 31]),
        Grid::axis_aligned([33, 70, 27], 1.0, Point::new(5.0, 6.0, 7.0)),
    ];
    let volumes = grids
        .into_iter()
        .enumerate()
        .map(|(n, grid)| blobs(grid, n as u64));
    volumes
        .map(|volume| BoneVolume::from_attenuation(&volume).unwrap())
        .collect()
}

/// The rule: the sums over slices of bilinear samples, at the points of the lattice around a pixel's
/// ray, by cubic convolution, times the length of the ray between slices.
fn plain(bone: &BoneVolume, camera: &Camera, pose: &Rigid, pixel: [usize; 2]) -> f64 {
    let volume = bone.attenuation();
    let grid = &volume.grid;
    let rays = IndexRays::new(camera, pose, grid);
    let across = Lattice::dominant_axis(&rays, &grid.spacing);
    let [p, q] = [[1, 2], [0, 2], [0, 1]][across];
    let source = grid.index(&(pose.inverse() * Point::origin()));
    // Where a ray is after one slice, from its second point in index space.
    let tangents = |u: f64, v: f64| {
        let ray = camera.ray(&Pixel::new(u, v));
        let direction = grid.index(&(pose.inverse() * ray.at(1.0))) - source;
        let length = 1.0 / direction[across].abs();
        let tangent = direction * length;
        (
            Vector::new(tangent[p], tangent[q], tangent[across].signum()),
            length,
        )
    };
    let center = [camera.principal.x.round(), camera.principal.y.round()];
    let (origin, _) = tangents(center[0], center[1]);
    // Pixels per tangent at that pixel, by differences.
    let h = 1e-4;
    let along_u = (tangents(center[0] + h, center[1]).0 - origin) / h;
    let along_v = (tangents(center[0], center[1] + h).0 - origin) / h;
    let determinant = (along_u.x * along_v.y - along_u.y * along_v.x).abs();
    let farthest = source[across]
        .abs()
        .max((grid.dims[across] as f64 - 1.0 - source[across]).abs());
    let step = [
        determinant / along_u.y.hypot(along_v.y),
        determinant / along_u.x.hypot(along_v.x),
    ]
    .map(|step| step.min(1.9 / farthest));
    let (tangent, length) = tangents(pixel[0] as f64, pixel[1] as f64);
    let sum = |x: f64, y: f64| -> f64 {
        let samples = (0..grid.dims[across]).map(|slice| {
            let slices = (slice as f64 - source[across]).abs();
            let mut index = Vector::zeros();
            index[p] = source[p] + slices * (origin.x + x * step[0]);
            index[q] = source[q] + slices * (origin.y + y * step[1]);
            index[across] = slice as f64;
            reference::trilinear(volume, &index)
        });
        samples.sum()
    };
    let weights = |t: f64| {
        [
            ((-0.5 * t + 1.0) * t - 0.5) * t,
            (1.5 * t - 2.5) * t * t + 1.0,
            ((-1.5 * t + 2.0) * t + 0.5) * t,
            (0.5 * t - 0.5) * t * t,
        ]
    };
    let at = [
        (tangent.x - origin.x) / step[0],
        (tangent.y - origin.y) / step[1],
    ];
    let mut value = 0.0;
    for (j, wy) in weights(at[1] - at[1].floor()).into_iter().enumerate() {
        for (i, wx) in weights(at[0] - at[0].floor()).into_iter().enumerate() {
            let point = [
                at[0].floor() + i as f64 - 1.0,
                at[1].floor() + j as f64 - 1.0,
            ];
            value += wx * wy * sum(point[0], point[1]);
        }
    }
    value * length
}

#[test]
fn every_level_follows_the_rule_and_gives_the_same_bits() {
    let camera = small_camera();
    for (number, bone) in bones().into_iter().enumerate() {
        let poses = poses(&bone.attenuation().grid);
        let (expected, touched) = images(PARAMETERS, &bone, &camera, &poses, None);
        for level in SimdLevel::available() {
            let bone = bone.clone().with_simd(level);
            let got = images(PARAMETERS, &bone, &camera, &poses, None);
            assert!(got == (expected.clone(), touched.clone()), "{level:?}");
        }
        let densest = bone
            .attenuation()
            .data
            .iter()
            .fold(0.0f32, |a, &b| a.max(b));
        for (n, pose) in poses.iter().enumerate() {
            let image = &expected[n * camera.width * camera.height..];
            let image = &image[..camera.width * camera.height];
            let largest = image.iter().fold(20.0 * densest, |a, &b| a.max(b));
            // Every seventh pixel: the plain rule is slow.
            for at in (0..image.len()).step_by(7) {
                let pixel = [at % camera.width, at / camera.width];
                let inside = (touched[n].x0..touched[n].x1).contains(&pixel[0])
                    && (touched[n].y0..touched[n].y1).contains(&pixel[1]);
                let plain = plain(&bone, &camera, pose, pixel);
                let difference = (f64::from(image[at]) - plain).abs();
                // Positions on the lattice are in single precision; beside the pixels touched only
                // the last of the cubic's reach is missing.
                let tolerance = if inside { 2e-5 } else { 2e-3 };
                assert!(
                    difference < tolerance * f64::from(largest),
                    "bone {number} pose {n} pixel {pixel:?} of {:?}: {} {plain} of {largest}",
                    touched[n],
                    image[at]
                );
            }
        }
    }
}

#[test]
fn an_image_depends_on_its_pose_alone() {
    let camera = small_camera();
    let bone = &bones()[1];
    let poses = poses(&bone.attenuation().grid);
    let (all, touched) = images(PARAMETERS, bone, &camera, &poses, None);
    let pixels = camera.width * camera.height;
    let mut projector = SliceResampling::new(1.0);
    for (n, pose) in poses.iter().enumerate().rev() {
        use super::Projector;
        let mut image = vec![0.0; pixels];
        let mut own = [PixelRect::EMPTY];
        projector.project_add(bone, &camera, &[*pose], None, &mut image, &mut own);
        assert!(
            image == all[n * pixels..][..pixels] && own[0] == touched[n],
            "pose {n}"
        );
    }
}

#[test]
fn a_pixel_does_not_depend_on_the_detector_s_part() {
    let camera = small_camera();
    let bone = &bones()[0];
    let poses = poses(&bone.attenuation().grid);
    let whole = images(PARAMETERS, bone, &camera, &poses, None).0;
    let mut part = camera;
    (part.width, part.height) = (29, 31);
    let got = images(PARAMETERS, bone, &part, &poses, None).0;
    for n in 0..poses.len() {
        for y in 0..part.height {
            for x in 0..part.width {
                let expected = whole[(n * camera.height + y) * camera.width + x];
                assert_eq!(
                    got[(n * part.height + y) * part.width + x],
                    expected,
                    "pose {n}"
                );
            }
        }
    }
}

#[test]
fn poses_that_slices_do_not_serve_are_cast() {
    let camera = small_camera();
    let bone = &bones()[1];
    let grid = &bone.attenuation().grid;
    // Around the source, behind it, across the detector and beyond it.
    let poses = [0.0, 20.0, -300.0, 1015.0, 1300.0].map(|depth| pose(grid, depth, [0.3, 0.2, 0.1]));
    let slices = images(PARAMETERS, bone, &camera, &poses, None);
    let cast = images(
        ProjectorParameters::RayCast { step_mm: 1.0 },
        bone,
        &camera,
        &poses,
        None,
    );
    assert!(slices.0 == cast.0);
}

#[test]
fn a_fixed_axis_keeps_and_an_impossible_one_is_exchanged() {
    let camera = small_camera();
    let bone = &bones()[1];
    let grid = &bone.attenuation().grid;
    let slanted = [pose(grid, 800.0, [0.0, 0.9, 0.0])];
    let across_z = images(PARAMETERS, bone, &camera, &slanted, Some(2)).0;
    let best = images(PARAMETERS, bone, &camera, &slanted, None).0;
    assert!(across_z != best, "the axis is not the best one here");
    let largest = best.iter().fold(0.0f32, |a, &b| a.max(b));
    let squares: f32 = across_z
        .iter()
        .zip(&best)
        .map(|(a, b)| (a - b).powi(2))
        .sum();
    assert!((squares / best.len() as f32).sqrt() < 0.05 * largest);
    // Slices along the rays cannot be resampled.
    let impossible = images(PARAMETERS, bone, &camera, &slanted, Some(1)).0;
    assert!(impossible == best);
}

#[test]
fn smooth_bones_project_as_exactly_as_rays_do() {
    let grid = Grid::axis_aligned([52, 44, 48], 1.0, Point::new(-26.0, -22.0, -24.0));
    let mut volume = Volume::filled(grid.clone(), 0.0f32);
    for (offset, value) in volume.data.iter_mut().enumerate() {
        let p = grid.center(grid.voxel(offset));
        let r = (p.x / 22.0).powi(2) + (p.y / 18.0).powi(2) + (p.z / 20.0).powi(2);
        *value = (0.04 * (1.0 - r).max(0.0).powi(2)) as f32;
    }
    let bone = BoneVolume::from_attenuation(&volume).unwrap();
    let camera = Camera::centered(60, 1.552, 1020.0);
    let poses = poses(&bone.attenuation().grid);
    let got = images(PARAMETERS, &bone, &camera, &poses, None).0;
    for (image, pose) in got.chunks_exact(60 * 60).zip(&poses) {
        let exact = reference::line_integrals(bone.attenuation(), &camera, pose, 0.25);
        let largest = exact.data.iter().fold(0.0f64, |a, &b| a.max(b));
        let worst = (image.iter().zip(&exact.data))
            .fold(0.0f64, |a, (&i, e)| a.max((f64::from(i) - e).abs()));
        assert!(worst < 2e-3 * largest, "{worst} of {largest}");
    }
}

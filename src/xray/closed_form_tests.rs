//! The projector against exact integrals: of closed forms made of voxels by partial volume, and of
//! what lies between voxels. docs/projector.md has the figures.

use super::{BoneVolume, Camera, PixelRect, SimdLevel};
use crate::geometry::{Pixel, Point, Rigid, Vector};
use crate::volume::{Grid, Volume};
use nalgebra::{Matrix2, Vector2};

/// Attenuation per mm of all shapes.
const MU: f64 = 0.02;

/// A convex solid about the origin of its own frame, sizes in mm.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Sphere {
        radius: f64,
    },
    Box {
        half: [f64; 3],
    },
    /// Along z.
    Cylinder {
        radius: f64,
        half_length: f64,
    },
}

const SHAPES: [Shape; 3] = [
    Shape::Sphere { radius: 31.0 },
    Shape::Box {
        half: [21.0, 33.0, 14.0],
    },
    Shape::Cylinder {
        radius: 17.0,
        half_length: 35.0,
    },
];

impl Shape {
    /// The shape with its surface moved outward.
    fn grown(self, by: f64) -> Self {
        match self {
            Self::Sphere { radius } => Self::Sphere {
                radius: radius + by,
            },
            Self::Box { half } => Self::Box {
                half: half.map(|h| h + by),
            },
            Self::Cylinder {
                radius,
                half_length,
            } => Self::Cylinder {
                radius: radius + by,
                half_length: half_length + by,
            },
        }
    }

    /// Below zero inside, never farther from zero than the surface is.
    fn distance(&self, p: &Point) -> f64 {
        match *self {
            Self::Sphere { radius } => p.coords.norm() - radius,
            Self::Box { half } => (p.coords.abs() - Vector::from(half)).max(),
            Self::Cylinder {
                radius,
                half_length,
            } => (p.x.hypot(p.y) - radius).max(p.z.abs() - half_length),
        }
    }

    /// Length of a line (point, unit direction) inside.
    fn chord(&self, from: &Point, direction: &Vector) -> f64 {
        let slab = |axis: usize, half: f64| {
            let (a, b) = (
                (-half - from[axis]) / direction[axis],
                (half - from[axis]) / direction[axis],
            );
            [a.min(b), a.max(b)]
        };
        // Where the components `axes` of the line are within `radius` of the axis or centre.
        let round = |axes: &[usize], radius: f64| {
            let dot = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| {
                axes.iter().map(|&n| a(n) * b(n)).sum::<f64>()
            };
            let (p, d) = (|n: usize| from[n], |n: usize| direction[n]);
            let (a, b, c) = (dot(&d, &d), dot(&p, &d), dot(&p, &p) - radius * radius);
            let root = (b * b - a * c).sqrt();
            // No number (a line that misses) makes the chord zero below.
            [(-b - root) / a, (-b + root) / a]
        };
        let parts = match *self {
            Self::Sphere { radius } => vec![round(&[0, 1, 2], radius)],
            Self::Box { half } => (0..3).map(|axis| slab(axis, half[axis])).collect(),
            Self::Cylinder {
                radius,
                half_length,
            } => vec![round(&[0, 1], radius), slab(2, half_length)],
        };
        if parts.iter().any(|p| p[0].is_nan()) {
            return 0.0;
        }
        let enter = parts.iter().map(|p| p[0]).fold(f64::MIN, f64::max);
        let leave = parts.iter().map(|p| p[1]).fold(f64::MAX, f64::min);
        (leave - enter).max(0.0)
    }

    /// The share of each voxel that lies inside, times [`MU`]: 8 x 8 x 8 places a voxel.
    fn voxels(&self, grid: &Grid, shape_from_world: &Rigid) -> Volume<f32> {
        const PLACES: usize = 8;
        let reach = Vector::from(grid.spacing).norm() / 2.0;
        let place = |n: usize| (n as f64 + 0.5) / PLACES as f64 - 0.5;
        let mut volume = Volume::filled(grid.clone(), 0.0f32);
        for offset in 0..grid.len() {
            let [i, j, k] = grid.voxel(offset).map(|n| n as f64);
            let at = |a: f64, b: f64, c: f64| shape_from_world * grid.point(i + a, j + b, k + c);
            let middle = self.distance(&at(0.0, 0.0, 0.0));
            let share = if middle.abs() > reach {
                f64::from(middle < 0.0)
            } else {
                let inside = (0..PLACES.pow(3)).filter(|n| {
                    let [a, b, c] = [n % PLACES, n / PLACES % PLACES, n / PLACES.pow(2)].map(place);
                    self.distance(&at(a, b, c)) < 0.0
                });
                inside.count() as f64 / PLACES.pow(3) as f64
            };
            volume.data[offset] = (MU * share) as f32;
        }
        volume
    }
}

/// Voxels of three sizes near 1 mm, the grid oblique in the world and its centre far from the
/// world's origin.
fn grid() -> Grid {
    let direction = *nalgebra::Rotation3::from_euler_angles(0.4, -0.7, 2.3).matrix();
    let (dims, spacing) = ([84, 92, 80], [1.0, 0.9, 1.1]);
    let corner = Vector::from_fn(|a, _| (dims[a] as f64 - 1.0) / 2.0 * spacing[a]);
    Grid {
        dims,
        spacing,
        origin: Point::new(35.0, -80.0, 120.0) - direction * corner,
        direction,
    }
}

/// The shape's place: near the grid's centre, at an angle to its axes.
fn world_from_shape() -> Rigid {
    Rigid::new(Vector::new(35.3, -80.4, 120.2), Vector::new(0.5, 0.3, -0.8))
}

/// 61 x 53 pixels of 2 mm, principal point off the centre.
fn camera() -> Camera {
    let mut camera = Camera::centered(61, 2.0, 1020.0);
    camera.height = 53;
    camera.principal = Pixel::new(28.7, 27.1);
    camera
}

/// Views from three sides, along no axis of grid or shapes.
fn views() -> [Rigid; 3] {
    let center = world_from_shape().translation.vector;
    [[0.3, 0.2, 0.1], [1.5, -0.4, 0.7], [-0.6, 1.2, 2.0]].map(|[a, b, c]| {
        let rotation = nalgebra::UnitQuaternion::from_euler_angles(a, b, c);
        let target = Vector::new(2.0, -3.0, -812.0);
        Rigid::from_parts((target - rotation * center).into(), rotation)
    })
}

/// Exact line integrals of a shape.
fn exact(shape: &Shape, camera: &Camera, camera_from_world: &Rigid) -> Vec<f64> {
    let shape_from_camera = (camera_from_world * world_from_shape()).inverse();
    let mut image = Vec::with_capacity(camera.width * camera.height);
    for y in 0..camera.height {
        for x in 0..camera.width {
            let ray = camera.ray(&Pixel::new(x as f64, y as f64));
            let from = shape_from_camera * ray.at(0.0);
            let direction = shape_from_camera.rotation * (ray.at(1.0) - ray.at(0.0));
            image.push(MU * shape.chord(&from, &direction));
        }
    }
    image
}

fn projected(bone: &BoneVolume, camera: &Camera, pose: &Rigid, step_mm: f64) -> Vec<f64> {
    let mut out = vec![0.0; camera.width * camera.height];
    bone.project_add(camera, pose, step_mm, PixelRect::full(camera), &mut out);
    out.into_iter().map(f64::from).collect()
}

/// Pixels that lie more than two voxels inside or outside of the silhouette.
fn away_from_silhouette(shape: &Shape, camera: &Camera, pose: &Rigid) -> Vec<bool> {
    let (wide, narrow) = (shape.grown(2.0), shape.grown(-2.0));
    std::iter::zip(exact(&wide, camera, pose), exact(&narrow, camera, pose))
        .map(|(wide, narrow)| wide == 0.0 || narrow > 0.0)
        .collect()
}

fn largest(image: &[f64]) -> f64 {
    image.iter().copied().fold(0.0, f64::max)
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0), |(sum, n), v| (sum + v * v, n + 1));
    (sum / f64::from(n)).sqrt()
}

#[test]
fn closed_forms_are_projected_to_half_a_percent() {
    for shape in SHAPES {
        let volume = shape.voxels(&grid(), &world_from_shape().inverse());
        let bone = BoneVolume::from_attenuation(&volume).unwrap();
        for (number, pose) in views().iter().enumerate() {
            let truth = exact(&shape, &camera(), pose);
            let image = projected(&bone, &camera(), pose, 1.0);
            let counts = away_from_silhouette(&shape, &camera(), pose);
            let kept = counts.iter().filter(|&&c| c).count();
            assert!(10 * kept > 6 * counts.len(), "{kept} pixels");
            let errors = (0..truth.len()).filter(|&n| counts[n]);
            let error = rms(errors.map(|n| image[n] - truth[n])) / largest(&truth);
            println!("{shape:?} view {number}: RMS {:.3} %", 100.0 * error);
            assert!(error < 5e-3, "{shape:?} view {number}: RMS {error}");
        }
    }
}

/// How far (in columns and rows) an image lies from the exact one: least squares of their difference
/// over the exact image's derivatives.
fn displacement(shape: &Shape, image: &[f64], pose: &Rigid) -> Vector2<f64> {
    let moved = |x: f64, y: f64| {
        let mut camera = camera();
        camera.principal += Vector2::new(x, y);
        exact(shape, &camera, pose)
    };
    let derivative = |x: f64, y: f64| -> Vec<f64> {
        let pairs = std::iter::zip(moved(x, y), moved(-x, -y));
        pairs.map(|(a, b)| a - b).collect()
    };
    // Differences over a pixel, as wide as the blur of the voxels.
    let slopes = [derivative(0.5, 0.0), derivative(0.0, 0.5)];
    let truth = moved(0.0, 0.0);
    let dot = |a: &[f64], b: &[f64]| std::iter::zip(a, b).map(|(a, b)| a * b).sum::<f64>();
    let difference: Vec<f64> = std::iter::zip(image, &truth).map(|(a, b)| a - b).collect();
    let normal = Matrix2::from_fn(|i, j| dot(&slopes[i], &slopes[j]));
    let right = Vector2::from_fn(|i, _| dot(&slopes[i], &difference));
    normal.try_inverse().unwrap() * right
}

#[test]
fn nothing_is_off_by_half_a_pixel_or_half_a_voxel() {
    for shape in SHAPES {
        let volume = shape.voxels(&grid(), &world_from_shape().inverse());
        let bone = BoneVolume::from_attenuation(&volume).unwrap();
        for (number, pose) in views().iter().enumerate() {
            let image = projected(&bone, &camera(), pose, 1.0);
            let off = displacement(&shape, &image, pose);
            println!("{shape:?} view {number}: {:.4} {:.4} px", off.x, off.y);
            // A pixel is 1.6 mm wide at the shape: half a voxel would show as 0.3 px in a view
            // or another.
            assert!(off.amax() < 0.03, "{shape:?} view {number}: {off} px");

            // The measure itself: an image half a pixel off measures half a pixel.
            let mut camera = camera();
            camera.principal.x += 0.5;
            let off = displacement(&shape, &projected(&bone, &camera, pose, 1.0), pose);
            assert!((off - Vector2::new(0.5, 0.0)).amax() < 0.05, "{off} px");
        }
    }
}

/// The exact integral of a volume, linear between voxels, along the part of a ray between two depths:
/// along a line it is a cubic between two planes of voxel centres, which Simpson's rule integrates
/// without error.
fn exact_between_voxels(volume: &Volume<f32>, camera: &Camera, pose: &Rigid) -> Vec<f64> {
    let grid = &volume.grid;
    let volume_from_camera = pose.inverse();
    let mut image = Vec::with_capacity(camera.width * camera.height);
    for y in 0..camera.height {
        for x in 0..camera.width {
            let ray = camera.ray(&Pixel::new(x as f64, y as f64));
            let at = |t: f64| grid.index(&(volume_from_camera * ray.at(t)));
            let (source, slope) = (at(0.0), at(1.0) - at(0.0));
            let mut planes: Vec<f64> = (0..3)
                .flat_map(|a| (0..grid.dims[a]).map(move |n| (n as f64 - source[a]) / slope[a]))
                .filter(|&t| t > 0.0)
                .collect();
            planes.sort_by(f64::total_cmp);
            let value = |t: f64| super::reference::trilinear(volume, &at(t));
            let parts = planes.windows(2).map(|t| {
                let (a, b) = (t[0], t[1]);
                (b - a) / 6.0 * (value(a) + 4.0 * value((a + b) / 2.0) + value(b))
            });
            image.push(parts.sum());
        }
    }
    image
}

#[test]
fn the_error_falls_with_the_step() {
    for shape in SHAPES {
        let volume = shape.voxels(&grid(), &world_from_shape().inverse());
        let bone = BoneVolume::from_attenuation(&volume).unwrap();
        let pose = &views()[1];
        let limit = exact_between_voxels(bone.attenuation(), &camera(), pose);
        let errors = [2.0, 1.0, 0.5, 0.25, 0.125].map(|step_mm| {
            let image = projected(&bone, &camera(), pose, step_mm);
            let error = rms(std::iter::zip(&image, &limit).map(|(a, b)| a - b)) / largest(&limit);
            println!("{shape:?} step {step_mm} mm: RMS {:.5} %", 100.0 * error);
            error
        });
        for pair in errors.windows(2) {
            assert!(pair[1] < 0.5 * pair[0], "{shape:?}: {errors:?}");
        }
        assert!(errors[1] < 5e-3, "{shape:?}: {errors:?}");
    }
}

/// Rays that graze planes of voxels, run within them, meet edges, corners and the source itself, and
/// volumes of a single voxel: the levels still agree bit for bit.
#[test]
fn levels_agree_bit_for_bit_on_adversarial_rays() {
    let quarter = std::f64::consts::FRAC_PI_2;
    let mut volumes = Vec::new();
    for (seed, dims) in [
        (1, [1, 1, 1]),
        (2, [2, 9, 33]),
        (3, [40, 3, 5]),
        (4, [17; 3]),
    ] {
        let grid = Grid::axis_aligned(dims, 1.0, Point::new(0.0, 0.0, 0.0));
        let data = (0..grid.len()).map(|o| match (o * 7919 + seed) % 5 {
            // Full scale beside zero: the largest differences that voxels can have.
            0 | 1 => 0.0,
            2 => 1.0,
            _ => ((o * 104_729 + seed) % 1009) as f32 / 1009.0,
        });
        let mut volume = Volume::new(grid.clone(), data.collect());
        volume.data[0] = 1.0;
        volumes.push(volume);
    }
    let mut camera = Camera::centered(33, 1.25, 1000.0);
    camera.height = 31;
    for volume in &volumes {
        let bone = BoneVolume::from_attenuation(volume).unwrap();
        let center = volume.grid.dims.map(|n| (n as f64 - 1.0) / 2.0);
        for angles in [
            [0.0, 0.0, 0.0],
            [quarter, 0.0, 0.0],
            [0.0, quarter, 0.0],
            [2.0 * quarter, 0.0, quarter],
            [quarter / 2.0, 0.0, 0.0],
            [quarter / 2.0, 0.615_479_708_670_387_3, quarter / 2.0],
            [1e-7, -1e-7, 0.0],
        ] {
            for depth in [-3.0, 0.0, 1e-9, 0.5, 20.0, 800.0, 1000.0, 1010.0] {
                let rotation =
                    nalgebra::UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
                let target = Vector::new(0.0, 0.5, -depth);
                let pose =
                    Rigid::from_parts((target - rotation * Vector::from(center)).into(), rotation);
                for step_mm in [0.25, 1.0, 7.0] {
                    let image = |level| {
                        let mut out = vec![0.0; camera.width * camera.height];
                        let bone = bone.clone().with_simd(level);
                        let rect = PixelRect::full(&camera);
                        bone.project_add(&camera, &pose, step_mm, rect, &mut out);
                        out
                    };
                    let portable = image(SimdLevel::Portable);
                    for level in SimdLevel::available() {
                        assert_eq!(
                            image(level),
                            portable,
                            "{} {:?} {angles:?} {depth} {step_mm}",
                            level.name(),
                            volume.grid.dims
                        );
                    }
                }
            }
        }
    }
}

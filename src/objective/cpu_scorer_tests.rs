//! The scorer against the plain method, and what every scorer must keep.

use super::{CpuScorer, FixedView, Scorer, ScorerParameters, ScorerView, Views, direct, drr};
use crate::geometry::{Point, Rigid, Vector};
use crate::image::Image;
use crate::simd::SimdLevel;
use crate::volume::{Grid, Volume};
use crate::xray::Camera;
use crate::xray::{BoneVolume, ProjectorParameters, reference};
use nalgebra::UnitQuaternion;
use rayon::prelude::*;
use std::sync::Arc;

/// A lumpy ellipsoid of the given half axes (mm) at the origin.
fn bone(half_axes: [f64; 3]) -> Arc<BoneVolume> {
    let grid = Grid::axis_aligned([60, 60, 60], 1.5, Point::new(-44.25, -44.25, -44.25));
    let mut volume = Volume::filled(grid.clone(), 0.0f32);
    for (offset, value) in volume.data.iter_mut().enumerate() {
        let p = grid.center(grid.voxel(offset));
        let r = (0..3)
            .map(|axis| (p[axis] / half_axes[axis]).powi(2))
            .sum::<f64>();
        if r < 1.0 {
            *value = (0.03 + 0.01 * (0.9 * p.x).sin() * (0.5 * p.y + 0.3 * p.z).cos()) as f32;
        }
    }
    Arc::new(BoneVolume::from_attenuation(&volume).unwrap())
}

fn camera() -> Camera {
    Camera::centered(96, 3.0, 1020.0)
}

fn pose(x: f64, y: f64, z: f64, angle: f64) -> Rigid {
    let rotation = UnitQuaternion::from_scaled_axis(angle * Vector::new(1.0, 2.0, -0.5));
    Rigid::from_parts(nalgebra::Translation3::new(x, y, -816.0 + z), rotation)
}

/// Pelvis (moving), femur and fragment (static) in two views.
struct Scene {
    camera: Camera,
    views: Vec<ScorerView>,
    moving: Arc<BoneVolume>,
    statics: Vec<(Arc<BoneVolume>, Rigid)>,
}

impl Scene {
    fn new() -> Self {
        Self::seen_by(camera())
    }

    fn seen_by(camera: Camera) -> Self {
        let moving = bone([22.0, 14.0, 30.0]);
        let statics = vec![
            (bone([12.0, 40.0, 12.0]), pose(-40.0, 20.0, 10.0, 0.2)),
            (bone([25.0, 15.0, 10.0]), pose(35.0, -30.0, -20.0, -0.1)),
        ];
        let turned = pose(0.0, 0.0, 0.0, 0.0)
            * Rigid::rotation(Vector::new(0.0, 0.3, 0.0))
            * pose(0.0, 0.0, 0.0, 0.0).inverse();
        let views = [Rigid::identity(), turned]
            .map(|camera_from_world| {
                let mut image = drr(
                    &camera,
                    &[
                        (&moving, camera_from_world * pose(5.0, -8.0, 0.0, 0.05)),
                        (&statics[0].0, camera_from_world * statics[0].1),
                    ],
                    1.0,
                );
                for (i, v) in image.data.iter_mut().enumerate() {
                    *v += 0.02 * (i * 7919 % 101) as f32;
                }
                ScorerView {
                    fixed: Arc::new(FixedView::new(image, camera, 11, 1.0).unwrap()),
                    camera_from_world,
                }
            })
            .to_vec();
        Self {
            camera,
            views,
            moving,
            statics,
        }
    }

    fn scorer(&self, parameters: ScorerParameters) -> CpuScorer {
        CpuScorer::new(
            self.views.clone(),
            vec![Arc::clone(&self.moving)],
            self.statics.clone(),
            parameters,
        )
    }

    /// Everything projected anew and compared as a whole.
    fn projections(&self, world_from_volume: &Rigid) -> Vec<Image<f32>> {
        self.views
            .iter()
            .map(|view| {
                let mut bones: Vec<(&BoneVolume, Rigid)> = Vec::new();
                for (bone, world_from_volume) in &self.statics {
                    bones.push((bone, view.camera_from_world * world_from_volume));
                }
                bones.push((&self.moving, view.camera_from_world * world_from_volume));
                drr(&self.camera, &bones, 1.0)
            })
            .collect()
    }
}

fn candidates() -> Vec<Rigid> {
    vec![
        pose(5.0, -8.0, 0.0, 0.05),
        pose(0.0, 0.0, 0.0, 0.0),
        // Partly and wholly beside the image, and behind the source.
        pose(118.0, 100.0, 0.0, 0.4),
        pose(900.0, 0.0, 0.0, 0.0),
        pose(0.0, 0.0, 1500.0, 0.0),
        // Close to the source: the footprint is the whole image.
        pose(0.0, 0.0, 700.0, 0.3),
        pose(-30.0, 12.0, 5.0, -0.3),
    ]
}

#[test]
fn partial_recomputation_is_exact() {
    let scene = Scene::new();
    let mut scorer = scene.scorer(ScorerParameters::default());
    for candidate in candidates() {
        let mut cost = [0.0];
        scorer.similarities(&[candidate], &mut cost);
        let projections = scene.projections(&candidate);
        let whole: f64 = scene
            .views
            .iter()
            .zip(&projections)
            .map(|(view, projection)| view.fixed.similarity(projection))
            .sum();
        assert_eq!(cost[0], whole / 2.0, "{candidate}");
        let defined: f64 = scene
            .views
            .iter()
            .zip(&projections)
            .map(|(view, image)| direct::similarity(view.fixed.image(), image, 5))
            .sum();
        assert!((cost[0] - defined / 2.0).abs() < 1e-6);
        assert_eq!(scorer.projection(1, &[candidate]), projections[1]);
    }
}

#[test]
fn a_cost_depends_on_its_candidate_alone() {
    let scene = Scene::new();
    let candidates = candidates();
    let mut scorer = scene.scorer(ScorerParameters::default());
    let mut batch = vec![0.0; candidates.len()];
    scorer.similarities(&candidates, &mut batch);
    for (candidate, expected) in candidates.iter().zip(&batch).rev() {
        let mut cost = [0.0];
        scorer.similarities(&[*candidate], &mut cost);
        assert_eq!(cost[0], *expected);
    }
}

#[test]
fn slices_cost_a_candidate_what_rays_do_and_in_any_batch_the_same() {
    let scene = Scene::new();
    // More than a batch, most of them about one pose and some partly beside the image.
    let candidates: Vec<Rigid> = (0..25)
        .map(|n| pose(5.0 * f64::from(n), -8.0, f64::from(n), 0.02 * f64::from(n)))
        .collect();
    let mut by_rays = vec![0.0; candidates.len()];
    scene
        .scorer(ScorerParameters::default())
        .similarities(&candidates, &mut by_rays);
    let parameters = ScorerParameters {
        projector: ProjectorParameters::Slice { pitch_px: 1.0 },
        ..ScorerParameters::default()
    };
    let mut scorer = scene.scorer(parameters).about(&candidates[..1]);
    let mut by_slices = vec![0.0; candidates.len()];
    scorer.similarities(&candidates, &mut by_slices);
    for (n, candidate) in candidates.iter().enumerate().rev() {
        let mut alone = [0.0];
        scorer.similarities(&[*candidate], &mut alone);
        assert_eq!(alone[0], by_slices[n], "candidate {n}");
        let difference = (by_slices[n] - by_rays[n]).abs();
        assert!(difference < 5e-3, "candidate {n}: {difference}");
    }
}

#[test]
fn every_level_gives_the_same_bits_and_the_sum_is_the_mean_times_views() {
    let scene = Scene::new();
    let candidates = candidates();
    let mut expected = vec![0.0; candidates.len()];
    scene
        .scorer(ScorerParameters::default())
        .similarities(&candidates, &mut expected);
    for simd in SimdLevel::available() {
        let parameters = ScorerParameters {
            simd,
            views: Views::Sum,
            ..ScorerParameters::default()
        };
        let mut costs = vec![0.0; candidates.len()];
        scene
            .scorer(parameters)
            .similarities(&candidates, &mut costs);
        let doubled: Vec<f64> = expected.iter().map(|cost| 2.0 * cost).collect();
        assert_eq!(costs, doubled, "{simd:?}");
    }
}

#[test]
fn the_true_pose_is_best() {
    let scene = Scene::new();
    let mut scorer = scene.scorer(ScorerParameters::default());
    let truth = pose(5.0, -8.0, 0.0, 0.05);
    let step = |d: Vector, w: Vector| {
        Rigid::from_parts(
            nalgebra::Translation3::from(truth.translation.vector + d),
            truth.rotation * UnitQuaternion::from_scaled_axis(w),
        )
    };
    let mut poses = vec![truth];
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let mut e = Vector::zeros();
            e[axis] = sign;
            poses.push(step(6.0 * e, Vector::zeros()));
            poses.push(step(Vector::zeros(), 0.2 * e));
        }
    }
    let mut costs = vec![0.0; poses.len()];
    scorer.similarities(&poses, &mut costs);
    assert!(costs[1..].iter().all(|&cost| cost > costs[0]), "{costs:?}");
}

#[test]
fn all_objects_may_move() {
    let scene = Scene::new();
    let mut moving = vec![Arc::clone(&scene.moving)];
    moving.extend(scene.statics.iter().map(|(bone, _)| Arc::clone(bone)));
    let mut scorer = CpuScorer::new(
        scene.views.clone(),
        moving,
        Vec::new(),
        ScorerParameters::default(),
    );
    assert_eq!(scorer.moving_objects(), 3);
    let truth = pose(5.0, -8.0, 0.0, 0.05);
    let mut cost = [0.0];
    scorer.similarities(&[truth, scene.statics[0].1, scene.statics[1].1], &mut cost);
    let mut one_moving = [0.0];
    scene
        .scorer(ScorerParameters::default())
        .similarities(&[truth], &mut one_moving);
    // The order in which line integrals are added differs, so the last digits may.
    assert!((cost[0] - one_moving[0]).abs() < 1e-6);
}

/// The plain method: every sample of every ray in double precision, every patch by the formula.
fn plain_cost(scene: &Scene, statics: &[Image<f64>], candidate: &Rigid) -> f64 {
    let mut sum = 0.0;
    for (view, behind) in scene.views.iter().zip(statics) {
        let pose = view.camera_from_world * candidate;
        let moving =
            reference::line_integrals(scene.moving.attenuation(), &scene.camera, &pose, 1.0);
        let image = Image {
            width: behind.width,
            height: behind.height,
            data: (moving.data.iter().zip(&behind.data))
                .map(|(a, b)| (a + b) as f32)
                .collect(),
        };
        sum += direct::similarity(view.fixed.image(), &image, 5);
    }
    sum / scene.views.len() as f64
}

#[test]
fn a_thousand_poses_cost_what_the_plain_method_says() {
    // Few pixels: the plain method takes 30 ms a view of these.
    let scene = Scene::seen_by(Camera::centered(64, 4.5, 1020.0));
    let statics: Vec<Image<f64>> = (scene.views.iter())
        .map(|view| {
            let mut images = scene.statics.iter().map(|(bone, pose)| {
                let pose = view.camera_from_world * pose;
                reference::line_integrals(bone.attenuation(), &scene.camera, &pose, 1.0)
            });
            let mut sum = images.next().expect("a static object");
            for image in images {
                for (total, value) in sum.data.iter_mut().zip(image.data) {
                    *total += value;
                }
            }
            sum
        })
        .collect();
    // Spread as a first population is: 30 mm, 100 mm in depth, half a radian.
    let poses: Vec<Rigid> = (0..1000)
        .map(|n| {
            let draw =
                |k: u32| f64::from((n * 2654435761u32).rotate_left(5 * k) % 2001) / 1000.0 - 1.0;
            pose(
                30.0 * draw(1),
                30.0 * draw(2),
                100.0 * draw(3),
                0.25 * draw(4),
            )
        })
        .collect();
    let mut costs = vec![0.0; poses.len()];
    scene
        .scorer(ScorerParameters::default())
        .similarities(&poses, &mut costs);
    let differences: Vec<f64> = (poses.par_iter().zip(&costs))
        .map(|(pose, cost)| (cost - plain_cost(&scene, &statics, pose)).abs())
        .collect();
    let worst = differences.into_iter().fold(0.0, f64::max);
    println!("worst difference of 1000 costs: {worst:.2e}");
    assert!(worst < 1e-5, "{worst}");
}

//! The scorer that runs on the calling thread.

use super::Scorer;
use super::similarity::FixedView;
use super::view_cost::ViewCost;
use crate::geometry::Rigid;
use crate::image::Image;
use crate::simd::SimdLevel;
use crate::xray::{BoneVolume, Projector, ProjectorParameters};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How the similarities of the views become one cost (DESIGN section 3, views in the cost).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Views {
    /// Their mean: the authors' code.
    #[default]
    Mean,
    /// Their sum: equation 1 as printed.
    Sum,
}

/// How candidates are projected and their views combined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScorerParameters {
    /// What makes DRRs. Default: the ray caster with a step of 1 mm.
    pub projector: ProjectorParameters,
    /// Default: the mean.
    pub views: Views,
    /// Vector instructions of the similarity, which gives the same bits at every level. Default:
    /// the process's. Bones carry the level of their projection.
    pub simd: SimdLevel,
}

impl Default for ScorerParameters {
    fn default() -> Self {
        Self {
            projector: ProjectorParameters::RayCast { step_mm: 1.0 },
            views: Views::Mean,
            simd: SimdLevel::current(),
        }
    }
}

/// One view of a scorer.
#[derive(Clone, Debug)]
pub struct ScorerView {
    /// The fixed image.
    pub fixed: Arc<FixedView>,
    /// Where its camera stands.
    pub camera_from_world: Rigid,
}

/// Scores candidates one after another on the calling thread; allocates nothing once it is made and
/// its projector has seen the largest image. A candidate's cost depends on that candidate alone, bit
/// for bit.
#[derive(Debug)]
pub struct CpuScorer {
    views: Vec<ViewCost>,
    moving: Vec<Arc<BoneVolume>>,
    projector: Box<dyn Projector>,
    parameters: ScorerParameters,
}

impl CpuScorer {
    /// For candidates of the poses of `moving`, over `statics` at their `world_from_volume`, which
    /// are projected here, once.
    ///
    /// # Panics
    /// When there is no view or no moving object, the step is not positive, or the processor lacks
    /// the level of vector instructions.
    pub fn new(
        views: Vec<ScorerView>,
        moving: Vec<Arc<BoneVolume>>,
        statics: Vec<(Arc<BoneVolume>, Rigid)>,
        parameters: ScorerParameters,
    ) -> Self {
        assert!(!views.is_empty(), "a scorer needs a view");
        assert!(!moving.is_empty(), "a scorer needs an object that moves");
        let mut projector = parameters.projector.projector();
        let views = views
            .into_iter()
            .map(|view| {
                ViewCost::new(
                    view.fixed,
                    view.camera_from_world,
                    moving.len(),
                    &statics,
                    projector.as_mut(),
                    parameters.simd,
                )
            })
            .collect();
        Self {
            views,
            moving,
            projector,
            parameters,
        }
    }

    /// The same scorer for candidates about these poses, one for each moving object: a projector
    /// that distinguishes axes keeps to those that suit these poses, so that the cost has no jumps.
    /// Without this each candidate has its own axes.
    ///
    /// # Panics
    /// When there is not one pose for each moving object.
    pub fn about(mut self, world_from_volume: &[Rigid]) -> Self {
        assert_eq!(
            world_from_volume.len(),
            self.moving.len(),
            "one pose for each moving object"
        );
        for view in &mut self.views {
            view.fix_axes(&self.moving, world_from_volume, self.projector.as_ref());
        }
        self
    }

    /// For one view whose camera is the world: a candidate's poses are `camera_from_volume`.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn single_view(
        fixed: Arc<FixedView>,
        moving: Arc<BoneVolume>,
        parameters: ScorerParameters,
    ) -> Self {
        let view = ScorerView {
            fixed,
            camera_from_world: Rigid::identity(),
        };
        Self::new(vec![view], vec![moving], Vec::new(), parameters)
    }

    /// Number of views.
    pub fn views(&self) -> usize {
        self.views.len()
    }

    /// The projection that a candidate is scored by in one view, static objects included: line
    /// integrals without unit.
    ///
    /// # Panics
    /// When there is no such view or the candidate has not one pose for each moving object.
    pub fn projection(&mut self, view: usize, world_from_volume: &[Rigid]) -> Image<f32> {
        self.view_similarity(view, world_from_volume);
        let view = &self.views[view];
        view.projection()
    }

    /// A candidate's similarity in one view alone, lower is better.
    ///
    /// # Panics
    /// When there is no such view or the candidate has not one pose for each moving object.
    pub fn view_similarity(&mut self, view: usize, world_from_volume: &[Rigid]) -> f64 {
        assert_eq!(
            world_from_volume.len(),
            self.moving.len(),
            "one pose for each moving object"
        );
        let mut similarity = [0.0];
        let projector = self.projector.as_mut();
        self.views[view].add_similarities(
            &self.moving,
            world_from_volume,
            projector,
            &mut similarity,
        );
        similarity[0]
    }
}

impl Scorer for CpuScorer {
    fn moving_objects(&self) -> usize {
        self.moving.len()
    }

    fn similarities(&mut self, world_from_volume: &[Rigid], costs: &mut [f64]) {
        let objects = self.moving.len();
        assert_eq!(
            world_from_volume.len(),
            costs.len() * objects,
            "one pose for each moving object of each candidate"
        );
        costs.fill(0.0);
        // View after view, so that a view's images stay in the cache for the whole batch.
        for view in &mut self.views {
            let projector = self.projector.as_mut();
            view.add_similarities(&self.moving, world_from_volume, projector, costs);
        }
        if self.parameters.views == Views::Mean {
            for cost in costs {
                *cost /= self.views.len() as f64;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{direct, drr};
    use super::*;
    use crate::geometry::{Point, Vector};
    use crate::volume::{Grid, Volume};
    use crate::xray::Camera;
    use nalgebra::UnitQuaternion;

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
        views: Vec<ScorerView>,
        moving: Arc<BoneVolume>,
        statics: Vec<(Arc<BoneVolume>, Rigid)>,
    }

    impl Scene {
        fn new() -> Self {
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
                        &camera(),
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
                        fixed: Arc::new(FixedView::new(image, camera(), 11, 1.0).unwrap()),
                        camera_from_world,
                    }
                })
                .to_vec();
            Self {
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
                    drr(&camera(), &bones, 1.0)
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
}

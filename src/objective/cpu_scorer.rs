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

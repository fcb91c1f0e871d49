//! The observed views at both resolution levels, and the scorers made from them.

use super::parameters::PaperParameters;
use crate::geometry::Rigid;
use crate::objective::{CpuScorer, FixedView, ScorerParameters, ScorerView};
use crate::registration::ObservedView;
use crate::registration::strategy::RegistrationCause;
use crate::xray::pyramid::{self, PyramidParameters};
use crate::xray::{BoneVolume, ProjectorParameters};
use std::sync::Arc;

/// All that does not change between the stages of one registration: the three images at the coarse
/// and the fine level with the fixed part of the similarity.
#[derive(Debug)]
pub struct PreparedViews {
    coarse: Vec<Arc<FixedView>>,
    fine: Vec<Arc<FixedView>>,
    /// What makes the DRRs of all scorers.
    projector: ProjectorParameters,
}

impl PreparedViews {
    /// Crops, log-corrects, smooths and reduces the images.
    ///
    /// # Errors
    /// When an image has not its camera's size or is too small for the level's patches.
    pub fn new(
        views: &[ObservedView; 3],
        paper: &PaperParameters,
        projector: ProjectorParameters,
    ) -> Result<Self, RegistrationCause> {
        let pyramid = PyramidParameters {
            crop_px: paper.crop_px,
            ..PyramidParameters::default()
        };
        let level = |reduction: usize| -> Result<Vec<Arc<FixedView>>, RegistrationCause> {
            let factor = 1.0 / reduction as f64;
            let prepare = |view: &ObservedView| {
                let (image, camera) = pyramid::level(&view.counts, &view.camera, factor, &pyramid)?;
                let fixed = FixedView::new(image, camera, paper.patch_diameter_px, factor)?;
                Ok(Arc::new(fixed))
            };
            views.iter().map(prepare).collect()
        };
        Ok(Self {
            coarse: level(paper.coarse_reduction)?,
            fine: level(paper.fine_reduction)?,
            projector,
        })
    }

    /// Scores poses of one object in one view at the coarse level; the world is the camera. The poses
    /// lie about `start`, if there is one.
    pub fn coarse_view_scorer(
        &self,
        view: usize,
        bone: &Arc<BoneVolume>,
        start: Option<&Rigid>,
        paper: &PaperParameters,
    ) -> CpuScorer {
        self.view_scorer(&self.coarse[view], bone, start, paper)
    }

    /// The same at the fine level.
    pub fn fine_view_scorer(
        &self,
        view: usize,
        bone: &Arc<BoneVolume>,
        start: &Rigid,
        paper: &PaperParameters,
    ) -> CpuScorer {
        self.view_scorer(&self.fine[view], bone, Some(start), paper)
    }

    /// Scores poses about `start`, one for each moving object, in all views at the coarse level, over
    /// static objects at `world_from_volume`.
    pub fn coarse_scorer(
        &self,
        camera_from_world: &[Rigid; 3],
        moving: &[&Arc<BoneVolume>],
        start: &[Rigid],
        statics: Vec<(Arc<BoneVolume>, Rigid)>,
        paper: &PaperParameters,
    ) -> CpuScorer {
        self.scorer(&self.coarse, camera_from_world, moving, statics, paper)
            .about(start)
    }

    /// The same at the fine level.
    pub fn fine_scorer(
        &self,
        camera_from_world: &[Rigid; 3],
        moving: &[&Arc<BoneVolume>],
        start: &[Rigid],
        statics: Vec<(Arc<BoneVolume>, Rigid)>,
        paper: &PaperParameters,
    ) -> CpuScorer {
        self.scorer(&self.fine, camera_from_world, moving, statics, paper)
            .about(start)
    }

    fn view_scorer(
        &self,
        view: &Arc<FixedView>,
        bone: &Arc<BoneVolume>,
        start: Option<&Rigid>,
        paper: &PaperParameters,
    ) -> CpuScorer {
        let (views, world) = (std::slice::from_ref(view), [Rigid::identity()]);
        let scorer = self.scorer(views, &world, &[bone], Vec::new(), paper);
        match start {
            Some(start) => scorer.about(std::slice::from_ref(start)),
            None => scorer,
        }
    }

    fn scorer(
        &self,
        views: &[Arc<FixedView>],
        camera_from_world: &[Rigid],
        moving: &[&Arc<BoneVolume>],
        statics: Vec<(Arc<BoneVolume>, Rigid)>,
        paper: &PaperParameters,
    ) -> CpuScorer {
        let views = views
            .iter()
            .zip(camera_from_world)
            .map(|(view, &camera_from_world)| ScorerView {
                fixed: Arc::clone(view),
                camera_from_world,
            })
            .collect();
        let parameters = ScorerParameters {
            projector: self.projector,
            views: paper.views,
            ..ScorerParameters::default()
        };
        let moving = moving.iter().map(|&bone| Arc::clone(bone)).collect();
        CpuScorer::new(views, moving, statics, parameters)
    }
}

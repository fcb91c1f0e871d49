//! The order of the stages.

use super::initialization::from_single_landmark;
use super::multi_view;
use super::parameters::PaperParameters;
use super::single_view::{ViewStages, register_view, search_orbit};
use super::views::PreparedViews;
use crate::geometry::{Rigid, pose_error};
use crate::random::{Purpose, Stream, stream};
use crate::registration::observation::{BoneModels, Observation, Shape};
use crate::registration::outcome::{Outcome, ShapeOutcome, StageRecord};
use crate::registration::strategy::{RegistrationCause, RegistrationError, Strategy};
use crate::shape_estimation::{RegisteredView, ShapeInput, estimate_cuts};
use crate::surgery::CutPlanes;
use crate::xray::ProjectorParameters;
use std::time::Instant;

/// The paper's registration: single-landmark initialization, three single-view pelvis
/// registrations, the fragment's shape where it is estimated, then the multi-view, multi-object
/// registration in the geometry that the single views gave.
#[derive(Clone, Debug, Default)]
pub struct Paper {
    pub parameters: PaperParameters,
}

fn failed<E: Into<RegistrationCause>>(phase: &'static str) -> impl Fn(E) -> RegistrationError {
    move |cause| RegistrationError {
        phase,
        cause: cause.into(),
    }
}

/// The stage names of the first view and of the two orbital ones.
const FIRST: ViewStages = ViewStages {
    cmaes: "view1_cmaes",
    bobyqa: "view1_bobyqa",
};
const ORBITAL: [(&str, ViewStages); 2] = [
    (
        "view2_search",
        ViewStages {
            cmaes: "view2_cmaes",
            bobyqa: "view2_bobyqa",
        },
    ),
    (
        "view3_search",
        ViewStages {
            cmaes: "view3_cmaes",
            bobyqa: "view3_bobyqa",
        },
    ),
];

impl Strategy for Paper {
    fn name(&self) -> &'static str {
        "paper"
    }

    fn register(&self, observation: &Observation) -> Result<Outcome, RegistrationError> {
        let step_mm = self.parameters.step_mm;
        self.register_by(ProjectorParameters::RayCast { step_mm }, observation)
    }
}

impl Paper {
    /// Registers with DRRs of the given projector.
    pub(super) fn register_by(
        &self,
        projector: ProjectorParameters,
        observation: &Observation,
    ) -> Result<Outcome, RegistrationError> {
        let paper = &self.parameters;
        let optimizer = |stage: &str| -> Stream {
            let key = format!("{}/{stage}", observation.stream_key);
            stream(observation.seed, Purpose::Optimizer, &key)
        };
        let mut stages = Vec::new();
        let views = PreparedViews::new(&observation.views, paper, projector)
            .map_err(failed("preparation"))?;
        let initial = from_single_landmark(
            &observation.hip,
            &observation.views[0].camera,
            &observation.picked_point,
            &observation.picked_pixel,
            paper.landmark_depth,
        );

        let (single_view, orbital_angles) =
            self.register_single_views(observation, &views, initial, &optimizer, &mut stages)?;
        let (models, shape) = self.shape(observation, &single_view)?;
        let app_from_volume = observation.hip.app_from_volume;
        let [pelvis, femur, fragment] = multi_view::register(
            &views,
            &single_view,
            &models,
            app_from_volume,
            paper,
            optimizer,
            &mut stages,
        )?;
        let in_first_view = |world_from_volume: Rigid| single_view[0] * world_from_volume;
        let camera_from_pelvis = in_first_view(pelvis);
        let camera_from_fragment = in_first_view(fragment);
        Ok(Outcome {
            initial_camera_from_pelvis: initial,
            single_view_camera_from_pelvis: single_view,
            orbital_angles,
            camera_from_pelvis,
            camera_from_femur: in_first_view(femur),
            camera_from_fragment,
            fragment_movement: pose_error::fragment_movement(
                &app_from_volume,
                &camera_from_pelvis,
                &camera_from_fragment,
            ),
            shape,
            stages,
        })
    }

    /// `camera_from_pelvis` of the three views, and the orbital angles of the second and third.
    fn register_single_views(
        &self,
        observation: &Observation,
        views: &PreparedViews,
        initial: Rigid,
        optimizer: &impl Fn(&str) -> Stream,
        stages: &mut Vec<StageRecord>,
    ) -> Result<([Rigid; 3], [f64; 2]), RegistrationError> {
        let paper = &self.parameters;
        let head = observation.hip.head();
        let pelvis = match &observation.shape {
            Shape::Given(models) => &models.pelvis,
            Shape::Estimated { full_pelvis, .. } => full_pelvis,
        };
        let first = register_view(
            (views, 0),
            pelvis,
            initial,
            head,
            (paper, &paper.landmark_view),
            FIRST,
            optimizer(FIRST.cmaes),
            stages,
        )?;
        let mut poses = [first; 3];
        let mut angles = [0.0; 2];
        for (k, (search, names)) in ORBITAL.into_iter().enumerate() {
            let orbit = &observation.orbit;
            let (start, angle) =
                search_orbit((views, k + 1), pelvis, &first, orbit, paper, search, stages)?;
            angles[k] = angle;
            poses[k + 1] = register_view(
                (views, k + 1),
                pelvis,
                start,
                head,
                (paper, &paper.orbital_view),
                names,
                optimizer(names.cmaes),
                stages,
            )?;
        }
        Ok((poses, angles))
    }

    /// The bone models of the multi-view stages.
    fn shape(
        &self,
        observation: &Observation,
        camera_from_pelvis: &[Rigid; 3],
    ) -> Result<(BoneModels, ShapeOutcome), RegistrationError> {
        match &observation.shape {
            Shape::Given(models) => Ok((models.clone(), ShapeOutcome::Given)),
            Shape::Estimated {
                femur,
                pelvis_surface,
                nominal,
                annotations,
                recipe,
                ..
            } => {
                let clock = Instant::now();
                let hip = &observation.hip;
                let views: Vec<RegisteredView> = (observation.views.iter())
                    .zip(camera_from_pelvis)
                    .map(|(view, &camera_from_pelvis)| RegisteredView {
                        camera: view.camera,
                        camera_from_pelvis,
                    })
                    .collect();
                let input = ShapeInput {
                    hip,
                    pelvis: pelvis_surface,
                    views: &views,
                    annotations,
                    nominal,
                };
                let mut draws = stream(observation.seed, Purpose::Ransac, &observation.stream_key);
                let plausible = |cuts: &CutPlanes| recipe.plausible(hip, cuts);
                let ransac = &self.parameters.ransac;
                let estimated = estimate_cuts(&input, ransac, &mut draws, plausible);
                let models = (recipe.models(hip, femur, &estimated.cuts))
                    .map_err(failed("shape_estimation"))?;
                let outcome = ShapeOutcome::Estimated {
                    cuts: Box::new(estimated.cuts),
                    ilium_fallback: estimated.ilium_fallback,
                    pubis_fallback: estimated.pubis_fallback,
                    seconds: clock.elapsed().as_secs_f64(),
                };
                Ok((models, outcome))
            }
        }
    }
}

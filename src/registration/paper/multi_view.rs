//! The multi-view, multi-object registration.
//!
//! The pelvis' frame is the world: each view's `camera_from_world` is what its own single-view
//! registration of the pelvis gave. At the coarse level pelvis, femur over it and fragment over
//! both; at the fine level each with the others static, then all 18 parameters.

use super::parameters::{MultiViewParameters, PaperParameters};
use super::single_view::cmaes_parameters;
use super::views::PreparedViews;
use crate::geometry::Rigid;
use crate::objective::Regularization;
use crate::optimize::BoxSearch;
use crate::random::Stream;
use crate::registration::observation::BoneModels;
use crate::registration::outcome::StageRecord;
use crate::registration::pose_space::PoseSpace;
use crate::registration::stage::{BobyqaStage, CmaEsStage};
use crate::registration::strategy::{RegistrationCause, RegistrationError};
use crate::xray::BoneVolume;
use std::sync::Arc;

/// Indices of the objects in this module's arrays.
const PELVIS: usize = 0;
const FEMUR: usize = 1;
const FRAGMENT: usize = 2;

/// The stage names of the coarse and fine sequential stages, by object.
const COARSE: [&str; 3] = [
    "multi_pelvis_cmaes",
    "multi_femur_cmaes",
    "multi_fragment_cmaes",
];
const FINE: [&str; 3] = [
    "multi_pelvis_bobyqa",
    "multi_femur_bobyqa",
    "multi_fragment_bobyqa",
];
const JOINT: &str = "multi_all_bobyqa";

/// Gives `world_from_volume` of pelvis, femur and fragment. `stream` gives the CMA-ES stream of
/// a stage.
pub fn register(
    views: &PreparedViews,
    camera_from_world: &[Rigid; 3],
    models: &BoneModels,
    app_from_volume: Rigid,
    paper: &PaperParameters,
    stream: impl Fn(&str) -> Stream,
    records: &mut Vec<StageRecord>,
) -> Result<[Rigid; 3], RegistrationError> {
    let bones: [&Arc<BoneVolume>; 3] = [&models.pelvis, &models.femur, &models.fragment];
    let own: [&MultiViewParameters; 3] = [&paper.pelvis, &paper.femur, &paper.fragment];
    let space = |start: Rigid| PoseSpace::Anatomical {
        start,
        app_from_volume,
    };
    let failed = |phase| move |cause: RegistrationCause| RegistrationError { phase, cause };
    let placed = |object: usize, pose: Rigid| (Arc::clone(bones[object]), pose);

    let mut poses = [Rigid::identity(); 3];
    for object in [PELVIS, FEMUR, FRAGMENT] {
        let statics = (0..object).map(|o| placed(o, poses[o])).collect();
        let p = own[object];
        // Femur and fragment start at the pelvis' pose.
        let start = poses[PELVIS];
        let result = CmaEsStage {
            name: COARSE[object],
            space: &space(start),
            sd: twist(p.sd_rotation_deg, p.sd_translation_mm),
            regularization: &Regularization::Magnitudes {
                rotation: p.prior_rotation_deg.to_radians(),
                translation: p.prior_translation_mm,
            },
            similarity_weight: paper.similarity_weight,
            parameters: cmaes_parameters(paper, p.population),
        }
        .run(
            &mut views.coarse_scorer(
                camera_from_world,
                &[bones[object]],
                &[start],
                statics,
                paper,
            ),
            stream(COARSE[object]),
        )
        .map_err(failed(COARSE[object]))?;
        poses[object] = result.poses[0];
        records.push(result.record);
    }

    let search = |half_widths: Vec<f64>| BoxSearch {
        half_widths,
        tolerance: paper.multi_view_tolerance,
        max_evaluations: paper.bobyqa_max_evaluations,
    };
    for object in [PELVIS, FEMUR, FRAGMENT] {
        let statics = (0..3)
            .filter(|&o| o != object)
            .map(|o| placed(o, poses[o]))
            .collect();
        let p = own[object];
        let result = BobyqaStage {
            name: FINE[object],
            spaces: &[space(poses[object])],
            search: search(twist(p.box_rotation_deg, p.box_translation_mm).to_vec()),
        }
        .run(&mut views.fine_scorer(
            camera_from_world,
            &[bones[object]],
            &[poses[object]],
            statics,
            paper,
        ))
        .map_err(failed(FINE[object]))?;
        poses[object] = result.poses[0];
        records.push(result.record);
    }

    let half_widths = own
        .iter()
        .flat_map(|p| twist(p.joint_box_rotation_deg, p.joint_box_translation_mm))
        .collect();
    let result = BobyqaStage {
        name: JOINT,
        spaces: &poses.map(space),
        search: search(half_widths),
    }
    .run(&mut views.fine_scorer(camera_from_world, &bones, &poses, Vec::new(), paper))
    .map_err(failed(JOINT))?;
    records.push(result.record);
    Ok([
        result.poses[PELVIS],
        result.poses[FEMUR],
        result.poses[FRAGMENT],
    ])
}

fn twist(rotation_deg: f64, translation_mm: f64) -> [f64; 6] {
    let r = rotation_deg.to_radians();
    [r, r, r, translation_mm, translation_mm, translation_mm]
}

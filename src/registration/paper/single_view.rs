//! Single-view registrations of the pelvis, and the orbital search that starts views 2 and 3.

use super::parameters::{PaperParameters, SingleViewParameters};
use super::views::PreparedViews;
use crate::geometry::{Point, Rigid, Vector};
use crate::objective::{Regularization, Scorer};
use crate::optimize::{BoxSearch, CmaEsParameters};
use crate::random::Stream;
use crate::registration::outcome::StageRecord;
use crate::registration::pose_space::PoseSpace;
use crate::registration::stage::{BobyqaStage, CmaEsStage};
use crate::registration::strategy::{RegistrationCause, RegistrationError};
use crate::xray::{BoneVolume, Orbit};
use std::sync::Arc;
use std::time::Instant;

/// The stage names of one view.
#[derive(Clone, Copy, Debug)]
pub struct ViewStages {
    pub cmaes: &'static str,
    pub bobyqa: &'static str,
}

/// Registers the pelvis to one view: CMA-ES on the coarse image, BOBYQA on the fine one. Gives
/// `camera_from_volume`.
pub fn register_view(
    (views, index): (&PreparedViews, usize),
    pelvis: &Arc<BoneVolume>,
    start: Rigid,
    head: Point,
    parameters: (&PaperParameters, &SingleViewParameters),
    stages: ViewStages,
    stream: Stream,
    records: &mut Vec<StageRecord>,
) -> Result<Rigid, RegistrationError> {
    let (paper, own) = parameters;
    let space = |start: Rigid| PoseSpace::CameraAligned {
        start,
        center: start * head,
    };
    let failed = |phase| move |cause: RegistrationCause| RegistrationError { phase, cause };

    let regularization = Regularization::Components {
        rotation_sd: Vector::from(own.prior_rotation_deg).map(f64::to_radians),
        translation_sd: Vector::from(own.prior_translation_mm),
    };
    let coarse = CmaEsStage {
        name: stages.cmaes,
        space: &space(start),
        sd: twist(own.sd_rotation_deg, own.sd_translation_mm),
        regularization: &regularization,
        similarity_weight: paper.similarity_weight,
        parameters: cmaes_parameters(paper, own.population),
    }
    .run(
        &mut views.coarse_view_scorer(index, pelvis, Some(&start), paper),
        stream,
    )
    .map_err(failed(stages.cmaes))?;
    records.push(coarse.record);

    let half_widths = twist(own.box_rotation_deg, own.box_translation_mm);
    let fine = BobyqaStage {
        name: stages.bobyqa,
        spaces: &[space(coarse.poses[0])],
        search: BoxSearch {
            half_widths: half_widths.to_vec(),
            tolerance: paper.single_view_tolerance,
            max_evaluations: paper.bobyqa_max_evaluations,
        },
    }
    .run(&mut views.fine_view_scorer(index, pelvis, &coarse.poses[0], paper))
    .map_err(failed(stages.bobyqa))?;
    records.push(fine.record);
    Ok(fine.poses[0])
}

/// Finds where on its orbit the C-arm stood for another view: the similarity of the pelvis at
/// every angle of a regular grid about the first view's pose. Gives the best pose and its angle
/// (rad).
pub fn search_orbit(
    (views, index): (&PreparedViews, usize),
    pelvis: &Arc<BoneVolume>,
    first_camera_from_volume: &Rigid,
    orbit: &Orbit,
    paper: &PaperParameters,
    stage: &'static str,
    records: &mut Vec<StageRecord>,
) -> Result<(Rigid, f64), RegistrationError> {
    let clock = Instant::now();
    let angles = orbit_angles(paper);
    let poses: Vec<Rigid> = angles
        .iter()
        .map(|&angle| orbit.turned(angle) * first_camera_from_volume)
        .collect();
    let mut costs = vec![0.0; poses.len()];
    views
        .coarse_view_scorer(index, pelvis, None, paper)
        .similarities(&poses, &mut costs);
    let best = (0..costs.len())
        .filter(|&i| costs[i].is_finite())
        .min_by(|&a, &b| costs[a].total_cmp(&costs[b]))
        .ok_or(RegistrationError {
            phase: stage,
            cause: RegistrationCause::NoFiniteCost,
        })?;
    records.push(StageRecord {
        stage,
        cost: costs[best],
        evaluations: costs.len() as u64,
        capped: false,
        seconds: clock.elapsed().as_secs_f64(),
    });
    Ok((poses[best], angles[best]))
}

/// The angles of the orbital search in rad: 181 with the paper's +-90 deg and 1 deg.
fn orbit_angles(paper: &PaperParameters) -> Vec<f64> {
    let steps = (paper.orbit_range_deg / paper.orbit_step_deg).floor() as i64;
    (-steps..=steps)
        .map(|k| (k as f64 * paper.orbit_step_deg).to_radians())
        .collect()
}

/// CMA-ES parameters of a stage with its own population.
pub fn cmaes_parameters(paper: &PaperParameters, population: usize) -> CmaEsParameters {
    CmaEsParameters {
        population,
        cost_tolerance: paper.cmaes_tolerance,
        max_generations: (paper.cmaes_max_evaluations / population).max(1),
    }
}

fn twist(rotation_deg: [f64; 3], translation_mm: [f64; 3]) -> [f64; 6] {
    let [a, b, c] = rotation_deg.map(f64::to_radians);
    let [x, y, z] = translation_mm;
    [a, b, c, x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_orbit_has_181_poses() {
        let angles = orbit_angles(&PaperParameters::default());
        assert_eq!(angles.len(), 181);
        assert_eq!(angles[90], 0.0);
        assert!((angles[180] - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    }
}

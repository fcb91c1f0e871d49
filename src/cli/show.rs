//! `pao-sim show`: pictures of a case, or of what a registration made of it.

use super::args::Common;
use super::error::{Exit, Failure};
use super::output::say;
use pao_sim::anatomy::Side;
use pao_sim::geometry::Rigid;
use pao_sim::registration::{BoneModels, Outcome, ShapeOutcome};
use pao_sim::report::Picture;
use pao_sim::simulation::Pick;
use pao_sim::study::{
    CaseKey, CaseWorker, RegistrationKey, Scenario, SimulatedCase, Snapshot, StudyFolder, Worker,
};
use pao_sim::surgery::Cut;
use std::path::PathBuf;

/// Draw a case's fluoroscopy with the true bones' outlines, the landmark and the annotated cuts; for
/// a registration's key, with the outlines where it put the bones, the pick it began with, and where
/// that put all bones in the first view (`start.png`).
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The study's folder or its configuration file.
    study: PathBuf,
    /// Key of a case (phantom-1/left/f03/m07) or of a registration
    /// (phantom-1/left/f03/m07/i2/no_cuts_known/paper)
    key: String,
}

/// Colours of pelvis, femur and fragment.
const BONES: [[u8; 3]; 3] = [[0, 200, 255], [255, 220, 0], [255, 60, 200]];
const LANDMARK: [u8; 3] = [0, 255, 0];
const PICK: [u8; 3] = [255, 60, 60];
/// Colours of the ilium and pubis annotations.
const ANNOTATIONS: [[u8; 3]; 2] = [[255, 140, 0], [120, 255, 120]];
/// Pictures are about this many pixels wide.
const WIDTH: usize = 768;

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let registration = match arguments.key.matches('/').count() {
        0..=3 => None,
        _ => Some(arguments.key.parse::<RegistrationKey>()?),
    };
    let case_key = match &registration {
        Some(key) => key.case.clone(),
        None => arguments.key.parse::<CaseKey>()?,
    };
    let snapshot = Snapshot::read(StudyFolder::find(&arguments.study, &common.results)?)?;
    if !snapshot.plan.cases.contains(&case_key) {
        return Err(Failure::NotPlanned(arguments.key.clone()));
    }
    snapshot.select_simd()?;
    let worker = CaseWorker::new(&snapshot.config);
    let case = worker.simulate(&case_key)?;
    let mut poses = true_poses(&case);
    let mut models = case.fragment.models(Scenario::AllCutsKnown)?;
    let (mut pick, mut start) = (None, None);
    if let Some(key) = &registration {
        let of_key = worker.pick(&case, key);
        let outcome = worker.estimate(&case, key, &of_key)?;
        poses = estimated_poses(&outcome);
        start = Some([outcome.initial_camera_from_pelvis; 3]);
        models = used_models(&case, key.scenario, &outcome)?;
        pick = Some(of_key);
    }
    let folder = snapshot
        .folder
        .path()
        .join("show")
        .join(arguments.key.replace('/', "_"));
    std::fs::create_dir_all(&folder).map_err(|cause| Failure::Io {
        action: format!("create {}", folder.display()),
        cause,
    })?;
    let start = start.iter().map(|poses| ("start".to_owned(), 0, poses));
    let end = poses.iter().enumerate();
    let end = end.map(|(view, poses)| (format!("view{}", view + 1), view, poses));
    for (name, view, poses) in start.chain(end) {
        let path = folder.join(format!("{name}.png"));
        draw(&snapshot, &case, view, poses, &models, pick.as_ref()).write(&path)?;
        say!("{}", path.display());
    }
    Ok(Exit::Complete)
}

/// `camera_from_volume` of pelvis, femur and fragment in each view.
type Poses = [[Rigid; 3]; 3];

fn true_poses(case: &SimulatedCase) -> Poses {
    let truth = &case.case.truth;
    let app_from_volume = case.fragment.hip.hip.app_from_volume;
    let moved = |movement: &Rigid| app_from_volume.inverse() * movement * app_from_volume;
    let (femur, fragment) = (
        moved(&truth.movement.femur),
        moved(&truth.movement.fragment),
    );
    truth
        .views
        .camera_from_volume
        .map(|pelvis| [pelvis, pelvis * femur, pelvis * fragment])
}

/// The strategy gives its poses in view 1; its single-view registrations tell where the others are.
fn estimated_poses(outcome: &Outcome) -> Poses {
    let first = outcome.single_view_camera_from_pelvis[0].inverse();
    outcome.single_view_camera_from_pelvis.map(|view| {
        [
            outcome.camera_from_pelvis,
            outcome.camera_from_femur,
            outcome.camera_from_fragment,
        ]
        .map(|pose| view * first * pose)
    })
}

fn used_models(
    case: &SimulatedCase,
    scenario: Scenario,
    outcome: &Outcome,
) -> Result<BoneModels, Failure> {
    let hip = &case.fragment.hip;
    match &outcome.shape {
        ShapeOutcome::Given => Ok(case.fragment.models(scenario)?),
        ShapeOutcome::Estimated { cuts, .. } => Ok(hip.models(cuts)?),
    }
}

fn draw(
    study: &Snapshot,
    case: &SimulatedCase,
    view: usize,
    poses: &[Rigid; 3],
    models: &BoneModels,
    pick: Option<&Pick>,
) -> Picture {
    let camera = study.config.xray.c_arm.camera();
    let reduction = (camera.width / WIDTH).max(1);
    let mut picture = Picture::of_counts(&case.case.counts()[view], &camera, reduction);
    let bones = [&models.pelvis, &models.femur, &models.fragment];
    for ((bone, pose), colour) in bones.into_iter().zip(poses).zip(BONES) {
        picture.outline(bone, pose, colour);
    }
    for annotation in case.case.annotations().iter() {
        if annotation.view == view {
            let colour = ANNOTATIONS[usize::from(annotation.cut == Cut::Pubis)];
            picture.dot(&annotation.pixel, colour);
        }
    }
    let truth = &case.case.truth;
    let landmark = truth.views.camera_from_volume[view] * truth.landmark;
    picture.cross(&camera.project(&landmark), 6, LANDMARK);
    if let (0, Some(pick)) = (view, pick) {
        picture.cross(&pick.pixel, 6, PICK);
    }
    match case.fragment.hip.hip.side {
        Side::Left => picture,
        // The C-arm stands on the other side of the table; people want the head up.
        Side::Right => picture.turned(),
    }
}

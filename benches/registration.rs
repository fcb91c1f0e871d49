//! One whole registration of a phantom on one thread, by both strategies, beside what its evaluations
//! cost by themselves: `cargo bench --bench registration` (two minutes; `ROUNDS`, 5).
//!
//! First each kind of evaluation by itself: milliseconds a candidate of populations of twenty about the
//! poses that the registration ends with, minima over interleaved rounds of processor time. Then the
//! registrations by stage (wall time), and their whole processor time over the sum of evaluations
//! times cost.

mod measure;

use measure::{setting, thread_seconds};
use nalgebra::UnitQuaternion;
use pao_sim::geometry::{Rigid, Vector};
use pao_sim::objective::{CpuScorer, FixedView, Scorer, ScorerParameters, ScorerView};
use pao_sim::registration::{BoneModels, Outcome};
use pao_sim::study::{CaseKey, CaseWorker, Config, RegistrationKey, SimulatedCase, Worker};
use pao_sim::xray::{BoneVolume, ProjectorParameters, pyramid};
use std::path::Path;
use std::sync::Arc;

const CASE: &str = "phantom-1/left/f00/m00";
const STRATEGIES: [(&str, ProjectorParameters); 2] = [
    ("paper", ProjectorParameters::RayCast { step_mm: 1.0 }),
    ("paper_slice", ProjectorParameters::Slice { pitch_px: 1.0 }),
];
const POPULATION: usize = 20;

/// A kind of evaluation: name, the stages that make it, moving objects, static ones, factor, views.
type Kind = (
    &'static str,
    &'static [&'static str],
    &'static [usize],
    &'static [usize],
    f64,
    usize,
);
const KINDS: [Kind; 9] = [
    (
        "pelvis, 1 view, 1/8",
        &[
            "view1_cmaes",
            "view2_search",
            "view2_cmaes",
            "view3_search",
            "view3_cmaes",
        ],
        &[0],
        &[],
        0.125,
        1,
    ),
    (
        "pelvis, 1 view, 1/4",
        &["view1_bobyqa", "view2_bobyqa", "view3_bobyqa"],
        &[0],
        &[],
        0.25,
        1,
    ),
    (
        "pelvis, 3 views, 1/8",
        &["multi_pelvis_cmaes"],
        &[0],
        &[],
        0.125,
        3,
    ),
    (
        "femur, 3 views, 1/8",
        &["multi_femur_cmaes"],
        &[1],
        &[0],
        0.125,
        3,
    ),
    (
        "fragment, 3 views, 1/8",
        &["multi_fragment_cmaes"],
        &[2],
        &[0, 1],
        0.125,
        3,
    ),
    (
        "pelvis, 3 views, 1/4",
        &["multi_pelvis_bobyqa"],
        &[0],
        &[1, 2],
        0.25,
        3,
    ),
    (
        "femur, 3 views, 1/4",
        &["multi_femur_bobyqa"],
        &[1],
        &[0, 2],
        0.25,
        3,
    ),
    (
        "fragment, 3 views, 1/4",
        &["multi_fragment_bobyqa"],
        &[2],
        &[0, 1],
        0.25,
        3,
    ),
    (
        "all, 3 views, 1/4",
        &["multi_all_bobyqa"],
        &[0, 1, 2],
        &[],
        0.25,
        3,
    ),
];

/// Poses about one, turned and shifted as in a population that has half converged.
fn about(pose: &Rigid, n: usize) -> Rigid {
    let draw = |k: usize| ((n * k) as f64).sin();
    let turn = Vector::new(draw(1), draw(2), draw(3)) * 0.03;
    let shift = Vector::new(draw(4), draw(5), draw(6)) * 3.0;
    Rigid::from_parts(
        (pose.translation.vector + shift).into(),
        UnitQuaternion::from_scaled_axis(turn) * pose.rotation,
    )
}

/// The scorer of a kind at the poses that a registration found, and a population for it.
fn scorer(
    kind: &Kind,
    case: &SimulatedCase,
    models: &BoneModels,
    outcome: &Outcome,
    projector: ProjectorParameters,
) -> (CpuScorer, Vec<Rigid>) {
    let (_, _, moving, statics, factor, views) = *kind;
    let first = &outcome.single_view_camera_from_pelvis;
    let world = first[0].inverse();
    let bones: [&Arc<BoneVolume>; 3] = [&models.pelvis, &models.femur, &models.fragment];
    let poses = [
        outcome.camera_from_pelvis,
        outcome.camera_from_femur,
        outcome.camera_from_fragment,
    ]
    .map(|pose| world * pose);
    let camera = pao_sim::xray::Camera::cios_fusion();
    let views = (0..views)
        .map(|view| {
            let counts = &case.case.counts()[view];
            let (image, camera) = pyramid::level(counts, &camera, factor, &Default::default())
                .expect("a simulated image can be reduced");
            let fixed = FixedView::new(image, camera, 83, factor).expect("patches fit the image");
            ScorerView {
                fixed: Arc::new(fixed),
                camera_from_world: first[view],
            }
        })
        .collect();
    let objects = moving.iter().map(|&o| Arc::clone(bones[o])).collect();
    let statics = statics
        .iter()
        .map(|&o| (Arc::clone(bones[o]), poses[o]))
        .collect();
    let start: Vec<Rigid> = moving.iter().map(|&o| poses[o]).collect();
    let parameters = ScorerParameters {
        projector,
        ..ScorerParameters::default()
    };
    let scorer = CpuScorer::new(views, objects, statics, parameters).about(&start);
    // The stages of BOBYQA ask for one candidate at a time.
    let population = if factor == 0.25 { 1 } else { POPULATION };
    let candidates = (0..population).flat_map(|n| start.iter().map(move |pose| about(pose, n)));
    (scorer, candidates.collect())
}

fn main() {
    let text = "[registration.paper]\n[registration.paper_slice]\n";
    let config = Config::parse(text, Path::new("bench.toml"), &|_| None).expect("a configuration");
    let worker = CaseWorker::new(&config);
    let key: CaseKey = CASE.parse().expect("a key");
    let case = worker.simulate(&key).expect("a case");
    let registrations = STRATEGIES.map(|(strategy, projector)| {
        let key: RegistrationKey =
            (format!("{CASE}/i0/all_cuts_known/{strategy}").parse()).expect("a key");
        let pick = worker.pick(&case, &key);
        let start = thread_seconds();
        let outcome = worker.estimate(&case, &key, &pick).expect("an estimate");
        let seconds = thread_seconds() - start;
        (strategy, projector, outcome, seconds)
    });

    let models = case
        .fragment
        .models(pao_sim::study::Scenario::AllCutsKnown)
        .expect("models");
    let mut cases = Vec::new();
    for kind in &KINDS {
        for (strategy, projector, outcome, _) in &registrations {
            let (scorer, candidates) = scorer(kind, &case, &models, outcome, *projector);
            cases.push((kind, *strategy, scorer, candidates, f64::INFINITY));
        }
    }
    for _ in 0..setting("ROUNDS", 5) {
        for (_, _, scorer, candidates, best) in &mut cases {
            let count = candidates.len() / scorer.moving_objects();
            let mut costs = vec![0.0; count];
            let start = thread_seconds();
            let repeats = POPULATION / count;
            for _ in 0..repeats {
                scorer.similarities(candidates, &mut costs);
                std::hint::black_box(&costs);
            }
            let seconds = (thread_seconds() - start) / (count * repeats) as f64;
            *best = best.min(seconds);
        }
    }
    println!("| evaluation | paper (ms) | paper_slice (ms) |\n|---|---|---|");
    for pair in cases.chunks(2) {
        println!(
            "| {} | {:.3} | {:.3} |",
            pair[0].0.0,
            pair[0].4 * 1e3,
            pair[1].4 * 1e3
        );
    }
    for (strategy, _, outcome, seconds) in &registrations {
        println!(
            "\n| {strategy} | evaluations | seconds | at benchmarked cost |\n|---|---|---|---|"
        );
        let mut expected = 0.0;
        for record in &outcome.stages {
            let cost = (cases.iter())
                .find(|(kind, s, ..)| s == strategy && kind.1.contains(&record.stage))
                .map(|(.., cost)| cost * record.evaluations as f64)
                .expect("every stage has a kind of evaluation");
            expected += cost;
            println!(
                "| {} | {} | {:.2} | {cost:.2} |",
                record.stage, record.evaluations, record.seconds
            );
        }
        println!(
            "| processor time, all | | {seconds:.2} | {expected:.2} ({:.2} x) |",
            seconds / expected
        );
    }
}

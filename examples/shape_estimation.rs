//! How near estimated ilium and pubis cuts come to the true ones, without rendering images: random
//! fragments, views and annotations as the study draws them, and poses of the pelvis that are off by
//! drawn amounts. It prints the tables of docs/shape_estimation.md.
//!
//! `cargo run --release --example shape_estimation -- 1 2 3 --fragments 10 --cases 4`
//!
//! A specimen is the number of a phantom, a folder of bone surfaces, or a folder that `pao-sim
//! specimen import` wrote.

mod shared;

use clap::Parser;
use pao_sim::anatomy::{Hip, Label, Side};
use pao_sim::geometry::{Plane, Point, Rigid, Vector};
use pao_sim::random::{Purpose, Stream, stream};
use pao_sim::registration::ModelRecipe;
use pao_sim::shape_estimation::{
    EstimatedCuts, RansacParameters, RegisteredView, ShapeInput, estimate_cuts,
};
use pao_sim::simulation::{AnnotationParameters, CutLines, ViewParameters, Views, pelvis_surface};
use pao_sim::surgery::{
    Cut, CutPlanes, FragmentParameters, FragmentSamplingParameters, NominalCutParameters,
    SurgeryMap, cut_fragment, nominal_cuts, sample_fragment,
};
use pao_sim::volume::{Surface, Volume};
use pao_sim::xray::{Camera, Orbit};
use rand_distr::{Distribution, StandardNormal};
use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

#[derive(Parser)]
struct Arguments {
    /// Phantom numbers, folders of bone surfaces, or specimen folders.
    #[arg(required = true)]
    specimens: Vec<String>,
    /// Random fragments a hip.
    #[arg(long, default_value_t = 10)]
    fragments: usize,
    /// Draws of views, annotations and poses a fragment.
    #[arg(long, default_value_t = 4)]
    cases: usize,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder that keeps the voxels made of surfaces.
    #[arg(long)]
    cache: Option<PathBuf>,
    /// SD of the pose's rotation about each of the camera's axes through the head.
    #[arg(long, default_value_t = 0.25)]
    rotation_sd_deg: f64,
    /// SD of the pose's translation along each of the image's axes.
    #[arg(long, default_value_t = 0.5)]
    in_plane_sd_mm: f64,
    /// SD of the pose's translation in depth.
    #[arg(long, default_value_t = 3.0)]
    depth_sd_mm: f64,
    /// Of the RANSAC, where it shall differ from the default.
    #[arg(long)]
    inlier_mm: Option<f64>,
    #[arg(long)]
    smallest_consensus: Option<f64>,
    /// Name every estimate that is worse than the plan by this angle (degrees).
    #[arg(long)]
    worse_deg: Option<f64>,
}

/// The cuts that are estimated.
const ESTIMATED: [Cut; 2] = [Cut::Ilium, Cut::Pubis];

/// How far a plane is from the true cut.
#[derive(Clone, Copy)]
struct PlaneError {
    angle_deg: f64,
    /// Mean distance of the true line's points from the plane.
    distance_mm: f64,
}

/// One estimate beside what it replaces.
struct Estimate {
    /// Of the ilium and the pubis cut.
    planned: [PlaneError; 2],
    estimated: [PlaneError; 2],
    fallback: [Option<String>; 2],
    /// Dice coefficients with the true fragment: planned cuts, estimated ones, true ilium and pubis
    /// with planned ischium and posterior. None where the cuts free no fragment.
    dice: [Option<f64>; 3],
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let mut groups: Vec<(String, Vec<Estimate>)> = Vec::new();
    for name in &arguments.specimens {
        let specimen = Arc::new(shared::specimen(name, arguments.cache.as_deref())?);
        for side in Side::BOTH {
            let hip = Hip::new(specimen.clone(), side)?;
            match estimates(&hip, &arguments) {
                Ok(found) => groups.push((hip.key(), found)),
                // A hip without plausible cuts is left out and named.
                Err(error) => eprintln!("{}: {error}", hip.key()),
            }
        }
    }
    let all: Vec<&Estimate> = groups.iter().flat_map(|(_, found)| found).collect();
    for (c, cut) in ESTIMATED.into_iter().enumerate() {
        println!("\n## {} cut\n", cut.name());
        println!(
            "| hip | n | plan deg | plan mm | estimate deg | estimate mm | median | 90 % | over 10 deg | over 5 mm | no estimate |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|");
        for (name, found) in &groups {
            cut_row(name, &found.iter().collect::<Vec<_>>(), c);
        }
        cut_row("all", &all, c);
    }
    println!("\n## Dice coefficient with the true fragment\n");
    println!("| hip | planned | estimated | true ilium and pubis | estimate below plan |");
    println!("|---|---|---|---|---|");
    for (name, found) in &groups {
        dice_row(name, &found.iter().collect::<Vec<_>>());
    }
    dice_row("all", &all);
    println!("\n## Why no estimate\n");
    let mut reasons = std::collections::BTreeMap::<String, usize>::new();
    for (c, cut) in ESTIMATED.into_iter().enumerate() {
        for reason in all.iter().filter_map(|e| e.fallback[c].as_ref()) {
            // Numbers differ from case to case.
            let kind = reason.replace(|c: char| c.is_ascii_digit(), "");
            *reasons
                .entry(format!("{}: {kind}", cut.name()))
                .or_default() += 1;
        }
    }
    for (reason, count) in reasons {
        println!("- {count} x {reason}");
    }
    Ok(())
}

/// The estimates of one hip.
fn estimates(hip: &Hip, arguments: &Arguments) -> Result<Vec<Estimate>, Box<dyn Error>> {
    let nominal = nominal_cuts(hip, &NominalCutParameters::default())?;
    let pelvis = pelvis_surface(hip);
    let mut found = Vec::new();
    for f in 0..arguments.fragments {
        let key = format!("{}/f{f:02}", hip.key());
        let parameters = FragmentSamplingParameters::default();
        let (map, _) = sample_fragment(hip, &nominal, &parameters, arguments.seed, &key)?;
        let lines = CutLines::new(hip, &pelvis, &map);
        let with_true = ESTIMATED
            .into_iter()
            .fold(nominal, |cuts, cut| cuts.with(cut, *map.cuts.get(cut)));
        let planned_dice = dice(hip, &nominal, &map);
        let known_dice = dice(hip, &with_true, &map);
        for m in 0..arguments.cases {
            let key = format!("{key}/m{m:02}");
            let estimated = estimate(hip, &pelvis, &nominal, &lines, arguments, &key);
            let errors =
                |cuts: &CutPlanes| ESTIMATED.map(|cut| error(hip, &lines, cuts, &map, cut));
            let result = Estimate {
                planned: errors(&nominal),
                estimated: errors(&estimated.cuts),
                dice: [planned_dice, dice(hip, &estimated.cuts, &map), known_dice],
                fallback: [estimated.ilium_fallback, estimated.pubis_fallback],
            };
            for c in 0..2 {
                let (planned, got) = (result.planned[c].angle_deg, result.estimated[c].angle_deg);
                if arguments
                    .worse_deg
                    .is_some_and(|worse| got > planned + worse)
                {
                    let cut = ESTIMATED[c].name();
                    eprintln!("{key} {cut}: estimate {got:.1} deg, plan {planned:.1} deg");
                }
                if let Some(reason) = &result.fallback[c] {
                    eprintln!("{key} {}: {reason}", ESTIMATED[c].name());
                }
            }
            found.push(result);
        }
    }
    Ok(found)
}

/// What the strategy would make of one case's annotations.
fn estimate(
    hip: &Hip,
    pelvis: &Surface,
    nominal: &CutPlanes,
    lines: &CutLines<'_>,
    arguments: &Arguments,
    key: &str,
) -> EstimatedCuts {
    let camera = Camera::cios_fusion();
    let draws = |purpose: Purpose, key: &str| stream(arguments.seed, purpose, key);
    let truth = Views::sample(
        hip,
        &camera,
        &Orbit::cios_fusion(),
        &ViewParameters::default(),
        &mut draws(Purpose::Views, key),
    );
    let annotations: Vec<_> = (0..3)
        .flat_map(|view| {
            let mut draws = draws(Purpose::Annotation, &format!("{key}/{view}"));
            let pose = &truth.camera_from_volume[view];
            let parameters = AnnotationParameters::default();
            lines.annotate(view, &camera, pose, &parameters, &mut draws)
        })
        .collect();
    // No optimizer runs here, so that its stream is free for the errors it would leave.
    let mut errors = draws(Purpose::Optimizer, key);
    let views = truth.camera_from_volume.map(|pose| RegisteredView {
        camera,
        camera_from_pelvis: off(&pose, &hip.head(), arguments, &mut errors),
    });
    let input = ShapeInput {
        hip,
        pelvis,
        views: &views,
        annotations: &annotations,
        nominal,
    };
    let default = RansacParameters::default();
    let ransac = RansacParameters {
        inlier_mm: arguments.inlier_mm.unwrap_or(default.inlier_mm),
        smallest_consensus: (arguments.smallest_consensus).unwrap_or(default.smallest_consensus),
        ..default
    };
    let recipe = ModelRecipe::default();
    let mut draws = draws(Purpose::Ransac, key);
    estimate_cuts(&input, &ransac, &mut draws, |cuts| {
        recipe.plausible(hip, cuts)
    })
}

/// A pose as a single-view registration might leave it: turned about the head and moved, in the
/// camera's axes, by independent normal amounts.
fn off(pose: &Rigid, head: &Point, arguments: &Arguments, stream: &mut Stream) -> Rigid {
    let mut normal = |sd: f64| -> f64 {
        let z: f64 = StandardNormal.sample(stream);
        sd * z
    };
    let rotation = arguments.rotation_sd_deg.to_radians();
    let turn = Vector::from_fn(|_, _| normal(rotation));
    let shift = Vector::new(
        normal(arguments.in_plane_sd_mm),
        normal(arguments.in_plane_sd_mm),
        normal(arguments.depth_sd_mm),
    );
    let center = Rigid::from_parts((pose * head).coords.into(), Default::default());
    center * Rigid::new(shift, turn) * center.inverse() * pose
}

fn error(
    hip: &Hip,
    lines: &CutLines<'_>,
    cuts: &CutPlanes,
    map: &SurgeryMap,
    cut: Cut,
) -> PlaneError {
    let (plane, truth): (&Plane, &Plane) = (cuts.get(cut), map.cuts.get(cut));
    let angle = plane
        .normal
        .cross(&truth.normal)
        .norm()
        .atan2(plane.normal.dot(&truth.normal));
    let points = lines.points(cut);
    let distance = |p: &Point| plane.signed_distance(&(hip.app_from_volume * p)).abs();
    PlaneError {
        angle_deg: angle.to_degrees(),
        distance_mm: points.iter().map(distance).sum::<f64>() / points.len() as f64,
    }
}

/// Dice coefficient of the fragment that cuts free with the true one.
fn dice(hip: &Hip, cuts: &CutPlanes, truth: &SurgeryMap) -> Option<f64> {
    let map = cut_fragment(hip, cuts, &FragmentParameters::default()).ok()?;
    let is = |volume: &Volume<u8>, o: usize| volume.data[o] == Label::Fragment.value();
    let (mut both, mut sum) = (0usize, 0usize);
    for o in 0..map.labels.data.len() {
        let (a, b) = (is(&map.labels, o), is(&truth.labels, o));
        both += usize::from(a && b);
        sum += usize::from(a) + usize::from(b);
    }
    Some(2.0 * both as f64 / sum as f64)
}

fn cut_row(name: &str, found: &[&Estimate], c: usize) {
    let n = found.len();
    let of =
        |get: &dyn Fn(&Estimate) -> f64| -> Vec<f64> { found.iter().map(|e| get(e)).collect() };
    let angle = of(&|e| e.estimated[c].angle_deg);
    let distance = of(&|e| e.estimated[c].distance_mm);
    let share = |count: usize| format!("{:.1} %", 100.0 * count as f64 / n as f64);
    println!(
        "| {name} | {n} | {} | {} | {} | {} | {:.1}, {:.1} | {:.1}, {:.1} | {} | {} | {} |",
        mean_and_sd(&of(&|e| e.planned[c].angle_deg)),
        mean_and_sd(&of(&|e| e.planned[c].distance_mm)),
        mean_and_sd(&angle),
        mean_and_sd(&distance),
        quantile(&angle, 0.5),
        quantile(&distance, 0.5),
        quantile(&angle, 0.9),
        quantile(&distance, 0.9),
        share(angle.iter().filter(|&&a| a > 10.0).count()),
        share(distance.iter().filter(|&&d| d > 5.0).count()),
        share(found.iter().filter(|e| e.fallback[c].is_some()).count()),
    );
}

fn dice_row(name: &str, found: &[&Estimate]) {
    let of = |k: usize| -> Vec<f64> { found.iter().filter_map(|e| e.dice[k]).collect() };
    let worse = found.iter().filter(|e| e.dice[1] < e.dice[0]).count();
    println!(
        "| {name} | {} | {} | {} | {:.1} % |",
        mean_and_sd(&of(0)),
        mean_and_sd(&of(1)),
        mean_and_sd(&of(2)),
        100.0 * worse as f64 / found.len() as f64,
    );
}

fn mean_and_sd(values: &[f64]) -> String {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    format!("{mean:.2} ± {:.2}", variance.sqrt())
}

fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * q).round() as usize]
}

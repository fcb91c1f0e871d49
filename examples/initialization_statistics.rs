//! How far single-landmark initializations put the pelvis from where it is: views and picks as the
//! study draws them, without images. It prints the tables of docs/initialization.md.
//!
//! `cargo run --release --example initialization_statistics -- 1 2 3 --draws 3000`
//!
//! A specimen is the number of a phantom, a folder of bone surfaces, or a folder that `pao-sim
//! specimen import` wrote.

mod shared;

use clap::Parser;
use pao_sim::anatomy::{Hip, Landmark, Side};
use pao_sim::geometry::{Point, PoseError, Vector};
use pao_sim::random::{Purpose, stream};
use pao_sim::registration::PaperParameters;
use pao_sim::registration::paper::from_single_landmark;
use pao_sim::simulation::pick::{Pick, PickParameters};
use pao_sim::simulation::{ViewParameters, Views};
use pao_sim::xray::{Camera, Orbit};
use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

#[derive(Parser)]
struct Arguments {
    /// Phantom numbers, folders of bone surfaces, or specimen folders.
    #[arg(required = true)]
    specimens: Vec<String>,
    /// Draws of a first view and a pick for each hip.
    #[arg(long, default_value_t = 3000)]
    draws: usize,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder that keeps the voxels made of surfaces.
    #[arg(long)]
    cache: Option<PathBuf>,
}

/// What is drawn, and what the initialization assumes.
#[derive(Clone)]
struct Setting {
    name: String,
    views: ViewParameters,
    pick: PickParameters,
    depth: f64,
    /// The hips are looked at as if their landmark lay this far in front of the head (mm).
    landmark_ap_mm: Option<f64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let mut hips = Vec::new();
    for name in &arguments.specimens {
        let specimen = Arc::new(shared::specimen(name, arguments.cache.as_deref())?);
        for side in Side::BOTH {
            hips.push(Hip::new(specimen.clone(), side)?);
        }
    }
    let study = Setting {
        name: "as the study draws".into(),
        views: ViewParameters::default(),
        pick: PickParameters::default(),
        depth: PaperParameters::default().landmark_depth,
        landmark_ap_mm: None,
    };
    println!("## Offset of the pelvis, by hip\n");
    println!(
        "| hip | MOF medial, inferior, anterior of the head mm | rotation deg | translation mm |"
    );
    println!("|---|---|---|---|");
    let mut places = Vec::new();
    for hip in &hips {
        let mof = landmark(hip, None)?;
        let place = [-mof.x * hip.side.lateral_sign(), -mof.y, mof.z];
        places.push(place);
        let offsets = offsets(std::slice::from_ref(hip), &study, &arguments)?;
        let place = place.map(|mm| format!("{mm:.1}")).join(", ");
        println!("| {} | {place} | {} |", hip.key(), summary(&offsets));
    }
    let n = places.len() as f64;
    let mean: [f64; 3] = std::array::from_fn(|k| places.iter().map(|p| p[k]).sum::<f64>() / n);
    let mean = mean.map(|mm| format!("{mm:.1}")).join(", ");
    let all = offsets(&hips, &study, &arguments)?;
    println!("| all | {mean} | {} |", summary(&all));
    println!("| published | | 5.15 ± 2.84 | 22.50 ± 5.74 |");

    println!("\n## By axis, all hips\n");
    println!("| translation of the head, APP | mean ± SD mm |\n|---|---|");
    for (k, axis) in ["medial", "inferior", "posterior"].into_iter().enumerate() {
        let values: Vec<f64> = all.iter().map(|o| o.axes_mm[k]).collect();
        println!("| {axis} | {} |", mean_and_sd(&values));
    }

    println!("\n## What makes the offset, all hips\n");
    println!("| | rotation deg | translation mm |\n|---|---|---|");
    for setting in variants(&study) {
        let offsets = offsets(&hips, &setting, &arguments)?;
        println!("| {} | {} |", setting.name, summary(&offsets));
    }
    Ok(())
}

/// The study's setting, with one thing changed at a time.
fn variants(study: &Setting) -> Vec<Setting> {
    let exact = PickParameters {
        point_sd_mm: 0.0,
        pixel_sd_px: 0.0,
    };
    let still = ViewParameters {
        first_rotation_deg: 0.0,
        first_translation_mm: 0.0,
        ..study.views.clone()
    };
    let named = |name: &str| Setting {
        name: name.into(),
        ..study.clone()
    };
    let mut all = vec![
        study.clone(),
        Setting {
            pick: exact.clone(),
            ..named("exact picks")
        },
        Setting {
            views: still.clone(),
            ..named("exact AP view")
        },
        Setting {
            views: still,
            pick: exact,
            ..named("exact AP view and picks: the assumed depth alone")
        },
    ];
    for depth in [0.83, 0.84, 0.86] {
        all.push(Setting {
            depth,
            ..named(&format!(
                "landmark assumed at {} %",
                (100.0 * depth).round()
            ))
        });
    }
    for mm in [20.0, 25.0, 30.0, 35.0, 40.0] {
        all.push(Setting {
            landmark_ap_mm: Some(mm),
            ..named(&format!("MOF {mm} mm in front of the head"))
        });
    }
    all
}

/// How far one initialization put the pelvis from its true place.
struct Offset {
    rotation_deg: f64,
    translation_mm: f64,
    /// Translation of the head along medial, inferior and posterior.
    axes_mm: [f64; 3],
}

fn offsets(
    hips: &[Hip],
    setting: &Setting,
    arguments: &Arguments,
) -> Result<Vec<Offset>, Box<dyn Error>> {
    let (camera, orbit) = (Camera::cios_fusion(), Orbit::cios_fusion());
    let mut found = Vec::new();
    for hip in hips {
        let app = hip.app_from_volume;
        let point = app.inverse() * landmark(hip, setting.landmark_ap_mm)?;
        let s = hip.side.lateral_sign();
        for draw in 0..arguments.draws {
            let key = format!("{}/{draw}", hip.key());
            let draws = |purpose: Purpose| stream(arguments.seed, purpose, &key);
            let views = Views::sample(
                hip,
                &camera,
                &orbit,
                &setting.views,
                &mut draws(Purpose::Views),
            );
            let truth = views.camera_from_volume[0];
            let pixel = camera.project(&(truth * point));
            let pick = Pick::sample(&point, &pixel, &setting.pick, &mut draws(Purpose::Pick));
            let pose = from_single_landmark(hip, &camera, &pick.point, &pick.pixel, setting.depth);
            // As a row of a study has it: the movement of the pelvis in its own APP.
            let error = PoseError::of(&(app * truth.inverse() * pose * app.inverse()));
            let t: Vector = error.translation_axes_mm;
            found.push(Offset {
                rotation_deg: error.rotation_deg,
                translation_mm: error.translation_mm,
                axes_mm: [-t.x * s, -t.y, -t.z],
            });
        }
    }
    Ok(found)
}

/// The ipsilateral MOF in the APP, moved to a given distance in front of the head if there is one.
fn landmark(hip: &Hip, ap_mm: Option<f64>) -> Result<Point, Box<dyn Error>> {
    let p = hip.app_from_volume * hip.landmark(Landmark::Mof)?;
    Ok(Point::new(p.x, p.y, ap_mm.unwrap_or(p.z)))
}

fn summary(offsets: &[Offset]) -> String {
    let rotation: Vec<f64> = offsets.iter().map(|o| o.rotation_deg).collect();
    let translation: Vec<f64> = offsets.iter().map(|o| o.translation_mm).collect();
    format!("{} | {}", mean_and_sd(&rotation), mean_and_sd(&translation))
}

fn mean_and_sd(values: &[f64]) -> String {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    format!("{mean:.2} ± {:.2}", variance.sqrt())
}

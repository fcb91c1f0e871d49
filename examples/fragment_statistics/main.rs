//! Nominal cuts and random fragments of each hip: clearances, volumes, acceptance and rejections by
//! cause, and pictures of the fragments. It prints the tables of docs/surgery.md.
//!
//! `cargo run --release --example fragment_statistics -- 1 2 --fragments 15 --pictures results/fragments`
//!
//! A specimen is the number of a phantom, a specimen's folder, or a folder of bone surfaces.

mod picture;
#[path = "../shared/mod.rs"]
mod shared;

use clap::Parser;
use pao_sim::anatomy::{Hip, Side};
use pao_sim::surgery::{
    Cut, FragmentSamplingParameters, NominalCutParameters, OsteotomySite, Rejection,
    RejectionCounts, nominal_cuts, plausible_fragment, sample_fragment,
};
use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

#[derive(Parser)]
struct Arguments {
    /// Phantom numbers, specimens' folders, or folders of bone surfaces.
    #[arg(required = true)]
    specimens: Vec<String>,
    /// Random fragments a hip.
    #[arg(long, default_value_t = 15)]
    fragments: usize,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for pictures of each hip's nominal and first random fragments.
    #[arg(long)]
    pictures: Option<PathBuf>,
    /// Folder that keeps specimens made from surfaces.
    #[arg(long)]
    cache: Option<PathBuf>,
}

/// Random fragments that are drawn as pictures, a hip.
const PICTURES: usize = 3;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    println!(
        "| hip | clearance ilium, ischium, posterior, pubis mm | column mm | turned deg | nominal cm^3 \
         | random cm^3 | accepted | too close ilium, ischium, posterior, pubis | holds a landmark \
         | ring broken | other |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for name in &arguments.specimens {
        let start = Instant::now();
        let specimen = Arc::new(shared::specimen(name, arguments.cache.as_deref())?);
        eprintln!("{name}: specimen in {:.1} s", start.elapsed().as_secs_f64());
        for side in Side::BOTH {
            let hip = Hip::new(specimen.clone(), side)?;
            let start = Instant::now();
            match row(&hip, &arguments) {
                Ok(row) => println!("{row}"),
                Err(error) => println!("| {} | {error} |", hip.key()),
            }
            eprintln!("{}: {:.1} s", hip.key(), start.elapsed().as_secs_f64());
        }
    }
    Ok(())
}

fn row(hip: &Hip, arguments: &Arguments) -> Result<String, Box<dyn Error>> {
    let parameters = FragmentSamplingParameters::default();
    let site = OsteotomySite::of(hip)?;
    let cuts = nominal_cuts(hip, &NominalCutParameters::default())?;
    let clearances = Cut::ALL.map(|cut| site.acetabulum.clearance_mm(cuts.get(cut)));
    let posterior = cuts.get(Cut::Posterior).normal;
    let column = site.column.border.iter();
    let column_mm = column
        .map(|p| cuts.get(Cut::Posterior).signed_distance(&(*p).into()))
        .fold(f64::INFINITY, f64::min);

    let rules = &parameters.plausibility;
    let found = plausible_fragment(hip, &site, &cuts, &parameters.fragment, rules)?;
    let nominal = match found {
        Ok(carving) => {
            let map = carving.into_map(hip, &cuts);
            if let Some(folder) = &arguments.pictures {
                picture::draw(hip, &map, folder, "nominal")?;
            }
            format!("{:.0}", map.fragment_cm3())
        }
        Err(rejection) => rejection.to_string(),
    };

    let mut counts = RejectionCounts::default();
    let mut volumes = Vec::new();
    for f in 0..arguments.fragments {
        let key = format!("{}/f{f:02}", hip.key());
        let (map, rejected) = sample_fragment(hip, &cuts, &parameters, arguments.seed, &key)?;
        counts.merge(&rejected);
        volumes.push(map.fragment_cm3());
        if let Some(folder) = arguments.pictures.as_ref().filter(|_| f < PICTURES) {
            picture::draw(hip, &map, folder, &format!("f{f:02}"))?;
        }
    }
    let draws = volumes.len() + counts.total();
    let smallest = volumes.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = volumes.iter().copied().fold(0.0, f64::max);
    let mean = volumes.iter().sum::<f64>() / volumes.len() as f64;
    let count = |of: &dyn Fn(Rejection) -> bool| -> usize {
        counts.iter().filter(|c| of(c.0)).map(|c| c.1).sum()
    };
    let close = Cut::ALL.map(|cut| count(&|r| r == Rejection::TooClose(cut)));
    let landmark = count(&|r| matches!(r, Rejection::HoldsLandmark(_)));
    let ring = count(&|r| r == Rejection::RingBroken);
    Ok(format!(
        "| {} | {} | {column_mm:.1} | {:.0} | {nominal} | {mean:.0} ({smallest:.0} to {largest:.0}) \
         | {} of {draws} ({:.0} %) | {} | {landmark} | {ring} | {} |",
        hip.key(),
        clearances.map(|c| format!("{c:.1}")).join(", "),
        posterior.y.atan2(-posterior.z).to_degrees(),
        volumes.len(),
        100.0 * volumes.len() as f64 / draws as f64,
        close.map(|c| c.to_string()).join(", "),
        counts.total() - close.iter().sum::<usize>() - landmark - ring,
    ))
}

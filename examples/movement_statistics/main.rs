//! Statistics of random movements: means, rejections by cause and by size, and where fragments
//! collide. It prints the tables of docs/movements.md.
//!
//! `cargo run --release --example movement_statistics -- 1 2 --fragments 15 --out results/movements/phantom`
//!
//! A specimen is the number of a phantom, a specimen's folder, or a folder of bone surfaces. Every
//! draw of a hip goes to `<out>/<hip>.csv`; hips whose table is there are not drawn again, and the
//! printed tables are of all that lie in the folder.

mod draws;
mod femur;
#[path = "../shared/mod.rs"]
mod shared;
mod slices;
mod summary;
mod voxels;

use clap::Parser;
use pao_sim::anatomy::{Hip, Side};
use pao_sim::surgery::{CollisionModel, CollisionParameters};
use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

#[derive(Parser)]
struct Arguments {
    /// Phantom numbers, specimens' folders, or folders of bone surfaces.
    specimens: Vec<String>,
    /// Random fragments a hip; 0 takes the nominal one.
    #[arg(long, default_value_t = 0)]
    fragments: usize,
    /// Movements a fragment.
    #[arg(long, default_value_t = 20)]
    movements: usize,
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How deep bones may overlap (mm).
    #[arg(long, default_value_t = 0.5)]
    tolerance_mm: f64,
    /// Also asks the test on voxels of the authors' public program.
    #[arg(long)]
    voxel_test: bool,
    /// Prints how near each hip's femur lies to the ischium and where the two meet, and draws nothing.
    #[arg(long)]
    femur: bool,
    /// Folder of the tables.
    #[arg(long)]
    out: PathBuf,
    /// Folder for slices through each hip's first fragment.
    #[arg(long)]
    pictures: Option<PathBuf>,
    /// Folder that keeps specimens made from surfaces.
    #[arg(long)]
    cache: Option<PathBuf>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    std::fs::create_dir_all(&arguments.out)?;
    let plan = draws::Plan {
        fragments: arguments.fragments,
        movements: arguments.movements,
        seed: arguments.seed,
        collision: CollisionParameters {
            tolerance_mm: arguments.tolerance_mm,
            ..Default::default()
        },
        voxel_test: arguments.voxel_test,
    };
    if arguments.femur {
        println!("| hip | gap mm | overlap on the pelvis | overlap on the femur |");
        println!("|---|---|---|---|");
    }
    for name in &arguments.specimens {
        let specimen = Arc::new(shared::specimen(name, arguments.cache.as_deref())?);
        for side in Side::BOTH {
            let hip = Hip::new(specimen.clone(), side)?;
            if arguments.femur {
                println!("{}", femur::row(&hip, &plan.collision, plan.seed)?);
                continue;
            }
            let file = format!("{}.csv", hip.key().replace('/', "-"));
            let table = arguments.out.join(file);
            if !table.exists() {
                draws::write(&table, &draws::draws_of(&hip, &plan)?)?;
            }
            if let Some(folder) = &arguments.pictures {
                let map = draws::surgery(&hip, &plan, 0)?;
                let model = CollisionModel::new(&hip, &map.labels, &plan.collision)?;
                slices::draw(&hip, &model, &map, folder, plan.seed)?;
            }
        }
    }
    if arguments.femur {
        return Ok(());
    }
    let mut tables: Vec<PathBuf> = std::fs::read_dir(&arguments.out)?
        .map(|entry| Ok(entry?.path()))
        .collect::<std::io::Result<_>>()?;
    tables.retain(|path| path.extension().is_some_and(|e| e == "csv"));
    tables.sort();
    let mut all = Vec::new();
    for table in &tables {
        all.extend(draws::read(table)?);
    }
    summary::print(&all);
    Ok(())
}

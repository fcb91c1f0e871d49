//! AP radiographs of phantoms, as docs/phantom.md shows them (bone is bright), and their CT volumes.
//!
//! `cargo run --release --example phantom_radiographs -- docs/pictures 1 2 3 4 5 6`

use clap::Parser;
use pao_sim::anatomy::disk::write_specimen;
use pao_sim::anatomy::phantom::{PhantomParameters, phantom};
use pao_sim::anatomy::{Hip, Side, Specimen};
use pao_sim::image::Image;
use pao_sim::simulation::views::{ViewParameters, ap_view};
use pao_sim::volume::Volume;
use pao_sim::xray::{AttenuationParameters, Camera, reference};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::Arc;

#[derive(Parser)]
struct Arguments {
    /// Folder for `phantom-<number>.png`.
    folder: PathBuf,
    /// Numbers of phantoms.
    #[arg(required = true)]
    numbers: Vec<u32>,
    /// Write the specimens as well, each into a folder in this one.
    #[arg(long)]
    specimens: Option<PathBuf>,
}

/// Pixels of 0.75 mm on the detector: 360 mm of the patient across.
const SIZE: usize = 600;
const PIXEL_MM: f64 = 0.75;
const SOURCE_DETECTOR_MM: f64 = 1150.0;
/// Above the middle between the femoral heads, where the central ray passes.
const SUPERIOR_MM: f64 = 35.0;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    std::fs::create_dir_all(&arguments.folder)?;
    for &number in &arguments.numbers {
        let specimen = phantom(number, &PhantomParameters::default());
        if let Some(folder) = &arguments.specimens {
            write_specimen(&specimen, &folder.join(&specimen.name))?;
        }
        let path = arguments.folder.join(format!("{}.png", specimen.name));
        write(&radiograph(specimen)?, &path)?;
        println!("{}", path.display());
    }
    Ok(())
}

/// Line integrals of the whole body, the camera in front of the anterior pelvic plane.
fn radiograph(specimen: Specimen) -> Result<Image<f64>, Box<dyn Error>> {
    let specimen = Arc::new(specimen);
    let left = Hip::new(specimen.clone(), Side::Left)?;
    let right = Hip::new(specimen.clone(), Side::Right)?;
    let apart = left.app_from_volume * right.app_from_volume.inverse();
    let views = ViewParameters {
        medial_offset_mm: 0.5 * apart.translation.vector.norm(),
        superior_offset_mm: SUPERIOR_MM,
        ..Default::default()
    };
    let camera = Camera::centered(SIZE, PIXEL_MM, SOURCE_DETECTOR_MM);
    let camera_from_volume = ap_view(&left, &camera, &views) * left.app_from_volume;
    let mu = AttenuationParameters::default();
    let ct = &specimen.ct;
    let body = ct.data.iter().map(|&hu| mu.mu(f32::from(hu))).collect();
    let body = Volume::new(ct.grid.clone(), body);
    Ok(reference::line_integrals(
        &body,
        &camera,
        &camera_from_volume,
        1.0,
    ))
}

/// Grey from the lowest to the highest 0.5 %.
fn write(lines: &Image<f64>, path: &Path) -> Result<(), Box<dyn Error>> {
    let mut sorted = lines.data.clone();
    sorted.sort_by(f64::total_cmp);
    let cut = sorted.len() / 200;
    let (low, high) = (sorted[cut], sorted[sorted.len() - 1 - cut]);
    let grey = |line: &f64| (255.0 * ((line - low) / (high - low)).clamp(0.0, 1.0)) as u8;
    let bytes: Vec<u8> = lines.data.iter().map(grey).collect();
    let file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let mut encoder = png::Encoder::new(file, lines.width as u32, lines.height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.write_header()?.write_image_data(&bytes)?;
    Ok(())
}

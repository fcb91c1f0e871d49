//! Writes the CT of a DICOM series as NIfTI: `cargo run --release --example dicom_to_nifti -- FOLDER CT.nii.gz [UID]`.

use pao_sim::volume::{read_dicom_series, read_dicom_series_of, write_nifti};
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [folder, out, series @ ..] = arguments.as_slice() else {
        return Err("expected FOLDER CT.nii.gz [SERIES]".into());
    };
    let start = Instant::now();
    let volume = match series.first() {
        Some(uid) => read_dicom_series_of(Path::new(folder), uid)?,
        None => read_dicom_series(Path::new(folder))?,
    };
    println!(
        "{:?} read in {:.3} s",
        volume.grid.dims,
        start.elapsed().as_secs_f64()
    );
    write_nifti(&volume, Path::new(out))?;
    Ok(())
}

//! Prints what `scripts/check_readers.py` compares with SimpleITK: a JSON line for each volume.
//!
//! `cargo run --release --example volume_summary -- FILE... > results/volumes.jsonl`

use pao_sim::volume::{Volume, read_volume};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for argument in std::env::args().skip(1) {
        let path = std::fs::canonicalize(Path::new(&argument))?;
        let volume: Volume<i16> = read_volume(&path)?;
        let affine = volume.grid.world_from_index();
        let affine = affine.matrix();
        let rows: Vec<Vec<f64>> = (0..3)
            .map(|r| affine.row(r).iter().copied().collect())
            .collect();
        let bytes: Vec<u8> = volume.data.iter().flat_map(|v| v.to_le_bytes()).collect();
        let line = serde_json::json!({
            "file": path,
            "dims": volume.grid.dims,
            "lps_from_index": rows,
            "crc32_of_i16": crc32fast::hash(&bytes),
        });
        println!("{line}");
    }
    Ok(())
}

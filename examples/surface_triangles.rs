//! Writes the triangles of surfaces as they are read, for `scripts/check_surfaces.py`.
//!
//! `cargo run --release --example surface_triangles -- OUT FOLDER...`
//!
//! Of each bone in each folder: OUT/FOLDER_BONE.f64, nine numbers a triangle (its corners in LPS, mm), 64 bits,
//! little-endian.

use pao_sim::anatomy::surfaces::{BONES, read_bone_surfaces};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let out = arguments.next().ok_or("say where to write")?;
    for folder in arguments {
        let folder = Path::new(&folder);
        let name = folder.file_name().ok_or("a folder has a name")?;
        let bones = read_bone_surfaces(folder)?;
        let surfaces = [&bones.sacrum]
            .into_iter()
            .chain(&bones.hips)
            .chain(&bones.femurs);
        for (surface, bone) in surfaces.zip(BONES) {
            let corners = surface.triangles().iter().flatten();
            let numbers = corners.flat_map(|&v| {
                let at = surface.vertices()[v as usize];
                [at.x, at.y, at.z]
            });
            let bytes: Vec<u8> = numbers.flat_map(f64::to_le_bytes).collect();
            let file = format!("{}_{bone}.f64", name.to_string_lossy());
            std::fs::write(Path::new(&out).join(file), bytes)?;
        }
    }
    Ok(())
}

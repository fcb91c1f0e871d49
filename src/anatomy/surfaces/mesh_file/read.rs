//! A file of any of the formats to a closed surface.

use super::super::error::ImportError;
use super::mesh::Mesh;
use super::{obj, ply, stl, vtk};
use crate::anatomy::PatientFrame;
use crate::volume::Surface;
use std::path::Path;

/// A reason longer than this quotes half a file.
const MAX_REASON: usize = 300;

/// The formats of surfaces that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    Ply,
    Stl,
    Vtk,
    Obj,
}

impl MeshFormat {
    pub const ALL: [Self; 4] = [Self::Ply, Self::Stl, Self::Vtk, Self::Obj];

    /// What a file's name ends with, after the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::Stl => "stl",
            Self::Vtk => "vtk",
            Self::Obj => "obj",
        }
    }

    /// The format of a file with this name, in letters of either case.
    pub fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Self::ALL.into_iter().find(|f| f.extension() == extension)
    }

    /// Its name in messages.
    fn name(self) -> &'static str {
        match self {
            Self::Ply => "PLY",
            Self::Stl => "STL",
            Self::Vtk => "VTK",
            Self::Obj => "OBJ",
        }
    }

    /// Puts what the file holds into `mesh`; gives the frame that it states, or what is wrong.
    fn parse(self, bytes: &[u8], mesh: &mut Mesh) -> Result<Option<PatientFrame>, String> {
        match self {
            Self::Ply => ply::parse(bytes, mesh),
            Self::Stl => stl::parse(bytes, mesh),
            Self::Vtk => vtk::parse(bytes, mesh),
            Self::Obj => obj::parse(bytes, mesh),
        }
    }
}

/// Reads a closed surface (PLY, STL, VTK legacy polydata or OBJ; lengths taken for mm) into LPS.
///
/// `unstated` is the frame of a file that states none: what 3D Slicer saves says `SPACE=LPS` or
/// `SPACE=RAS`, and that counts. Vertices at the same place become one, faces of more than three
/// corners become fans of triangles, and a surface whose faces look inward is turned inside out.
/// Memory is a small multiple of the file's size, whatever its header announces.
///
/// # Errors
/// When the file cannot be read, is none of the formats, or its surface is not closed.
pub fn read_closed_surface(path: &Path, unstated: PatientFrame) -> Result<Surface, ImportError> {
    let Some(format) = MeshFormat::of(path) else {
        return Err(ImportError::UnknownFormat(path.into()));
    };
    let bytes = std::fs::read(path).map_err(|source| ImportError::Io {
        path: path.into(),
        source,
    })?;
    let mut mesh = Mesh::default();
    let stated = format
        .parse(&bytes, &mut mesh)
        .map_err(|reason| ImportError::Format {
            path: path.into(),
            format: format.name(),
            reason: one_line(&reason),
        })?;
    drop(bytes);
    mesh.closed_surface(stated.unwrap_or(unstated), format.name(), path)
}

/// A parser's reason without its line breaks and without the data that it quotes at length.
fn one_line(reason: &str) -> String {
    let words: Vec<&str> = reason.split_whitespace().collect();
    let line = words.join(" ");
    match line.char_indices().nth(MAX_REASON) {
        Some((end, _)) => format!("{} ...", &line[..end]),
        None => line,
    }
}

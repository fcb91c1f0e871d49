//! The vertices and faces of a file of any format, and the closed surface they make.

use super::super::error::ImportError;
use crate::anatomy::PatientFrame;
use crate::volume::Surface;
use std::collections::HashMap;
use std::path::Path;

/// Coordinates beyond this are none of a patient's in any unit of length (mm, or micrometres
/// taken for mm), and their squares would lose what tells neighbours apart.
const MAX_COORDINATE: f64 = 1e7;

/// What a file holds, in its own frame. Vertices at the same place are one, and faces of more than
/// three corners are fans of triangles.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    at_place: HashMap<[u64; 3], u32>,
    /// The vertex that each of the file's became.
    merged: Vec<u32>,
    faces: usize,
}

impl Mesh {
    /// Takes the file's next vertex.
    ///
    /// # Errors
    /// When a coordinate is no length, or when there are more vertices than a surface can have.
    pub fn vertex(&mut self, xyz: [f64; 3]) -> Result<(), String> {
        let n = self.merged.len();
        if !xyz.iter().all(|v| v.abs() <= MAX_COORDINATE) {
            let [x, y, z] = xyz;
            return Err(format!(
                "vertex {n} is ({x}, {y}, {z}); expected mm within {MAX_COORDINATE:e}"
            ));
        }
        // Adding zero makes -0 and 0 the same place.
        let xyz = xyz.map(|v| v + 0.0);
        let next = u32::try_from(n).map_err(|_| "it has more than 2^32 vertices")?;
        let next = next.min(self.vertices.len() as u32);
        let index = *self.at_place.entry(xyz.map(f64::to_bits)).or_insert(next);
        if index == next {
            self.vertices.push(xyz);
        }
        self.merged.push(index);
        Ok(())
    }

    /// Takes the file's next face: the numbers of its corners, counted from 0 in the order of
    /// [`Self::vertex`].
    ///
    /// # Errors
    /// When it has fewer than three corners or names a vertex that is not there.
    pub fn face(&mut self, corners: &[i64]) -> Result<(), String> {
        let face = self.faces;
        self.faces += 1;
        if corners.len() < 3 {
            return Err(format!(
                "face {face} has {} corners; expected 3 or more",
                corners.len()
            ));
        }
        let corner = |n: usize| {
            let at = usize::try_from(corners[n]).ok();
            at.and_then(|v| self.merged.get(v).copied()).ok_or_else(|| {
                format!(
                    "face {face} names a vertex that is not there: {} (counted from 0) of {}",
                    corners[n],
                    self.merged.len()
                )
            })
        };
        let first = corner(0)?;
        let mut before = corner(1)?;
        for n in 2..corners.len() {
            let after = corner(n)?;
            // A face whose corners coincide has no area and no part in the surface.
            if first != before && before != after && after != first {
                self.triangles.push([first, before, after]);
            }
            before = after;
        }
        Ok(())
    }

    /// The surface in LPS. One whose faces look inward is turned inside out.
    ///
    /// # Errors
    /// When it has holes, or nothing at all.
    pub fn closed_surface(
        self,
        frame: PatientFrame,
        format: &'static str,
        path: &Path,
    ) -> Result<Surface, ImportError> {
        if self.triangles.is_empty() {
            return Err(ImportError::Format {
                path: path.into(),
                format,
                reason: format!(
                    "it has {} vertices and no triangle between them",
                    self.merged.len()
                ),
            });
        }
        let open_edges = open_edges(&self.triangles);
        if open_edges > 0 {
            return Err(ImportError::NotClosed {
                path: path.into(),
                open_edges,
            });
        }
        let vertices = self.vertices.iter().map(|&v| frame.to_lps(v)).collect();
        let surface = Surface::new(vertices, self.triangles);
        if surface.volume() >= 0.0 {
            return Ok(surface);
        }
        let flipped = surface.triangles().iter().map(|&[a, b, c]| [a, c, b]);
        Ok(Surface::new(surface.vertices().to_vec(), flipped.collect()))
    }
}

/// The number of edges that are not run through as often in one direction as in the other.
fn open_edges(triangles: &[[u32; 3]]) -> usize {
    let mut edges: Vec<(u32, u32, i32)> = Vec::with_capacity(3 * triangles.len());
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let direction = if from < to { 1 } else { -1 };
            edges.push((from.min(to), from.max(to), direction));
        }
    }
    edges.sort_unstable();
    edges
        .chunk_by(|p, q| (p.0, p.1) == (q.0, q.1))
        .filter(|edge| edge.iter().map(|e| e.2).sum::<i32>() != 0)
        .count()
}

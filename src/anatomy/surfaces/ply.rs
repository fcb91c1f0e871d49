//! PLY files (ascii and binary) of closed triangle surfaces in RAS, mm.

use super::error::ImportError;
use crate::geometry::Point;
use crate::volume::Surface;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};
use std::collections::HashMap;
use std::path::Path;

/// A vertex's coordinates or a face's vertex numbers, whichever the element has.
#[derive(Default)]
struct Element {
    xyz: [Option<f64>; 3],
    /// -1 stands for a number that is no index.
    vertices: Vec<i64>,
}

impl PropertyAccess for Element {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match name {
            "x" | "y" | "z" => {
                let axis = usize::from(name.as_bytes()[0] - b'x');
                self.xyz[axis] = scalar(&property);
                PropertyAccessResult::Set
            }
            "vertex_indices" | "vertex_index" => match indices(property) {
                Some(list) => {
                    self.vertices = list;
                    PropertyAccessResult::Set
                }
                None => PropertyAccessResult::UnsupportedType,
            },
            _ => PropertyAccessResult::Ignored,
        }
    }
}

fn scalar(property: &Property) -> Option<f64> {
    Some(match *property {
        Property::Char(v) => v.into(),
        Property::UChar(v) => v.into(),
        Property::Short(v) => v.into(),
        Property::UShort(v) => v.into(),
        Property::Int(v) => v.into(),
        Property::UInt(v) => v.into(),
        Property::Float(v) => v.into(),
        Property::Double(v) => v,
        _ => return None,
    })
}

fn indices(property: Property) -> Option<Vec<i64>> {
    fn wide<T: Into<i64>>(list: Vec<T>) -> Vec<i64> {
        list.into_iter().map(Into::into).collect()
    }
    Some(match property {
        Property::ListChar(v) => wide(v),
        Property::ListUChar(v) => wide(v),
        Property::ListShort(v) => wide(v),
        Property::ListUShort(v) => wide(v),
        Property::ListInt(v) => wide(v),
        Property::ListUInt(v) => wide(v),
        _ => return None,
    })
}

/// Reads a closed surface and takes it to LPS (x and y change their sign). Vertices at the same
/// place become one, faces of more than three corners become fans of triangles, and a surface
/// whose faces look inward is turned inside out.
///
/// # Errors
/// When the file is no such surface, or the surface is not closed.
pub(super) fn read_closed_ply(path: &Path) -> Result<Surface, ImportError> {
    let (vertices, triangles) = read_triangles(path)?;
    let open_edges = open_edges(&triangles);
    if open_edges > 0 {
        return Err(ImportError::NotClosed {
            path: path.into(),
            open_edges,
        });
    }
    let surface = Surface::new(vertices, triangles);
    if surface.volume() >= 0.0 {
        return Ok(surface);
    }
    let flipped = surface.triangles().iter().map(|&[a, b, c]| [a, c, b]);
    Ok(Surface::new(surface.vertices().to_vec(), flipped.collect()))
}

fn read_triangles(path: &Path) -> Result<(Vec<Point>, Vec<[u32; 3]>), ImportError> {
    let file = std::fs::File::open(path).map_err(|source| ImportError::Io {
        path: path.into(),
        source,
    })?;
    let bad = |reason: String| ImportError::Ply {
        path: path.into(),
        reason,
    };
    let mut ply = Parser::<Element>::new()
        .read_ply(&mut std::io::BufReader::new(file))
        .map_err(|error| bad(error.to_string()))?;
    let mut take = |name: &str| match ply.payload.shift_remove(name) {
        Some(elements) if !elements.is_empty() => Ok(elements),
        _ => Err(bad(format!("it has no element '{name}'"))),
    };
    let (file_vertices, faces) = (take("vertex")?, take("face")?);

    let mut vertices = Vec::new();
    let mut at_place: HashMap<[u64; 3], u32> = HashMap::new();
    let mut number = Vec::with_capacity(file_vertices.len());
    for (n, vertex) in file_vertices.iter().enumerate() {
        let [Some(x), Some(y), Some(z)] = vertex.xyz else {
            return Err(bad(format!("vertex {n} lacks x, y or z")));
        };
        if ![x, y, z].iter().all(|v| v.is_finite()) {
            return Err(bad(format!("vertex {n} is ({x}, {y}, {z})")));
        }
        // RAS to LPS. Adding zero makes -0 and 0 the same place.
        let lps = [-x + 0.0, -y + 0.0, z + 0.0];
        let next = vertices.len() as u32;
        let index = *at_place.entry(lps.map(f64::to_bits)).or_insert(next);
        if index == next {
            vertices.push(Point::from(lps));
        }
        number.push(index);
    }

    let mut triangles = Vec::with_capacity(faces.len());
    for (n, face) in faces.iter().enumerate() {
        let corners: Option<Vec<u32>> = face
            .vertices
            .iter()
            .map(|&v| usize::try_from(v).ok().and_then(|v| number.get(v).copied()))
            .collect();
        let corners =
            corners.ok_or_else(|| bad(format!("face {n} names a vertex that is not there")))?;
        if corners.len() < 3 {
            return Err(bad(format!("face {n} has {} corners", corners.len())));
        }
        for pair in corners[1..].windows(2) {
            let triangle = [corners[0], pair[0], pair[1]];
            // A face whose corners coincide has no area and no part in the surface.
            if triangle[0] != triangle[1]
                && triangle[1] != triangle[2]
                && triangle[2] != triangle[0]
            {
                triangles.push(triangle);
            }
        }
    }
    Ok((vertices, triangles))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A box from (1, 2, 3) to (4, 6, 8) RAS, quadrilaterals outward; `faces` of its six.
    fn ascii_box(faces: usize, inward: bool) -> String {
        let mut text = format!(
            "ply\nformat ascii 1.0\ncomment test\nelement vertex 8\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\nelement face {faces}\nproperty list uchar uint vertex_index\nend_header\n"
        );
        for n in 0..8 {
            let pick = |bit: usize, low: f64, high: f64| if n >> bit & 1 == 1 { high } else { low };
            text += &format!(
                "{} {} {} 7\n",
                pick(0, 1.0, 4.0),
                pick(1, 2.0, 6.0),
                pick(2, 3.0, 8.0)
            );
        }
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        for mut quad in quads.into_iter().take(faces) {
            if inward {
                quad.reverse();
            }
            text += &format!("4 {} {} {} {}\n", quad[0], quad[1], quad[2], quad[3]);
        }
        text
    }

    fn read(text: &[u8]) -> Result<Surface, ImportError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bone.ply");
        std::fs::write(&path, text).unwrap();
        read_closed_ply(&path)
    }

    #[test]
    fn a_box_is_read_into_lps_with_its_volume_whichever_way_its_faces_look() {
        for inward in [false, true] {
            let surface = read(ascii_box(6, inward).as_bytes()).unwrap();
            assert!((surface.volume() - 60.0).abs() < 1e-9);
            let x = surface.vertices().iter().map(|p| p.x);
            assert_eq!(x.fold(f64::MAX, f64::min), -4.0);
        }
    }

    #[test]
    fn binary_files_are_read_in_both_byte_orders() {
        for big in [false, true] {
            let order = if big { "big" } else { "little" };
            let mut file = format!(
                "ply\nformat binary_{order}_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
            )
            .into_bytes();
            let mut put = |bytes: [u8; 4]| {
                let mut bytes = bytes;
                if big {
                    bytes.reverse();
                }
                file.extend(bytes);
            };
            for v in [
                0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0,
            ] {
                put(v.to_le_bytes());
            }
            for face in [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] {
                file.push(3);
                for v in face {
                    let mut bytes = i32::to_le_bytes(v);
                    if big {
                        bytes.reverse();
                    }
                    file.extend(bytes);
                }
            }
            assert!((read(&file).unwrap().volume() - 1.0 / 6.0).abs() < 1e-12);
        }
    }

    #[test]
    fn an_open_surface_is_refused_with_its_file_and_edges() {
        let message = read(ascii_box(5, false).as_bytes())
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("bone.ply") && message.contains("4 edges"),
            "{message}"
        );
    }

    #[test]
    fn broken_files_are_refused_with_the_reason() {
        let whole = ascii_box(6, false);
        for (text, reason) in [
            (String::from("solid bone"), "not a readable PLY"),
            (
                whole.replace("4 0 2 3 1", "4 0 2 3 9"),
                "face 0 names a vertex",
            ),
            (whole.replace("4 0 2 3 1", "2 0 2"), "face 0 has 2 corners"),
            (whole.replace("1 2 3 7", "1 1e999 3 7"), "vertex 0 is"),
            (whole.replace("double z", "double w"), "vertex 0 lacks"),
            (whole[..whole.len() - 12].to_string(), "bone.ply"),
        ] {
            let message = read(text.as_bytes()).unwrap_err().to_string();
            assert!(
                message.contains(reason),
                "expected '{reason}' in: {message}"
            );
        }
    }
}

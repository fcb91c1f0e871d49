//! Wavefront OBJ: `v` and `f` lines.

use super::mesh::Mesh;
use super::stated_frame::stated_frame;
use crate::anatomy::PatientFrame;

/// Puts vertices and faces into `mesh`; gives the frame that a comment states. Normals, texture and
/// materials are passed over; groups (`g`, `usemtl`) divide one surface and are read as one.
///
/// # Errors
/// With the line that is wrong, or when the file holds several objects (`o`): which bone each is
/// cannot be told.
pub(super) fn parse(bytes: &[u8], mesh: &mut Mesh) -> Result<Option<PatientFrame>, String> {
    let text = String::from_utf8_lossy(bytes);
    let mut comments = String::new();
    let mut vertices = 0;
    // The object that a line belongs to, and those that have a face.
    let mut object = "without a name";
    let mut with_faces: Vec<&str> = Vec::new();
    let mut corners = Vec::new();
    for (n, line) in text.lines().enumerate() {
        let at = |reason: String| format!("line {}: {reason}", n + 1);
        let line = line.trim();
        if let Some(comment) = line.strip_prefix('#') {
            comments.push_str(comment);
            comments.push('\n');
            continue;
        }
        if line.ends_with('\\') {
            return Err(at(
                "it goes on in the next one (\\), which is not read".into()
            ));
        }
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.map_while(|w| w.parse().ok()).take(3).collect();
                let xyz: Result<[f64; 3], _> = numbers.try_into();
                let xyz =
                    xyz.map_err(|_| at(format!("'{line}' is no vertex; expected v x y z")))?;
                mesh.vertex(xyz).map_err(at)?;
                vertices += 1;
            }
            Some("f") => {
                corners.clear();
                for word in words {
                    let corner = vertex_number(word, vertices);
                    corners.push(corner.ok_or_else(|| {
                        at(format!(
                            "'{word}' is no corner of a face; expected a number but 0, or numbers as in 1/2/3"
                        ))
                    })?);
                }
                mesh.face(&corners).map_err(at)?;
                if with_faces.last() != Some(&object) {
                    with_faces.push(object);
                }
            }
            Some("o") => object = line[1..].trim(),
            _ => {}
        }
    }
    if with_faces.len() > 1 {
        return Err(format!(
            "it holds {} objects ({}); expected one bone: save each object to a file of its own",
            with_faces.len(),
            with_faces.join(", ")
        ));
    }
    stated_frame(&comments)
}

/// The vertex of a face's corner, counted from 0; `1`, `1/2`, `1//3` and `1/2/3` name the first,
/// and -1 the latest of those read so far.
fn vertex_number(corner: &str, vertices: i64) -> Option<i64> {
    match corner.split('/').next()?.parse::<i64>().ok()? {
        0 => None,
        number if number < 0 => number.checked_add(vertices),
        number => Some(number - 1),
    }
}

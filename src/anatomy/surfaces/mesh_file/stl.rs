//! STL, ascii and binary: triangles without shared vertices.

use super::mesh::Mesh;
use super::stated_frame::stated_frame;
use crate::anatomy::PatientFrame;
use std::io::Cursor;

/// A binary file's header, then the number of its triangles (4 bytes).
const HEADER: usize = 80;

/// Bytes of a binary file's triangle: normal, corners, an attribute.
const TRIANGLE: usize = 50;

/// Puts the triangles into `mesh`; gives the frame that the header states.
///
/// # Errors
/// When the file is neither form, does not hold as many triangles as it announces, or holds several
/// solids.
pub(super) fn parse(bytes: &[u8], mesh: &mut Mesh) -> Result<Option<PatientFrame>, String> {
    let (header, plain) = match announced(bytes) {
        // Many binary files begin with "solid" as ascii ones must, so their length decides.
        Some(triangles) if bytes.len() as u64 == length(triangles) => {
            let mut plain = bytes.to_vec();
            plain[..HEADER].fill(0);
            (String::from_utf8_lossy(&bytes[..HEADER]).into(), plain)
        }
        announced => ascii(bytes).unwrap_or_else(|| Err(no_binary(bytes, announced)))?,
    };
    let frame = stated_frame(&header)?;
    let mut cursor = Cursor::new(plain);
    let reader = stl_io::create_stl_reader(&mut cursor).map_err(|e| e.to_string())?;
    for (n, triangle) in reader.enumerate() {
        let triangle = triangle.map_err(|e| format!("triangle {n}: {e}"))?;
        for corner in triangle.vertices {
            mesh.vertex([0, 1, 2].map(|axis| f64::from(corner[axis])))?;
        }
        let first = 3 * n as i64;
        mesh.face(&[first, first + 1, first + 2])?;
    }
    Ok(frame)
}

/// The number of triangles that a binary file announces.
fn announced(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(HEADER..HEADER + 4)?;
    Some(u32::from_le_bytes(count.try_into().expect("four bytes")))
}

/// Bytes of a binary file of so many triangles.
fn length(triangles: u32) -> u64 {
    (HEADER + 4) as u64 + TRIANGLE as u64 * u64::from(triangles)
}

/// The first line of an ascii file, and the file as stl_io takes it: in small letters, with a name,
/// in UTF-8. `None` if it is no ascii file.
fn ascii(bytes: &[u8]) -> Option<Result<(String, Vec<u8>), String>> {
    let text = String::from_utf8_lossy(bytes);
    let text = text.trim_start();
    let begins = text
        .get(..5)
        .is_some_and(|word| word.eq_ignore_ascii_case("solid"));
    // A binary file that was cut off may begin so, but holds zeros.
    if !begins || bytes.contains(&0) {
        return None;
    }
    let (first, rest) = text.split_once('\n').unwrap_or((text, ""));
    let rest = rest.to_ascii_lowercase();
    let solids = rest
        .lines()
        .filter(|line| line.trim_start().starts_with("endsolid"))
        .count();
    if solids > 1 {
        return Some(Err(format!(
            "it holds {solids} solids; expected one bone: save each solid to a file of its own"
        )));
    }
    Some(Ok((
        first.to_owned(),
        format!("solid bone\n{rest}").into_bytes(),
    )))
}

/// Why the bytes are no binary file either.
fn no_binary(bytes: &[u8], announced: Option<u32>) -> String {
    match announced {
        Some(triangles) => format!(
            "it is no ascii file and has not the length of a binary one: the {triangles} triangles \
             that it announces need {} bytes, and it has {}; copy it again",
            length(triangles),
            bytes.len()
        ),
        None => format!(
            "it is no ascii file and ends within the header of a binary one, after {} bytes",
            bytes.len()
        ),
    }
}

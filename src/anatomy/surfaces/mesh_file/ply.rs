//! PLY, ascii and binary.

use super::mesh::Mesh;
use super::stated_frame::stated_frame;
use crate::anatomy::PatientFrame;
use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Header, Property, PropertyAccess, PropertyAccessResult};

/// A vertex's coordinates or a face's vertex numbers, whichever the element has.
#[derive(Default)]
struct Element {
    xyz: [Option<f64>; 3],
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

/// Puts vertices and faces into `mesh`; gives the frame that a comment states.
///
/// # Errors
/// When the file is no PLY file with elements `vertex` and `face`.
pub(super) fn parse(bytes: &[u8], mesh: &mut Mesh) -> Result<Option<PatientFrame>, String> {
    let parser = Parser::<Element>::new();
    let mut reader = Reader::new(bytes);
    let header = parser.read_header(&mut reader).map_err(|e| e.to_string())?;
    check_counts(&header, reader.get_ref().len())?;
    let frame = stated_frame(&header.comments.join("\n"))?;
    let mut payload = parser
        .read_payload(&mut reader, &header)
        .map_err(|e| e.to_string())?;
    let mut take = |name: &str| match payload.shift_remove(name) {
        Some(elements) if !elements.is_empty() => Ok(elements),
        _ => Err(format!("it has no element '{name}'")),
    };
    for (n, vertex) in take("vertex")?.iter().enumerate() {
        let [Some(x), Some(y), Some(z)] = vertex.xyz else {
            return Err(format!("vertex {n} lacks x, y or z"));
        };
        mesh.vertex([x, y, z])?;
    }
    for face in take("face")? {
        mesh.face(&face.vertices)?;
    }
    Ok(frame)
}

/// Refuses a header that announces more elements than the rest of the file can hold: an element
/// takes a byte or more, but one without properties would take none and could be announced any
/// number of times.
fn check_counts(header: &Header, rest: usize) -> Result<(), String> {
    for (name, element) in &header.elements {
        if element.count > 0 && element.properties.is_empty() {
            return Err(format!("its element '{name}' has no properties"));
        }
        if element.count > rest {
            return Err(format!(
                "it announces {} of '{name}', and {rest} bytes follow its header; copy it again",
                element.count
            ));
        }
    }
    Ok(())
}

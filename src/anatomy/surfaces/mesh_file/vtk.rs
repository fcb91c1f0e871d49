//! Legacy VTK files (`# vtk DataFile`, versions 1 to 5) of polydata.

use super::mesh::Mesh;
use super::stated_frame::stated_frame;
use super::vtk_bytes::{Bytes, NumberType};
use crate::anatomy::PatientFrame;

/// Lists of point numbers, counted from 0.
type Cells = Vec<Vec<i64>>;

/// The parts of polydata that make a surface.
#[derive(Default)]
struct PolyData {
    points: Option<Vec<f64>>,
    polygons: Cells,
    strips: Cells,
}

/// Puts points, polygons and triangle strips into `mesh`; gives the frame that the title states.
///
/// # Errors
/// When the file is no legacy VTK file of polydata, or ends too early.
pub(super) fn parse(bytes: &[u8], mesh: &mut Mesh) -> Result<Option<PatientFrame>, String> {
    let mut bytes = Bytes::new(bytes);
    let version = version(&bytes.line().unwrap_or_default())?;
    let frame = stated_frame(&bytes.line().unwrap_or_default())?;
    let encoding = bytes.line().unwrap_or_default();
    match encoding.to_ascii_uppercase().as_str() {
        "ASCII" => {}
        "BINARY" => bytes.set_binary(),
        _ => {
            return Err(format!(
                "its third line is '{encoding}'; expected ASCII or BINARY"
            ));
        }
    }
    let dataset = bytes.full_line().unwrap_or_default();
    if !dataset.eq_ignore_ascii_case("DATASET POLYDATA") {
        return Err(format!(
            "it says '{dataset}' where DATASET POLYDATA was expected; extract its surface and save that"
        ));
    }
    let data = sections(&mut bytes, version)?;
    for point in data.points.unwrap_or_default().chunks_exact(3) {
        mesh.vertex(point.try_into().expect("chunks of three"))?;
    }
    for polygon in data.polygons {
        mesh.face(&polygon)?;
    }
    for strip in data.strips {
        // Every other triangle of a strip runs the other way.
        for (n, corners) in strip.windows(3).enumerate() {
            let turned = n % 2;
            mesh.face(&[corners[turned], corners[1 - turned], corners[2]])?;
        }
    }
    Ok(frame)
}

/// The first number of the file's version.
fn version(line: &str) -> Result<u32, String> {
    let version = line.strip_prefix("# vtk DataFile Version ").and_then(|v| {
        let major = v.trim().split('.').next()?;
        major.parse().ok()
    });
    match version {
        Some(major) if major <= 5 => Ok(major),
        Some(major) => Err(format!(
            "its version is {major}; expected 5 or an older one"
        )),
        None => Err("it does not begin with '# vtk DataFile Version'".into()),
    }
}

/// Everything up to the attributes of points or cells.
fn sections(bytes: &mut Bytes, version: u32) -> Result<PolyData, String> {
    let mut data = PolyData::default();
    while let Some(line) = bytes.full_line() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |n: usize| count(words.get(n), &line);
        let section = words[0].to_ascii_uppercase();
        match section.as_str() {
            "POINTS" if data.points.is_some() => {
                return Err("it has two sections POINTS".into());
            }
            "POINTS" => {
                let kind = NumberType::of(words.get(2).unwrap_or(&""))?;
                let coordinates = number(1)?.saturating_mul(3);
                data.points = Some(bytes.numbers(coordinates, kind, "POINTS")?);
            }
            "POLYGONS" | "TRIANGLE_STRIPS" | "LINES" | "VERTICES" => {
                let cells = if version < 5 {
                    sized_cells(bytes, number(1)?, number(2)?, &section)?
                } else {
                    offset_cells(bytes, number(1)?, number(2)?, &section)?
                };
                match section.as_str() {
                    "POLYGONS" => data.polygons.extend(cells),
                    "TRIANGLE_STRIPS" => data.strips.extend(cells),
                    // They are no part of a surface.
                    _ => {}
                }
            }
            "METADATA" => skip_metadata(bytes),
            "FIELD" => skip_field(bytes, number(2)?)?,
            "POINT_DATA" | "CELL_DATA" => break,
            other => return Err(format!("its section '{other}' is none of polydata")),
        }
    }
    Ok(data)
}

fn count(word: Option<&&str>, line: &str) -> Result<usize, String> {
    let number = word.and_then(|w| w.parse().ok());
    number.ok_or_else(|| format!("the line '{line}' lacks a count"))
}

/// Cells up to version 4: each one's number of points before its points, `size` numbers in all.
fn sized_cells(bytes: &mut Bytes, cells: usize, size: usize, what: &str) -> Result<Cells, String> {
    let numbers = bytes.numbers(size, NumberType::I32, what)?;
    let mut found = Vec::new();
    let mut rest = &numbers[..];
    while let Some((&length, after)) = rest.split_first() {
        let cell = usize::try_from(whole(length))
            .ok()
            .and_then(|length| after.split_at_checked(length));
        let (cell, after) =
            cell.ok_or_else(|| format!("a cell of {what} has {length} points, more than follow"))?;
        found.push(cell.iter().map(|&v| whole(v)).collect());
        rest = after;
    }
    if found.len() != cells {
        return Err(format!(
            "it announces {cells} cells of {what} and holds {}",
            found.len()
        ));
    }
    Ok(found)
}

/// Cells of version 5: where each begins among all their points, then these points.
fn offset_cells(
    bytes: &mut Bytes,
    offsets: usize,
    size: usize,
    what: &str,
) -> Result<Cells, String> {
    let mut array = |name: &str, count: usize| {
        let line = bytes.full_line().unwrap_or_default();
        match line.split_once(char::is_whitespace) {
            Some((word, kind)) if word == name => {
                bytes.numbers(count, NumberType::of(kind.trim())?, name)
            }
            _ => Err(format!(
                "it says '{line}' where the {name} of {what} were expected"
            )),
        }
    };
    let offsets = array("OFFSETS", offsets)?;
    let points = array("CONNECTIVITY", size)?;
    let cell = |pair: &[f64]| {
        let [from, to] = [pair[0], pair[1]].map(|v| usize::try_from(whole(v)).ok());
        Some(points.get(from?..to?)?.iter().map(|&v| whole(v)).collect())
    };
    let ends = (offsets.first(), offsets.last());
    let cells: Option<Cells> = offsets.windows(2).map(cell).collect();
    match cells {
        Some(cells) if offsets.is_empty() || ends == (Some(&0.0), Some(&(size as f64))) => {
            Ok(cells)
        }
        _ => Err(format!(
            "the OFFSETS of {what} do not rise from 0 to {size}"
        )),
    }
}

/// A whole number, or -1, which is no index, for any other.
fn whole(number: f64) -> i64 {
    if number.fract() == 0.0 {
        number as i64
    } else {
        -1
    }
}

/// Passes over a block of information about an array; it ends with an empty line.
fn skip_metadata(bytes: &mut Bytes) {
    while bytes.line().is_some_and(|line| !line.is_empty()) {}
}

/// Passes over arrays that belong to the dataset as a whole.
fn skip_field(bytes: &mut Bytes, arrays: usize) -> Result<(), String> {
    let mut left = arrays;
    while left > 0 {
        let Some(line) = bytes.full_line() else {
            return Err(format!(
                "it announces {arrays} arrays of FIELD and ends before"
            ));
        };
        if line == "METADATA" {
            skip_metadata(bytes);
            continue;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers = count(words.get(1), &line)?.saturating_mul(count(words.get(2), &line)?);
        match words.get(3) {
            Some(&"string") if !bytes.is_binary() => {
                for _ in 0..numbers {
                    if bytes.line().is_none() {
                        return Err(format!("it ends within the texts of FIELD {}", words[0]));
                    }
                }
            }
            kind => {
                let kind = NumberType::of(kind.unwrap_or(&""))?;
                bytes.numbers(numbers, kind, words[0])?;
            }
        }
        left -= 1;
    }
    Ok(())
}

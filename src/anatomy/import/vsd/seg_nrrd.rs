//! A segmentation by 3D Slicer (`.seg.nrrd`): a label map, or several where segments overlap.
//!
//! Layers lie beside each other voxel by voxel (the first axis is the layers'), so a file is decoded as it
//! is read and never held as a whole.

use crate::volume::{Grid, grid_from_affine};
use flate2::bufread::MultiGzDecoder;
use nalgebra::{Matrix3x4, Vector3};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// No header of Slicer is longer (bytes).
const MOST_HEADER: u64 = 1 << 20;

/// One segment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Segment {
    pub name: String,
    pub label: u8,
    pub layer: usize,
}

/// What the header says.
#[derive(Clone, Debug)]
pub(super) struct SegHeader {
    pub grid: Grid,
    pub layers: usize,
    pub segments: Vec<Segment>,
    gzip: bool,
}

/// Opens a segmentation: its header, and the stream of its voxels.
pub(super) fn open(path: &Path) -> Result<(SegHeader, Box<dyn Read>), String> {
    let file = File::open(path).map_err(|e| format!("cannot be read: {e}"))?;
    let mut stream = BufReader::new(file);
    let lines = header_lines(&mut stream)?;
    let header = SegHeader::parse(&lines)?;
    let voxels: Box<dyn Read> = match header.gzip {
        true => Box::new(MultiGzDecoder::new(stream)),
        false => Box::new(stream),
    };
    Ok((header, voxels))
}

/// Calls `voxel` for each voxel in the order of memory with its label in each layer.
pub(super) fn for_each_voxel(
    header: &SegHeader,
    voxels: Box<dyn Read>,
    mut voxel: impl FnMut(&[u8]),
) -> Result<(), String> {
    let mut stream = BufReader::with_capacity(1 << 16, voxels);
    let mut labels = vec![0u8; header.layers];
    for n in 0..header.grid.len() {
        stream.read_exact(&mut labels).map_err(|e| {
            format!(
                "ends after {n} of {} voxels ({e}); copy it again",
                header.grid.len()
            )
        })?;
        voxel(&labels);
    }
    Ok(())
}

/// The lines up to the empty one that ends the header.
fn header_lines(stream: &mut impl BufRead) -> Result<Vec<String>, String> {
    let mut limited = stream.take(MOST_HEADER);
    let mut lines = Vec::new();
    loop {
        let mut line = Vec::new();
        let read = limited
            .read_until(b'\n', &mut line)
            .map_err(|e| e.to_string())?;
        if read == 0 {
            return Err("has no end of its header; is it a .seg.nrrd file?".into());
        }
        let text = String::from_utf8_lossy(&line).trim_end().to_owned();
        if lines.is_empty() && !text.starts_with("NRRD000") {
            return Err("does not start as an NRRD file does".into());
        }
        if text.is_empty() {
            return Ok(lines);
        }
        lines.push(text);
    }
}

impl SegHeader {
    fn parse(lines: &[String]) -> Result<Self, String> {
        let mut fields = BTreeMap::new();
        let mut keys = BTreeMap::new();
        for line in lines.iter().filter(|line| !line.starts_with('#')) {
            if let Some((key, value)) = line.split_once(":=") {
                keys.insert(key, value);
            } else if let Some((field, value)) = line.split_once(": ") {
                fields.insert(field, value.trim());
            }
        }
        let get = |field: &str| {
            let value = fields.get(field).copied();
            value.ok_or_else(|| format!("has no field '{field}' in its header"))
        };
        let kind = get("type")?;
        if !["unsigned char", "uchar", "uint8", "uint8_t"].contains(&kind) {
            return Err(format!(
                "holds {kind}; expected unsigned char, as Slicer writes segmentations"
            ));
        }
        let gzip = match get("encoding")? {
            "gzip" | "gz" => true,
            "raw" => false,
            other => return Err(format!("is encoded as {other}; expected gzip or raw")),
        };
        if fields.contains_key("data file") {
            return Err("keeps its voxels in another file; save it as .seg.nrrd".into());
        }
        let sizes: Vec<usize> = get("sizes")?
            .split_whitespace()
            .map(|word| word.parse().map_err(|_| format!("has the size '{word}'")))
            .collect::<Result<_, String>>()?;
        let directions = directions(get("space directions")?)?;
        let (layers, dims) = match (sizes.as_slice(), directions.as_slice()) {
            (&[i, j, k], [Some(_), Some(_), Some(_)]) => (1, [i, j, k]),
            (&[layers, i, j, k], [None, Some(_), Some(_), Some(_)]) => (layers, [i, j, k]),
            _ => {
                return Err(format!(
                    "has the sizes {sizes:?}; expected three, or the number of layers and three"
                ));
            }
        };
        let possible =
            dims.iter().all(|&n| (2..1 << 16).contains(&n)) && (1..256).contains(&layers);
        if !possible {
            return Err(format!(
                "has the sizes {sizes:?}; expected 2 to 65535 voxels along each axis"
            ));
        }
        let sign = match get("space")?.to_lowercase().as_str() {
            "left-posterior-superior" | "lps" => [1.0, 1.0, 1.0],
            "right-anterior-superior" | "ras" => [-1.0, -1.0, 1.0],
            other => {
                return Err(format!(
                    "lies in the space {other}; expected left-posterior-superior or right-anterior-superior"
                ));
            }
        };
        let origin = vector(get("space origin")?)?;
        let axes: Vec<Vector3<f64>> = directions.into_iter().flatten().collect();
        let affine = Matrix3x4::from_fn(|row, column| {
            let from = if column == 3 { &origin } else { &axes[column] };
            sign[row] * from[row]
        });
        Ok(Self {
            grid: grid_from_affine(&affine, dims)?,
            layers,
            segments: segments(&keys, layers)?,
            gzip,
        })
    }
}

/// `none` or `(x,y,z)` for each axis.
fn directions(text: &str) -> Result<Vec<Option<Vector3<f64>>>, String> {
    let word = |word: &str| match word {
        "none" => Ok(None),
        other => vector(other).map(Some),
    };
    text.split_whitespace().map(word).collect()
}

fn vector(text: &str) -> Result<Vector3<f64>, String> {
    let inner = text
        .trim()
        .strip_prefix('(')
        .and_then(|t| t.strip_suffix(')'));
    let numbers: Option<Vec<f64>> = inner.and_then(|inner| {
        let parts = inner.split(',').map(|n| n.trim().parse().ok());
        parts.collect()
    });
    match numbers.as_deref() {
        Some(&[x, y, z]) => Ok(Vector3::new(x, y, z)),
        _ => Err(format!("has '{text}' in its header; expected (x,y,z)")),
    }
}

/// The segments in their order. Before labels were written, each had a layer of ones for itself.
fn segments(keys: &BTreeMap<&str, &str>, layers: usize) -> Result<Vec<Segment>, String> {
    let mut list = Vec::new();
    for number in 0..4096 {
        let key = |what: &str| {
            let key = format!("Segment{number}_{what}");
            keys.get(key.as_str()).map(|value| value.trim())
        };
        let Some(name) = key("Name") else {
            break;
        };
        let whole = |what: &str, default: usize| match key(what) {
            Some(text) => text.parse().map_err(|_| {
                format!("has Segment{number}_{what} '{text}'; expected a whole number")
            }),
            None => Ok(default),
        };
        let label = whole("LabelValue", 1)?;
        let layer = whole("Layer", if layers > 1 { number } else { 0 })?;
        match u8::try_from(label) {
            Ok(label) if label > 0 && layer < layers => list.push(Segment {
                name: name.to_owned(),
                label,
                layer,
            }),
            _ => {
                return Err(format!(
                    "has Segment{number} with label {label} in layer {layer}; expected 1 to 255 and a layer \
                     below {layers}"
                ));
            }
        }
    }
    match list.is_empty() {
        true => {
            Err("names no segment; expected a segmentation saved by 3D Slicer (.seg.nrrd)".into())
        }
        false => Ok(list),
    }
}

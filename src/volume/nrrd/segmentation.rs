//! Slicer's segmentations (`.seg.nrrd`): one label map, or several layers of them where segments overlap.
//!
//! Layers lie beside each other voxel by voxel, so a file is decoded as it is read and never held as a
//! whole.

use super::START;
use super::axes::{layered_grid_of, overlap};
use super::header::Header;
use super::read::{Values, open_values};
use super::segments::{Segment, segments_of};
use crate::volume::samples::SampleType;
use crate::volume::{Grid, VolumeFileError, source};
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

/// Bytes that are decoded at a time.
const BUFFER_BYTES: usize = 1 << 16;

/// A segmentation whose header was read; its voxels follow.
#[derive(Debug)]
pub(crate) struct Segmentation<'a> {
    /// LPS mm.
    pub grid: Grid,
    pub layers: usize,
    /// In the order of their numbers; empty for an NRRD file that is no segmentation.
    pub segments: Vec<Segment>,
    header: Header<'a>,
    attached: BufReader<File>,
}

impl<'a> Segmentation<'a> {
    /// Reads a segmentation's header.
    ///
    /// # Errors
    /// When the file is no NRRD file, has not three dimensions in space, does not say where it lies in LPS,
    /// RAS or LAS mm, or a segment has no name, no label from 1 to 255 or a layer that is not there.
    pub fn open(path: &'a Path) -> Result<Self, VolumeFileError> {
        let mut attached = source::open(path)?;
        let header = Header::read(&mut attached, path)?;
        let (grid, layers) = layered_grid_of(&header)?;
        let segments = segments_of(&header, layers)?;
        Ok(Self {
            grid,
            layers,
            segments,
            header,
            attached,
        })
    }

    /// Calls `voxel` for each voxel in the order of memory with its label in each layer.
    ///
    /// # Errors
    /// When labels are no unsigned bytes, which Slicer writes, or are encoded otherwise than raw or by
    /// gzip or in several files, or the file ends too early.
    pub fn for_each_voxel(self, mut voxel: impl FnMut(&[u8])) -> Result<(), VolumeFileError> {
        let header = &self.header;
        let kind = header.sample_type()?;
        if kind != SampleType::U8 {
            return Err(header.fields.wrong(format!(
                "its segments' labels are of the type {}; expected unsigned char, as Slicer writes them",
                header.fields.needed("type")?
            )));
        }
        let voxels = source::raw_bytes(self.grid.dims, kind, header.fields.path())?;
        // Voxels are fewer than 2^63 and layers than 2^13: no file has so many bytes, and none is asked for.
        let expected = voxels.saturating_mul(self.layers as u64);
        let Values::Bytes(stream) = open_values(header, self.attached, expected)?.0 else {
            return Err(header
                .fields
                .wrong("its segments' labels are text; write it anew as gzip".into()));
        };
        let mut stream = BufReader::with_capacity(BUFFER_BYTES, stream);
        let mut labels = vec![0u8; self.layers];
        for n in 0..voxels {
            match stream.read_exact(&mut labels) {
                Ok(()) => voxel(&labels),
                Err(error) if error.kind() == ErrorKind::UnexpectedEof => {
                    return Err(VolumeFileError::Truncated {
                        path: header.fields.path().into(),
                        found: n * self.layers as u64,
                        expected,
                    });
                }
                Err(error) => return Err(source::unreadable(header.fields.path())(error)),
            }
        }
        Ok(())
    }
}

/// The labels of a segmentation by Slicer with their segments' names, in the order of its segments;
/// empty for an NRRD file that is no segmentation, and for a file of another format. Voxels are not read.
///
/// # Errors
/// When an NRRD file has not three dimensions in space, does not say where it lies in LPS, RAS or LAS mm, its
/// segments overlap (lie in several layers), or one has no name or no label from 1 to 255 for itself.
pub fn nrrd_segment_names(path: &Path) -> Result<Vec<(u8, String)>, VolumeFileError> {
    if !source::starts_with(&mut source::open(path)?, START, path)? {
        return Ok(Vec::new());
    }
    let Segmentation {
        layers,
        segments,
        header,
        ..
    } = Segmentation::open(path)?;
    if layers > 1 {
        return Err(overlap(&header.fields, layers));
    }
    let mut names: Vec<(u8, String)> = Vec::new();
    for Segment { label, name, .. } in segments {
        if names.iter().any(|&(other, _)| other == label) {
            return Err(header
                .fields
                .wrong(format!("two of its segments have the label {label}")));
        }
        names.push((label, name));
    }
    Ok(names)
}

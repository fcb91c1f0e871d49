//! The Hounsfield units of one slice.

use super::data_set::{Source, io};
use super::problem::DicomProblem;
use super::slice::Slice;
use super::syntax::Syntax;
use super::{jpeg, rle};
use crate::volume::samples::ByteOrder;
use crate::volume::{VolumeFileError, Voxel};
use std::io::Read;

/// What padding becomes, in Hounsfield units, where it lies below: air. Scanners put values such
/// as -2000 outside of the circle they reconstruct; intercepts take some of them out of 16 bits.
const AIR: f64 = -1024.0;

impl Slice {
    /// Reads the slice's voxels, `rows` x `columns`, i fastest, into `out`, its k'th slice.
    ///
    /// # Errors
    /// When the pixels do not decode, or one of them is none that 16 bits can hold.
    pub fn read_into(&self, out: &mut [i16], k: usize) -> Result<(), VolumeFileError> {
        let format = &self.format;
        let raw = self.raw_pixels()?;
        let order = self.data.syntax.byte_order();
        for (offset, (bytes, voxel)) in raw.chunks_exact(format.bytes).zip(out).enumerate() {
            let stored = format.from_bits(bits(bytes, order) >> format.shift);
            let mut value = stored as f64 * format.slope + format.intercept;
            if let Some((low, high)) = format.padding
                && (low..=high).contains(&stored)
            {
                value = value.max(AIR);
            }
            *voxel = i16::from_file_value(value).map_err(|problem| VolumeFileError::Value {
                path: self.path().into(),
                voxel: [offset % self.columns, offset / self.columns, k],
                value,
                problem,
            })?;
        }
        Ok(())
    }

    /// The bytes of the slice's numbers.
    fn raw_pixels(&self) -> Result<Vec<u8>, VolumeFileError> {
        let (pixels, bytes) = (self.rows * self.columns, self.format.bytes);
        let broken = |reason| DicomProblem::Pixels(reason).at(self.path());
        let mut source = self.data.pixel_source()?;
        match self.data.syntax {
            Syntax::Rle => {
                let fragments = self.fragments(&mut *source)?;
                let [fragment] = fragments.as_slice() else {
                    let reason = format!("it has {} fragments, expected 1", fragments.len());
                    return Err(broken(reason));
                };
                rle::decode(fragment, pixels, bytes).map_err(broken)
            }
            Syntax::JpegLossless => {
                let stream = self.fragments(&mut *source)?.concat();
                jpeg::decode(&stream, self.rows, self.columns, bytes).map_err(broken)
            }
            _ => {
                let mut raw = vec![0; pixels * bytes];
                source
                    .read_exact(&mut raw)
                    .map_err(|e| io(self.path(), e))?;
                Ok(raw)
            }
        }
    }

    /// The fragments of encapsulated pixels, without the offset table before them.
    fn fragments(&self, source: &mut dyn Source) -> Result<Vec<Vec<u8>>, VolumeFileError> {
        let mut left = self.data.bytes.saturating_sub(self.data.pixels.offset);
        let broken = |reason: String| DicomProblem::Pixels(reason).at(self.path());
        let mut items = Vec::new();
        loop {
            let mut header = [0; 8];
            source
                .read_exact(&mut header)
                .map_err(|_| broken("it ends inside its fragments".into()))?;
            let length = u32::from_le_bytes(header[4..].try_into().expect("four bytes"));
            left = left.saturating_sub(8);
            match header[..4] {
                [0xfe, 0xff, 0x00, 0xe0] if u64::from(length) <= left => {}
                [0xfe, 0xff, 0x00, 0xe0] => {
                    return Err(broken(format!(
                        "a fragment claims {length} bytes where {left} are left"
                    )));
                }
                [0xfe, 0xff, 0xdd, 0xe0] => break,
                _ => return Err(broken("an item between its fragments is none".into())),
            }
            let mut item = Vec::new();
            source
                .take(length.into())
                .read_to_end(&mut item)
                .map_err(|e| io(self.path(), e))?;
            left -= u64::from(length);
            items.push(item);
        }
        if items.is_empty() {
            return Err(broken("it has no offset table".into()));
        }
        items.remove(0);
        Ok(items)
    }
}

/// The bits of a number of 1, 2 or 4 bytes.
#[inline]
fn bits(bytes: &[u8], order: ByteOrder) -> u32 {
    match (bytes, order) {
        (&[a], _) => a.into(),
        (&[a, b], ByteOrder::Little) => u16::from_le_bytes([a, b]).into(),
        (&[a, b], ByteOrder::Big) => u16::from_be_bytes([a, b]).into(),
        (&[a, b, c, d], ByteOrder::Little) => u32::from_le_bytes([a, b, c, d]),
        (&[a, b, c, d], ByteOrder::Big) => u32::from_be_bytes([a, b, c, d]),
        _ => unreachable!("1, 2 or 4 bytes a pixel"),
    }
}

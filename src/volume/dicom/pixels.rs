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
        let raw = self.raw_pixels()?;
        let order = self.data.syntax.byte_order();
        match (self.format.bytes, order) {
            (1, _) => self.convert(&raw, |[byte]: [u8; 1]| byte.into(), out, k),
            (2, ByteOrder::Little) => self.convert(&raw, |b| u16::from_le_bytes(b).into(), out, k),
            (2, ByteOrder::Big) => self.convert(&raw, |b| u16::from_be_bytes(b).into(), out, k),
            (_, ByteOrder::Little) => self.convert(&raw, u32::from_le_bytes, out, k),
            (_, ByteOrder::Big) => self.convert(&raw, u32::from_be_bytes, out, k),
        }
    }

    /// Turns the bytes of each number into Hounsfield units.
    fn convert<const N: usize>(
        &self,
        raw: &[u8],
        bits: impl Fn([u8; N]) -> u32,
        out: &mut [i16],
        k: usize,
    ) -> Result<(), VolumeFileError> {
        let format = &self.format;
        // Whole numbers need no rounding.
        let whole =
            [format.slope, format.intercept].map(|v| (v.fract() == 0.0).then_some(v as i64));
        for (offset, (bytes, voxel)) in raw.as_chunks::<N>().0.iter().zip(out).enumerate() {
            let stored = format.number(bits(*bytes));
            let padding = format
                .padding
                .is_some_and(|(low, high)| (low..=high).contains(&stored));
            if let ([Some(slope), Some(intercept)], false) = (whole, padding)
                && let Ok(value) = i16::try_from(stored * slope + intercept)
            {
                *voxel = value;
                continue;
            }
            let mut value = stored as f64 * format.slope + format.intercept;
            if padding {
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

//! What programs write between a NIfTI header and the voxels.

use super::read::{HEADER_BYTES, open, read_header};
use crate::volume::VolumeFileError;
use ::nifti::Endianness;
use std::io::Read;
use std::path::Path;

/// No extension is longer: names of labels take a few kilobytes.
const MOST_BYTES: u64 = 1 << 24;

/// An extension of a header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NiftiExtension {
    /// The registered code: 4 AFNI, 6 comment, 30 Caret, ...; programs also write text under 0.
    pub code: i32,
    /// Its bytes, with the zeros that fill it up to a multiple of 16.
    pub data: Vec<u8>,
}

/// Reads the extensions of a `.nii` or `.nii.gz` file; none where the header announces none, and
/// those that are whole where the last is not.
///
/// # Errors
/// When the file is no NIfTI-1 file.
pub fn read_nifti_extensions(path: &Path) -> Result<Vec<NiftiExtension>, VolumeFileError> {
    let mut stream = open(path)?;
    let header = read_header(&mut stream, path)?;
    let start = f64::from(header.vox_offset);
    let room = match start > HEADER_BYTES as f64 {
        true => (start as u64 - HEADER_BYTES).min(MOST_BYTES),
        false => 0,
    };
    let mut raw = Vec::new();
    // What a broken stream still gave is all there is.
    let _ = stream.take(room).read_to_end(&mut raw);
    let number = |bytes: &[u8]| -> i32 {
        let four = [bytes[0], bytes[1], bytes[2], bytes[3]];
        match header.endianness {
            Endianness::Little => i32::from_le_bytes(four),
            Endianness::Big => i32::from_be_bytes(four),
        }
    };
    let mut extensions = Vec::new();
    if raw.first().is_none_or(|&flag| flag == 0) {
        return Ok(extensions);
    }
    let mut rest = raw.get(4..).unwrap_or_default();
    while rest.len() >= 8 {
        let size = number(rest);
        let Some(data) = usize::try_from(size)
            .ok()
            .and_then(|size| rest.get(8..size))
        else {
            break;
        };
        extensions.push(NiftiExtension {
            code: number(&rest[4..]),
            data: data.to_vec(),
        });
        rest = &rest[8 + data.len()..];
    }
    Ok(extensions)
}

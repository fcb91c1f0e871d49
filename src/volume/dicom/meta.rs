//! The beginning of a DICOM file: the preamble and the meta group.

use super::data_set::attribute;
use super::problem::DicomProblem;
use super::syntax::Syntax;
use dicom_core::{PrimitiveValue, Tag};
use dicom_dictionary_std::{tags, uids};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};

/// Bytes before `DICM`.
const PREAMBLE_BYTES: u64 = 128;

/// Whether a file says that it is DICOM; then the next byte read is the first of its meta group.
pub(super) fn has_magic(file: &mut BufReader<File>) -> std::io::Result<bool> {
    let mut start = Vec::new();
    file.take(PREAMBLE_BYTES + 4).read_to_end(&mut start)?;
    Ok(start.get(PREAMBLE_BYTES as usize..) == Some(b"DICM".as_slice()))
}

/// What the meta group says, always in explicit VR little endian.
#[derive(Debug, Default)]
pub(super) struct Meta {
    sop_class: String,
    transfer_syntax: String,
}

impl Meta {
    /// Reads the group from its first byte, or from the file's, to its end. Its length is not
    /// relied upon: some writers leave it out or wrong.
    pub fn read(file: &mut BufReader<File>) -> Result<Self, DicomProblem> {
        let broken = |e: std::io::Error| match e.kind() {
            ErrorKind::UnexpectedEof => {
                DicomProblem::Structure("it ends inside its meta group (0002,xxxx)".into())
            }
            _ => DicomProblem::Structure(e.to_string()),
        };
        file.seek(SeekFrom::Start(PREAMBLE_BYTES + 4))
            .map_err(broken)?;
        let mut meta = Self::default();
        loop {
            let mut start = [0; 8];
            file.read_exact(&mut start).map_err(broken)?;
            let [g0, g1, e0, e1, v0, v1, l0, l1] = start;
            if u16::from_le_bytes([g0, g1]) != 0x0002 {
                file.seek_relative(-8).map_err(broken)?;
                return Ok(meta);
            }
            let length = match [v0, v1].as_slice() {
                b"OB" | b"OW" | b"UN" | b"UT" => {
                    let mut long = [0; 4];
                    file.read_exact(&mut long).map_err(broken)?;
                    u32::from_le_bytes(long)
                }
                _ => u16::from_le_bytes([l0, l1]).into(),
            };
            let field = match u16::from_le_bytes([e0, e1]) {
                0x0002 => &mut meta.sop_class,
                0x0010 => &mut meta.transfer_syntax,
                _ => {
                    file.seek_relative(length.into()).map_err(broken)?;
                    continue;
                }
            };
            let mut uid = Vec::new();
            file.take(length.min(64).into())
                .read_to_end(&mut uid)
                .map_err(broken)?;
            file.seek_relative(i64::from(length) - uid.len() as i64)
                .map_err(broken)?;
            let uid = String::from_utf8_lossy(&uid);
            *field = uid.trim_end_matches(['\0', ' ']).to_owned();
        }
    }

    pub fn syntax(&self) -> Result<Syntax, DicomProblem> {
        if self.transfer_syntax.is_empty() {
            return Err(DicomProblem::Missing {
                attribute: attribute(tags::TRANSFER_SYNTAX_UID),
                advice: "its encoding would be a guess: export it again",
            });
        }
        Syntax::of(&self.transfer_syntax)
    }

    /// A DICOMDIR.
    pub fn is_directory(&self) -> bool {
        self.sop_class == uids::MEDIA_STORAGE_DIRECTORY_STORAGE
    }

    pub fn is_ct(&self, values: &BTreeMap<Tag, PrimitiveValue>) -> bool {
        self.sop_class == uids::CT_IMAGE_STORAGE || values.contains_key(&tags::ROWS)
    }
}

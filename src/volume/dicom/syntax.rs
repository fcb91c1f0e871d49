//! The transfer syntaxes that are read, and what is said about the others.

use super::problem::DicomProblem;
use crate::volume::samples::ByteOrder;
use dicom_dictionary_std::uids;
use dicom_transfer_syntax_registry::{
    TransferSyntax, TransferSyntaxIndex, TransferSyntaxRegistry, entries,
};

/// Retired from the standard, but old files have it.
const EXPLICIT_VR_BIG_ENDIAN: &str = "1.2.840.10008.1.2.2";

/// How a file's data set and its pixels are encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Syntax {
    ImplicitLittle,
    ExplicitLittle,
    Deflated,
    ExplicitBig,
    Rle,
    JpegLossless,
}

impl Syntax {
    /// The syntax of a TransferSyntaxUID.
    ///
    /// # Errors
    /// With its name and what to do when it is not read.
    pub fn of(uid: &str) -> Result<Self, DicomProblem> {
        Ok(match uid {
            uids::IMPLICIT_VR_LITTLE_ENDIAN => Self::ImplicitLittle,
            uids::EXPLICIT_VR_LITTLE_ENDIAN => Self::ExplicitLittle,
            uids::DEFLATED_EXPLICIT_VR_LITTLE_ENDIAN => Self::Deflated,
            EXPLICIT_VR_BIG_ENDIAN => Self::ExplicitBig,
            uids::RLE_LOSSLESS => Self::Rle,
            uids::JPEG_LOSSLESS | uids::JPEG_LOSSLESS_SV1 => Self::JpegLossless,
            _ => {
                let name = TransferSyntaxRegistry
                    .get(uid)
                    .map_or("unknown", |syntax| syntax.name());
                let lossy = matches!(
                    uid,
                    uids::JPEG_BASELINE8_BIT
                        | uids::JPEG_EXTENDED12_BIT
                        | uids::JPEGLS_NEAR_LOSSLESS
                );
                return Err(DicomProblem::TransferSyntax {
                    uid: uid.into(),
                    name: name.into(),
                    advice: if lossy {
                        "its Hounsfield units are not the scanner's any more: export the original"
                    } else {
                        "decompress it first, for instance with 'gdcmconv --raw IN OUT' of GDCM"
                    },
                });
            }
        })
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::ImplicitLittle => "Implicit VR Little Endian",
            Self::ExplicitLittle => "Explicit VR Little Endian",
            Self::Deflated => "Deflated Explicit VR Little Endian",
            Self::ExplicitBig => "Explicit VR Big Endian",
            Self::Rle => "RLE Lossless",
            Self::JpegLossless => "JPEG Lossless",
        }
    }

    /// Whether the pixels are encapsulated, in fragments.
    pub fn is_encapsulated(self) -> bool {
        matches!(self, Self::Rle | Self::JpegLossless)
    }

    pub fn byte_order(self) -> ByteOrder {
        match self {
            Self::ExplicitBig => ByteOrder::Big,
            _ => ByteOrder::Little,
        }
    }

    /// What the parser must know of the data set, after it was inflated.
    pub fn of_data_set(self) -> TransferSyntax {
        match self {
            Self::ImplicitLittle => entries::IMPLICIT_VR_LITTLE_ENDIAN.erased(),
            Self::ExplicitBig => entries::EXPLICIT_VR_BIG_ENDIAN.erased(),
            _ => entries::EXPLICIT_VR_LITTLE_ENDIAN.erased(),
        }
    }

    /// Says so when the first element of a data set (its first 6 bytes) was not written in this
    /// syntax. Data sets begin with group 0008, or with a lower one.
    pub fn check_start(self, start: [u8; 6]) -> Result<(), DicomProblem> {
        let has_vr = start[4..].iter().all(u8::is_ascii_uppercase);
        let big = start[0] == 0 && start[1] != 0;
        let found = match (big, has_vr) {
            (true, true) => "its data set is in explicit VR big endian",
            (true, false) => "its data set is in no known encoding",
            (false, true) => "its data set is in explicit VR little endian",
            (false, false) => "its data set is in implicit VR little endian",
        };
        let as_named = match self {
            Self::ImplicitLittle => !big && !has_vr,
            Self::ExplicitBig => big && has_vr,
            _ => !big && has_vr,
        };
        if as_named {
            return Ok(());
        }
        Err(DicomProblem::WrongTransferSyntax {
            claimed: self.name(),
            found,
        })
    }

    /// The most pixel bytes that this many bytes of a file can hold: each pair of RLE's bytes
    /// becomes 128 at most, and a pixel of JPEG has at least one bit.
    pub fn most_pixel_bytes(self, file_bytes: u64, bytes_per_pixel: u64) -> u64 {
        match self {
            Self::Rle => file_bytes.saturating_mul(64),
            Self::JpegLossless => file_bytes.saturating_mul(8 * bytes_per_pixel),
            _ => file_bytes,
        }
    }
}

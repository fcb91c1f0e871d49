//! Compressed streams inside files.

use flate2::bufread::{GzDecoder, ZlibDecoder};
use flate2::write::{GzEncoder, ZlibEncoder};
use std::io::{BufRead, Read, Write};
use std::ops::Range;

/// Longest content that is looked at.
const MOST: u64 = 1 << 30;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Gzip,
    Zlib,
}

impl Kind {
    /// The kind of stream that may start here.
    fn at(bytes: &[u8]) -> Option<Self> {
        match bytes {
            [0x1f, 0x8b, 8, ..] => Some(Self::Gzip),
            [0x78, 0x01 | 0x5e | 0x9c | 0xda, ..] => Some(Self::Zlib),
            _ => None,
        }
    }

    pub fn compress(self, content: &[u8]) -> Vec<u8> {
        let level = flate2::Compression::fast();
        match self {
            Self::Gzip => {
                let mut stream = GzEncoder::new(Vec::new(), level);
                stream.write_all(content).expect("memory takes it");
                stream.finish()
            }
            Self::Zlib => {
                let mut stream = ZlibEncoder::new(Vec::new(), level);
                stream.write_all(content).expect("memory takes it");
                stream.finish()
            }
        }
        .expect("memory takes it")
    }
}

/// The first whole stream of some length: where it lies, and its content.
pub fn first(bytes: &[u8]) -> Option<(Range<usize>, Kind, Vec<u8>)> {
    (0..bytes.len()).find_map(|start| {
        let kind = Kind::at(&bytes[start..])?;
        let mut content = Vec::new();
        let mut rest = &bytes[start..];
        let whole = match kind {
            Kind::Gzip => GzDecoder::new(&mut rest)
                .take(MOST)
                .read_to_end(&mut content),
            Kind::Zlib => ZlibDecoder::new(&mut rest)
                .take(MOST)
                .read_to_end(&mut content),
        };
        let end = bytes.len() - rest.len();
        (whole.is_ok() && content.len() > 8).then_some((start..end, kind, content))
    })
}

/// Bytes that all that looks like a stream decompresses to, whole or broken.
pub fn decompressed(bytes: &[u8]) -> u64 {
    let starts = (0..bytes.len()).filter_map(|start| Some((start, Kind::at(&bytes[start..])?)));
    starts
        .map(|(start, kind)| match kind {
            Kind::Gzip => length(GzDecoder::new(&bytes[start..])),
            Kind::Zlib => length(ZlibDecoder::new(&bytes[start..])),
        })
        .sum()
}

fn length(stream: impl Read) -> u64 {
    let mut stream = std::io::BufReader::new(stream.take(MOST));
    let mut total = 0;
    while let Ok(found) = stream.fill_buf().map(<[u8]>::len)
        && found > 0
    {
        total += found as u64;
        stream.consume(found);
    }
    total
}

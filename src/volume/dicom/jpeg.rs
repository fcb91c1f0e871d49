//! JPEG Lossless (process 14), as DICOM files hold it.

use jpeg_decoder::{Decoder, PixelFormat};

/// What the stream's own headers say.
#[derive(Debug, PartialEq, Eq)]
struct Headers {
    precision: u8,
    rows: usize,
    columns: usize,
}

/// The little endian numbers, of `bytes` bytes each, of an image of one component.
///
/// # Errors
/// With what is wrong with the stream.
pub(super) fn decode(
    stream: &[u8],
    rows: usize,
    columns: usize,
    bytes: usize,
) -> Result<Vec<u8>, String> {
    let headers = headers(stream)?;
    if (headers.rows, headers.columns) != (rows, columns) {
        return Err(format!(
            "its JPEG stream has {} rows and {} columns, its header {rows} and {columns}",
            headers.rows, headers.columns
        ));
    }
    if usize::from(headers.precision) > 8 * bytes {
        return Err(format!(
            "its JPEG stream has {} bits a pixel, its header {}",
            headers.precision,
            8 * bytes
        ));
    }
    let mut decoder = Decoder::new(stream);
    let decoded = decoder.decode().map_err(|e| e.to_string())?;
    let wide = match decoder.info().map(|info| info.pixel_format) {
        Some(PixelFormat::L8) => 1,
        Some(PixelFormat::L16) => 2,
        other => return Err(format!("its JPEG stream has pixels of the kind {other:?}")),
    };
    if decoded.len() != rows * columns * wide {
        return Err(format!("its JPEG stream holds {} bytes", decoded.len()));
    }
    let mut out = vec![0; rows * columns * bytes];
    for (from, to) in decoded.chunks_exact(wide).zip(out.chunks_exact_mut(bytes)) {
        // The decoder's 16-bit numbers are in this machine's order.
        let value = match from {
            [value] => u16::from(*value),
            [a, b] => u16::from_ne_bytes([*a, *b]),
            _ => unreachable!("one or two bytes a pixel"),
        };
        let count = bytes.min(2);
        to[..count].copy_from_slice(&value.to_le_bytes()[..count]);
    }
    Ok(out)
}

/// Reads the marker segments up to the scan, and refuses what jpeg-decoder would decode wrongly
/// without a word: it ignores restart intervals in lossless images, and point transforms.
fn headers(stream: &[u8]) -> Result<Headers, String> {
    let early = || "its JPEG stream ends before its scan".to_owned();
    if !stream.starts_with(&[0xff, 0xd8]) {
        return Err("it is no JPEG stream".into());
    }
    let mut rest = &stream[2..];
    let mut headers = None;
    loop {
        let &[0xff, marker, ..] = rest else {
            return Err(early());
        };
        rest = &rest[1..];
        if marker == 0xff {
            continue;
        }
        let length = rest.get(1..3).ok_or_else(early)?;
        let length = usize::from(u16::from_be_bytes([length[0], length[1]]));
        let body = rest.get(3..1 + length).ok_or_else(early)?;
        match marker {
            0xc3 => {
                let &[precision, r0, r1, c0, c1, components, ..] = body else {
                    return Err(early());
                };
                if components != 1 {
                    return Err(format!("its JPEG stream has {components} components"));
                }
                headers = Some(Headers {
                    precision,
                    rows: usize::from(u16::from_be_bytes([r0, r1])),
                    columns: usize::from(u16::from_be_bytes([c0, c1])),
                });
            }
            // Tables and application data.
            0xc4 | 0xdb | 0xe0..=0xef | 0xfe => {}
            0xda => {
                let headers = headers.ok_or("its JPEG stream has no lossless frame")?;
                // The last byte: high and low bit of the point transform.
                return match body.last() {
                    Some(0) => Ok(headers),
                    _ => Err("its JPEG stream has a point transform".into()),
                };
            }
            0xdd if body == [0, 0] => {}
            0xdd => return Err("its JPEG stream has restart intervals".into()),
            other => return Err(format!("its JPEG stream has a marker FF{other:02X}")),
        }
        rest = &rest[1 + length..];
    }
}

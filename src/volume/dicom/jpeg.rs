//! JPEG Lossless (process 14), as DICOM files hold it.

use jpeg_decoder::{Decoder, PixelFormat};

/// What the stream's own headers say.
#[derive(Debug, PartialEq, Eq)]
struct Headers {
    precision: u8,
    rows: usize,
    columns: usize,
    /// Where the first byte of the scan lies.
    scan: usize,
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
    let stream = with_end_of_ones(stream, headers.scan);
    let mut decoder = Decoder::new(stream.as_slice());
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

/// The stream up to the end of its scan, then ones. jpeg-decoder fills a scan that ends early with
/// zeros and says nothing; but no Huffman code of JPEG is all ones, so these make it an error.
fn with_end_of_ones(stream: &[u8], scan: usize) -> Vec<u8> {
    let is_marker = |pair: &[u8]| pair[0] == 0xff && pair[1] != 0;
    let length = stream[scan..].windows(2).position(is_marker);
    let mut out = stream[..length.map_or(stream.len(), |length| scan + length)].to_vec();
    // 64 bits, each byte with the zero that tells it from a marker: a number has at most 31.
    out.extend([0xff, 0].repeat(8));
    out.extend([0xff, 0xd9]);
    out
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
                    scan: 0,
                });
            }
            // Tables and application data.
            0xc4 | 0xdb | 0xe0..=0xef | 0xfe => {}
            0xda => {
                let frame = headers.ok_or("its JPEG stream has no lossless frame")?;
                // The last byte: high and low bit of the point transform.
                return match body.last() {
                    Some(0) => Ok(Headers {
                        scan: stream.len() - rest.len() + 1 + length,
                        ..frame
                    }),
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The stream of the first slice, as DCMTK wrote it.
    fn stream() -> Vec<u8> {
        let path = "tests/data/dicom/encodings/jpeg_lossless.dcm";
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
        let file = std::fs::read(path).unwrap();
        let find = |what: &[u8]| file.windows(what.len()).rposition(|w| w == what).unwrap();
        file[find(&[0xff, 0xd8, 0xff])..find(&[0xff, 0xd9]) + 2].to_vec()
    }

    #[test]
    fn a_stream_that_ends_early_is_no_image() {
        let whole = stream();
        decode(&whole, 4, 5, 2).unwrap();
        let mut passed = Vec::new();
        for length in 0..whole.len() - 2 {
            for end in [&[][..], &[0xff, 0xd9], &[0xff, 0xd8, 0xff, 0xd9]] {
                let cut = [&whole[..length], end].concat();
                if decode(&cut, 4, 5, 2).is_ok() {
                    passed.push(whole.len() - 2 - length);
                }
            }
        }
        // Bytes that are missing: only a part of the last pixel may be.
        assert!(passed.iter().all(|&missing| missing <= 1), "{passed:?}");
    }

    #[test]
    fn what_the_decoder_gets_wrong_is_refused() {
        let whole = stream();
        let scan = whole.windows(2).position(|w| w == [0xff, 0xda]).unwrap();
        let with = |at: usize, bytes: &[u8]| {
            let mut changed = whole.clone();
            changed.splice(at..at, bytes.iter().copied());
            decode(&changed, 4, 5, 2).unwrap_err()
        };
        let restarts = with(2, &[0xff, 0xdd, 0, 4, 0, 5]);
        assert!(restarts.contains("restart intervals"), "{restarts}");
        let other = with(2, &[0xff, 0xc0, 0, 2]);
        assert!(other.contains("marker FFC0"), "{other}");
        let mut transformed = whole.clone();
        // Length (2), components (1 + 2), predictor, unused, point transform.
        transformed[scan + 9] = 1;
        let error = decode(&transformed, 4, 5, 2).unwrap_err();
        assert!(error.contains("point transform"), "{error}");
        let error = decode(&whole, 5, 4, 2).unwrap_err();
        assert!(
            error.contains("has 4 rows and 5 columns, its header 5 and 4"),
            "{error}"
        );
        let error = decode(&whole, 4, 5, 1).unwrap_err();
        assert!(error.contains("bits a pixel, its header 8"), "{error}");
    }
}

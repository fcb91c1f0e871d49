//! DICOM's RLE Lossless (PS3.5, annex G): one PackBits stream for each byte of the pixels, the most
//! significant first.

/// Bytes of the header: the number of segments and the places of 15.
const HEADER_BYTES: usize = 64;

/// The little endian numbers, of `bytes` bytes each, of `pixels` pixels.
///
/// # Errors
/// With what is wrong with the stream.
pub(super) fn decode(fragment: &[u8], pixels: usize, bytes: usize) -> Result<Vec<u8>, String> {
    let word = |n: usize| -> Result<usize, String> {
        let raw = fragment
            .get(4 * n..4 * n + 4)
            .ok_or("it is shorter than the header of RLE")?;
        Ok(u32::from_le_bytes(raw.try_into().expect("four bytes")) as usize)
    };
    let segments = word(0)?;
    if segments != bytes {
        return Err(format!("it has {segments} RLE segments, expected {bytes}"));
    }
    let mut out = vec![0; pixels * bytes];
    for segment in 0..segments {
        let start = word(1 + segment)?;
        let end = match segment + 1 {
            next if next < segments => word(1 + next)?,
            _ => fragment.len(),
        };
        let packed = (start >= HEADER_BYTES)
            .then(|| fragment.get(start..end))
            .flatten()
            .ok_or_else(|| format!("its RLE segment {segment} lies at bytes {start} to {end}"))?;
        let plane = out.iter_mut().skip(bytes - 1 - segment).step_by(bytes);
        unpack(packed, plane).map_err(|found| {
            format!("its RLE segment {segment} holds {found} of {pixels} pixels")
        })?;
    }
    Ok(out)
}

/// Unpacks PackBits to `plane`; on an early end the error is the number of bytes unpacked. What
/// follows the last pixel is padding.
fn unpack<'a>(packed: &[u8], mut plane: impl Iterator<Item = &'a mut u8>) -> Result<(), usize> {
    let mut input = packed.iter().copied();
    let mut done = 0_usize;
    let mut left_in_run = 0_usize;
    let mut repeated = None;
    loop {
        let Some(target) = plane.next() else {
            return Ok(());
        };
        while left_in_run == 0 {
            let control = input.next().ok_or(done)? as i8;
            (left_in_run, repeated) = match control {
                0.. => (control as usize + 1, None),
                -128 => (0, None),
                _ => (
                    1 + usize::from(control.unsigned_abs()),
                    Some(input.next().ok_or(done)?),
                ),
            };
        }
        *target = match repeated {
            Some(byte) => byte,
            None => input.next().ok_or(done)?,
        };
        left_in_run -= 1;
        done += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream(segments: &[&[u8]]) -> Vec<u8> {
        let mut out = (segments.len() as u32).to_le_bytes().to_vec();
        let mut at = HEADER_BYTES as u32;
        for segment in segments {
            out.extend(at.to_le_bytes());
            at += segment.len() as u32;
        }
        out.resize(HEADER_BYTES, 0);
        out.extend(segments.concat());
        out
    }

    #[test]
    fn the_standards_example_of_packing_and_both_bytes() {
        // Literal run of 3, a no-op, a repeated run of 3.
        let high: &[u8] = &[2, 1, 2, 3, 0x80, 0xfe, 7];
        let low: &[u8] = &[0xfb, 9, 0];
        let pixels = decode(&stream(&[high, low]), 6, 2).unwrap();
        let pixels: Vec<u16> = pixels
            .chunks(2)
            .map(|b| u16::from_le_bytes([b[0], b[1]]))
            .collect();
        assert_eq!(pixels, [0x109, 0x209, 0x309, 0x709, 0x709, 0x709]);
    }

    #[test]
    fn broken_streams_are_named() {
        let refused = |fragment: &[u8]| decode(fragment, 4, 1).unwrap_err();
        assert!(refused(&[1, 0]).contains("shorter than the header"));
        assert!(refused(&stream(&[&[1, 5, 5]])).contains("segment 0 holds 2 of 4 pixels"));
        assert!(refused(&stream(&[&[2, 5, 5]])).contains("segment 0 holds 2 of 4 pixels"));
        assert!(refused(&stream(&[&[0xfd]])).contains("segment 0 holds 0 of 4 pixels"));
        assert!(refused(&stream(&[&[], &[]])).contains("2 RLE segments, expected 1"));
        let mut outside = stream(&[&[0xfd, 1]]);
        outside[4] = 0xff;
        assert!(refused(&outside).contains("lies at bytes 255 to 66"));
    }
}

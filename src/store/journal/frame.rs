//! Frames: length, kind, payload, checksum.

/// Opens every journal; the last byte is the format's version.
pub(super) const MAGIC: [u8; 8] = *b"PAO-SIM\x02";

/// Bytes of a frame around its payload.
const OVERHEAD: usize = 4 + 1 + 4;

/// Appends a frame to `out`.
pub(super) fn write(out: &mut Vec<u8>, kind: u8, payload: &[u8]) {
    let start = out.len();
    let length = u32::try_from(payload.len()).expect("a record is far below 4 GiB");
    out.extend_from_slice(&length.to_le_bytes());
    out.push(kind);
    out.extend_from_slice(payload);
    let checksum = crc32fast::hash(&out[start..]);
    out.extend_from_slice(&checksum.to_le_bytes());
}

/// The frame at the beginning of `bytes`: its kind, its payload and its length. `None` when it is
/// cut or damaged.
pub(super) fn read(bytes: &[u8]) -> Option<(u8, &[u8], usize)> {
    let length = u32::from_le_bytes(bytes.get(..4)?.try_into().ok()?) as usize;
    let end = OVERHEAD.checked_add(length)?;
    let frame = bytes.get(..end)?;
    let (body, checksum) = frame.split_at(end - 4);
    (checksum == crc32fast::hash(body).to_le_bytes()).then(|| (body[4], &body[5..], end))
}

//! Damage to a file's bytes.

use super::streams;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::ops::Range;

/// What numbers in a text are replaced by.
const NUMBERS: [&str; 25] = [
    "",
    "0",
    "-0",
    "1",
    "-1",
    "2",
    "3",
    "255",
    "256",
    "65535",
    "65536",
    "1000000",
    "2147483647",
    "-2147483648",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551616",
    "1e12",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "-inf",
];

/// What binary numbers are replaced by, in either byte order.
const BITS: [u64; 16] = [
    0,
    1,
    2,
    3,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0x8000,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7fc0_0000, // a NaN of 32 bits
    0x7f80_0000, // infinity
    u64::MAX,
];

/// Headers lie here: half of all damage is done in them.
const HEAD: usize = 800;

/// Damages the bytes in one to four places.
pub fn damage(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(1..=4) {
        // Behind compression, where the stream's own checks keep damage away.
        if rng.random_bool(0.3)
            && let Some((range, kind, mut content)) = streams::first(bytes)
        {
            once(&mut content, rng);
            bytes.splice(range, kind.compress(&content));
        } else {
            once(bytes, rng);
        }
    }
}

fn once(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    if bytes.is_empty() {
        bytes.push(rng.random());
        return;
    }
    match rng.random_range(0..12) {
        0 => {
            for _ in 0..rng.random_range(1..=8) {
                let at = place(bytes, rng);
                bytes[at] ^= 1 << rng.random_range(0..8);
            }
        }
        1 => {
            let at = place(bytes, rng);
            bytes[at] = rng.random();
        }
        2 => bytes.truncate(rng.random_range(0..bytes.len())),
        3 => {
            let at = place(bytes, rng);
            let new: Vec<u8> = (0..rng.random_range(1..64)).map(|_| rng.random()).collect();
            bytes.splice(at..at, new);
        }
        4 => {
            let part = part(bytes, rng);
            let copy = bytes[part].to_vec();
            let at = place(bytes, rng);
            bytes.splice(at..at, copy);
        }
        5 => {
            let part = part(bytes, rng);
            bytes.drain(part);
        }
        6..=8 => number(bytes, rng),
        9 => bits(bytes, rng),
        10 => bits(bytes, rng),
        _ => line(bytes, rng),
    }
}

fn place(bytes: &[u8], rng: &mut ChaCha8Rng) -> usize {
    let end = if rng.random_bool(0.5) {
        HEAD
    } else {
        usize::MAX
    };
    rng.random_range(0..bytes.len().min(end))
}

/// Up to 64 bytes.
fn part(bytes: &[u8], rng: &mut ChaCha8Rng) -> Range<usize> {
    let start = place(bytes, rng);
    start..(start + rng.random_range(1..=64)).min(bytes.len())
}

/// Replaces a number that is written as text.
fn number(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    let is_part = |b: &u8| b.is_ascii_digit() || b"+-.eE".contains(b);
    let start = place(bytes, rng);
    let Some(from) = (start..bytes.len()).find(|&n| bytes[n].is_ascii_digit()) else {
        return bits(bytes, rng);
    };
    let before = bytes[..from]
        .iter()
        .rev()
        .take_while(|b| is_part(b))
        .count();
    let after = bytes[from..].iter().take_while(|b| is_part(b)).count();
    let new = NUMBERS[rng.random_range(0..NUMBERS.len())];
    bytes.splice(from - before..from + after, new.bytes());
}

/// Replaces a binary number of 1, 2, 4 or 8 bytes.
fn bits(bytes: &mut [u8], rng: &mut ChaCha8Rng) {
    let size = 1 << rng.random_range(0..4);
    let at = place(bytes, rng) / size * size;
    let number = BITS[rng.random_range(0..BITS.len())];
    let new = match rng.random_bool(0.5) {
        true => number.to_le_bytes()[..size].to_vec(),
        false => number.to_be_bytes()[8 - size..].to_vec(),
    };
    for (old, new) in bytes[at..].iter_mut().zip(new) {
        *old = new;
    }
}

/// Doubles a line of text, takes it away, or puts it elsewhere.
fn line(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    let at = place(bytes, rng);
    let start = bytes[..at]
        .iter()
        .rposition(|&b| b == b'\n')
        .map_or(0, |n| n + 1);
    let end = bytes[at..]
        .iter()
        .position(|&b| b == b'\n')
        .map_or(bytes.len(), |n| at + n + 1);
    let line = bytes[start..end].to_vec();
    if rng.random_bool(0.7) {
        bytes.drain(start..end);
    }
    if rng.random_bool(0.7) && !bytes.is_empty() {
        let near = rng.random_range(0..bytes.len().min(HEAD));
        let to = bytes[..near]
            .iter()
            .rposition(|&b| b == b'\n')
            .map_or(0, |n| n + 1);
        bytes.splice(to..to, line);
    }
}

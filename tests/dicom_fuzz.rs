//! Broken DICOM files: whatever bytes a file has, the reader gives a volume or an error.

use rand::{Rng, RngExt, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

const SEEDS: [&str; 7] = [
    "explicit",
    "implicit",
    "big_endian",
    "deflated",
    "rle",
    "jpeg_lossless",
    "jpeg_lossless_p14",
];

fn encoding(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/data/dicom/encodings")
        .join(format!("{name}.dcm"))
}

/// Reads the series that a file makes with the second slice, so that its pixels are decoded. The file must
/// lie in a folder of its own.
fn read_with_second_slice(path: &Path) -> bool {
    let folder = path.parent().expect("a file in a folder");
    let second = folder.join("second");
    if !second.is_file() {
        std::fs::copy(encoding("second"), &second).unwrap();
    }
    pao_sim::volume::read_dicom_series(folder).is_ok()
}

/// One to eight changes of bytes, lengths or order.
fn mutate(bytes: &mut Vec<u8>, rng: &mut impl Rng) {
    const ODD: [u8; 9] = [0, 1, 2, 0x0f, 0x7f, 0x80, 0xe0, 0xfe, 0xff];
    for _ in 0..rng.random_range(1..=8) {
        if bytes.is_empty() {
            return;
        }
        // Mostly behind the preamble, which nobody reads.
        let from = if bytes.len() > 132 && rng.random_bool(0.95) {
            132.min(bytes.len() - 1)
        } else {
            0
        };
        let at = rng.random_range(from..bytes.len());
        match rng.random_range(0..8) {
            0 => bytes[at] ^= 1 << rng.random_range(0..8),
            1 => bytes[at] = *ODD.choose(rng).expect("not empty"),
            2 => bytes[at] = rng.random(),
            3 => {
                let width = [2, 4][rng.random_range(0..2)].min(bytes.len() - at);
                let value = *ODD.choose(rng).expect("not empty");
                bytes[at..at + width].fill(value);
            }
            4 => bytes.truncate(at),
            5 => {
                let end = (at + rng.random_range(1..32)).min(bytes.len());
                bytes.drain(at..end);
            }
            6 => {
                let end = (at + rng.random_range(1..64)).min(bytes.len());
                let copy = bytes[at..end].to_vec();
                let to = rng.random_range(from..=bytes.len());
                bytes.splice(to..to, copy);
            }
            _ => {
                let other = rng.random_range(from..bytes.len());
                bytes.swap(at, other);
            }
        }
    }
}

#[test]
fn broken_files_are_refused_and_no_more() {
    let seconds = std::env::var("PAO_SIM_FUZZ_SECONDS").map_or(3, |s| s.parse().unwrap());
    let first = std::env::var("PAO_SIM_FUZZ_SEED").map_or(0, |s| s.parse().unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(first);
    let seeds = SEEDS.map(|name| std::fs::read(encoding(name)).unwrap());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("mutated");
    let (mut files, mut read) = ([0; SEEDS.len()], [0; SEEDS.len()]);
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(seconds) {
        let seed = rng.random_range(0..SEEDS.len());
        let mut bytes = seeds[seed].clone();
        mutate(&mut bytes, &mut rng);
        std::fs::write(&file, &bytes).unwrap();
        let outcome = std::panic::catch_unwind(|| read_with_second_slice(&file));
        let Ok(ok) = outcome else {
            let kept = std::env::temp_dir().join(format!("broken-{}.dcm", SEEDS[seed]));
            std::fs::write(&kept, &bytes).unwrap();
            panic!("the reader panicked; the file is {}", kept.display());
        };
        files[seed] += 1;
        read[seed] += usize::from(ok);
    }
    for (seed, name) in SEEDS.iter().enumerate() {
        println!("{name}: {} files, {} read", files[seed], read[seed]);
    }
    if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
        let peak = status.lines().find(|line| line.starts_with("VmHWM"));
        println!("{}", peak.unwrap_or_default());
    }
    // Some changes do no harm: the reader got as far as the voxels in every encoding.
    assert!(read.iter().all(|&n| n > 0), "{read:?} of {files:?}");
}

//! Readers of points and surfaces beside changed bytes of good files: each gives a value or an error,
//! ends soon, and takes memory in proportion to the file.
//!
//! `PAO_SIM_FUZZ_SECONDS` (default 2) is the time for all readers together.

use pao_sim::anatomy::PatientFrame;
use pao_sim::anatomy::landmark_files::read_landmark_overrides;
use pao_sim::anatomy::surfaces::read_closed_surface;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::alloc::{GlobalAlloc, Layout, System};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// A reader, the ending of its files, and the folder of good ones.
struct Entry {
    name: &'static str,
    read: fn(&Path),
    ending: &'static str,
    folder: &'static str,
}

const ENTRIES: [Entry; 7] = [
    surface("ply"),
    surface("stl"),
    surface("vtk"),
    surface("obj"),
    points("fcsv"),
    points("mrk.json"),
    points("csv"),
];

const fn surface(ending: &'static str) -> Entry {
    Entry {
        name: ending,
        read: |path| drop(read_closed_surface(path, PatientFrame::Ras)),
        ending,
        folder: "surfaces",
    }
}

const fn points(ending: &'static str) -> Entry {
    Entry {
        name: ending,
        read: |path| drop(read_landmark_overrides(path)),
        ending,
        folder: "points",
    }
}

/// No reader may take longer for a file of a few kB.
const MAX_TIME: Duration = Duration::from_secs(2);

/// Bytes of memory that a reader may take: so much, and so many times the file.
const MAX_MEMORY: (usize, usize) = (16 << 20, 200);

/// What number parsers, counts and frames stumble over.
const WORDS: [&str; 18] = [
    "0",
    "-1",
    "3",
    "255",
    "4294967295",
    "4294967296",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "99999999999999999999999",
    "1e308",
    "1e-320",
    "nan",
    "-inf",
    "SPACE=RAS",
    "\n",
    "\0",
    "\u{ffff}",
];

/// Counts what is allocated.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(now, Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn seeds(entry: &Entry) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let files = std::fs::read_dir(folder.join(entry.folder)).unwrap();
    let mut paths: Vec<PathBuf> = files.map(|file| file.unwrap().path()).collect();
    paths.retain(|path| {
        path.to_str()
            .unwrap()
            .ends_with(&format!(".{}", entry.ending))
    });
    paths.sort();
    paths
        .iter()
        .map(|path| std::fs::read(path).unwrap())
        .collect()
}

fn place(rng: &mut impl Rng, length: usize) -> usize {
    rng.random_range(0..=length)
}

/// One change of the bytes.
fn change(bytes: &mut Vec<u8>, seeds: &[Vec<u8>], rng: &mut impl Rng) {
    let at = place(rng, bytes.len());
    let until = (at + rng.random_range(0..40)).min(bytes.len());
    match rng.random_range(0..9) {
        0 if at < bytes.len() => bytes[at] = rng.random(),
        1 if at < bytes.len() => bytes[at] ^= 1 << rng.random_range(0..8),
        2 => bytes.insert(at, rng.random()),
        3 => drop(bytes.drain(at..until)),
        4 => {
            let part = bytes[at..until].to_vec();
            let to = place(rng, bytes.len());
            bytes.splice(to..to, part);
        }
        5 => bytes.truncate(at),
        6 => {
            // A word, or what stands in its place in a binary file.
            let end = bytes[at..].iter().position(u8::is_ascii_whitespace);
            let end = at + end.unwrap_or(0);
            let word = WORDS[rng.random_range(0..WORDS.len())];
            bytes.splice(at..end, word.bytes());
        }
        7 => {
            let value: u32 =
                [0, 1, u32::MAX, u32::MAX - 1, 1 << 31, 1 << 24][rng.random_range(0..6)];
            for (byte, new) in bytes[at..].iter_mut().zip(value.to_le_bytes()) {
                *byte = new;
            }
        }
        _ => {
            let other = &seeds[rng.random_range(0..seeds.len())];
            let from = place(rng, other.len());
            bytes.truncate(at);
            bytes.extend(&other[from..]);
        }
    }
}

#[test]
fn changed_files_give_a_value_or_an_error() {
    let seconds = std::env::var("PAO_SIM_FUZZ_SECONDS").map_or(2.0, |s| s.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    for entry in &ENTRIES {
        let seeds = seeds(entry);
        assert!(!seeds.is_empty(), "{}", entry.name);
        let path = folder.path().join(format!("file.{}", entry.ending));
        let end = Instant::now() + Duration::from_secs_f64(seconds / ENTRIES.len() as f64);
        let (mut files, mut most, mut longest) = (0u64, 0, Duration::ZERO);
        while Instant::now() < end || files == 0 {
            // The number of a file makes it again.
            let mut rng = ChaCha8Rng::seed_from_u64(files);
            let mut bytes = seeds[rng.random_range(0..seeds.len())].clone();
            for _ in 0..rng.random_range(1..6) {
                change(&mut bytes, &seeds, &mut rng);
            }
            std::fs::write(&path, &bytes).unwrap();
            let before = NOW.load(Ordering::Relaxed);
            PEAK.store(before, Ordering::Relaxed);
            let begin = Instant::now();
            let ended = std::panic::catch_unwind(|| (entry.read)(&path));
            let took = begin.elapsed();
            let memory = PEAK.load(Ordering::Relaxed) - before;
            let (base, times) = MAX_MEMORY;
            let sound = ended.is_ok() && took < MAX_TIME && memory <= base + times * bytes.len();
            if !sound {
                let kept = std::env::temp_dir().join(format!("fuzz-{files}.{}", entry.ending));
                std::fs::write(&kept, &bytes).unwrap();
                panic!(
                    "{} of {} bytes: panicked {}, {took:?}, {memory} bytes of memory",
                    kept.display(),
                    bytes.len(),
                    ended.is_err()
                );
            }
            files += 1;
            most = most.max(memory);
            longest = longest.max(took);
        }
        println!(
            "{}: {files} files, {} kB of memory and {longest:?} at most",
            entry.name,
            most / 1024
        );
    }
}

//! Reads damaged files until the time is over.

use super::damage::damage;
use super::memory::{PLACE, Peak, last_words};
use super::{Reader, Seed, streams};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};

/// A read that takes longer hangs. A healthy one takes a ten-thousandth of it.
const HANG: Duration = Duration::from_secs(60);

/// Where a panic happened.
static PANIC: Mutex<String> = Mutex::new(String::new());

/// Milliseconds since the start at which the present read began; 0 when none is on.
static BEGAN: AtomicU64 = AtomicU64::new(0);

/// Reads damaged files with every reader, each for an equal share of the time.
///
/// # Panics
/// When a reader panics or takes too much memory, after all have had their time; the message says where the
/// files lie. A read that hangs, or asks for more memory than there is, ends the process.
pub fn fuzz(readers: Vec<Reader>) {
    let seconds: f64 = setting("PAO_SIM_FUZZ_SECONDS", 4.0);
    let share = Duration::from_secs_f64(seconds / readers.len() as f64);
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("readers_fuzz");
    // In memory where there is such a folder: disks take longer than readers.
    let fast = Path::new("/dev/shm");
    let folder = if fast.is_dir() { fast } else { &place };
    let work = folder.join(format!("readers_fuzz-{}", std::process::id()));
    PLACE.get_or_init(|| work.display().to_string());
    watch();
    std::panic::set_hook(Box::new(|info| match BEGAN.load(Relaxed) {
        0 => eprintln!("{info}"),
        _ => *PANIC.lock().expect("no panic holds it") = info.to_string(),
    }));
    let mut findings = BTreeMap::new();
    for reader in &readers {
        Fuzzing {
            reader,
            place: &place,
            work: &work,
            findings: &mut findings,
        }
        .run(share);
        std::fs::remove_dir_all(&work).expect("the work folder can be removed");
    }
    let _ = std::panic::take_hook();
    assert!(findings.is_empty(), "{findings:#?}");
}

/// A number from the environment.
fn setting<T: std::str::FromStr>(name: &str, default: T) -> T {
    match std::env::var(name) {
        Ok(text) => text
            .parse()
            .unwrap_or_else(|_| panic!("{name} is '{text}'; expected a number")),
        Err(_) => default,
    }
}

/// Ends the process when a read hangs.
fn watch() {
    let start = Instant::now();
    BEGAN.store(0, Relaxed);
    START.get_or_init(|| start);
    std::thread::spawn(|| {
        loop {
            std::thread::sleep(Duration::from_secs(1));
            let began = BEGAN.load(Relaxed);
            if began != 0 && now_ms() > began + HANG.as_millis() as u64 {
                last_words(&format_args!("a read takes more than {} s", HANG.as_secs()));
            }
        }
    });
}

static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();

/// Milliseconds since the start, from 1.
fn now_ms() -> u64 {
    START
        .get()
        .map_or(1, |s| s.elapsed().as_millis() as u64 + 1)
}

struct Fuzzing<'a> {
    reader: &'a Reader,
    place: &'a Path,
    work: &'a Path,
    /// By what was found, so that each is told once.
    findings: &'a mut BTreeMap<String, PathBuf>,
}

impl Fuzzing<'_> {
    fn run(&mut self, share: Duration) {
        let seed: u64 = setting("PAO_SIM_FUZZ_SEED", 1);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mut reads, mut taken, mut most) = (0_u64, 0_u64, 0);
        let mut longest = Duration::ZERO;
        for (number, seed) in self.reader.seeds.iter().enumerate() {
            let folder = self.work.join(number.to_string());
            write(seed, &folder);
            let whole = self.read(seed, &folder);
            assert!(
                matches!(&whole, Some((Ok(()), ..))),
                "{} does not read its valid file {}: {:?}",
                self.reader.name,
                seed.files[0].0,
                whole.map(|w| w.0)
            );
        }
        let start = Instant::now();
        while start.elapsed() < share {
            let number = rng.random_range(0..self.reader.seeds.len());
            let mut seed = self.reader.seeds[number].clone();
            let folder = self.work.join(number.to_string());
            let file = rng.random_range(0..seed.files.len());
            let (name, bytes) = &mut seed.files[file];
            let path = folder.join(name);
            let whole = bytes.clone();
            damage(bytes, &mut rng);
            reads += 1;
            std::fs::write(&path, bytes).expect("the file can be written");
            let found = self.read(&seed, &folder);
            std::fs::write(&path, whole).expect("the file can be written");
            if let Some((result, peak, took)) = found {
                taken += u64::from(result.is_ok());
                most = most.max(peak);
                longest = longest.max(took);
            }
        }
        println!(
            "{}: {reads} damaged files, {taken} of them taken, at most {} kB and {} ms each",
            self.reader.name,
            most / 1000,
            longest.as_millis()
        );
    }

    /// What a reader says of a seed whose files lie in `folder`, the memory it took and the time; `None` when it panics.
    fn read(&mut self, seed: &Seed, folder: &Path) -> Option<(Result<(), String>, u64, Duration)> {
        let path = folder.join(&seed.files[0].0);
        let read = self.reader.read;
        let start = Instant::now();
        BEGAN.store(now_ms(), Relaxed);
        let peak = Peak::start();
        let result = std::panic::catch_unwind(|| read(&path));
        let peak = peak.bytes() as u64;
        BEGAN.store(0, Relaxed);
        let took = start.elapsed();
        let Ok(result) = result else {
            let panic = PANIC.lock().expect("no panic holds it").clone();
            self.found(format!("{}: {panic}", self.reader.name), seed);
            return None;
        };
        let stored: u64 = seed.files.iter().map(|(_, bytes)| bytes.len() as u64).sum();
        let (times, constant) = self.reader.memory;
        let within = |bytes: u64| peak <= times * bytes + constant;
        if !within(stored) {
            let inside: u64 = seed
                .files
                .iter()
                .map(|(_, b)| streams::decompressed(b))
                .sum();
            if !within(stored + inside) {
                // One of a kind is enough.
                let size = peak.next_power_of_two();
                let name = self.reader.name;
                self.found(format!("{name}: up to {size} bytes of memory"), seed);
                println!(
                    "{name}: {peak} bytes of memory for a file of {stored}, {inside} decompressed"
                );
            }
        }
        Some((result, peak, took))
    }

    fn found(&mut self, what: String, seed: &Seed) {
        if self.findings.contains_key(&what) {
            return;
        }
        let number = self.findings.len() + 1;
        let folder = self.place.join(format!("{}-{number}", self.reader.name));
        write(seed, &folder);
        println!("FINDING {what}: {}", folder.display());
        self.findings.insert(what, folder);
    }
}

/// Makes a folder hold the seed's files and no others.
fn write(seed: &Seed, folder: &Path) {
    let _ = std::fs::remove_dir_all(folder);
    std::fs::create_dir_all(folder).expect("the folder can be made");
    for (name, bytes) in &seed.files {
        std::fs::write(folder.join(name), bytes).expect("the file can be written");
    }
}

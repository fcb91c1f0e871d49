//! The engine without any work: 72,000 registrations that take no time.
//! `cargo bench --bench engine [-- ROWS]`.
//!
//! Prints time and bytes of a run, of its continuation, and of what is told of it.

#[path = "../tests/noop/mod.rs"]
mod noop;

use pao_sim::report::{About, Rows, write};
use pao_sim::study::cost::{Cost, Rates};
use pao_sim::study::{Plan, Shard, Snapshot, Status, StudyFolder};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

fn main() {
    let rows: u32 = std::env::args()
        .skip(1)
        .find_map(|argument| argument.parse().ok())
        .unwrap_or(72_000);
    // As in the paper, with as many movements as the rows ask for.
    let movements = (rows / (6 * 2 * 15 * 5 * 4)).max(1);
    let config = format!("[study]\nname = \"engine\"\n[movement]\nmovements = {movements}\n");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let results = folder.path();

    let begin = Instant::now();
    let outcome = noop::run_share(&config, results, Shard::WHOLE, 2, Duration::ZERO).expect("runs");
    let seconds = begin.elapsed().as_secs_f64();
    let count = outcome.share.done;
    println!("{count} rows, one process of 2 threads");
    println!(
        "run, table included      {seconds:8.2} s, {:.3} ms a row",
        1e3 * seconds / count as f64
    );
    let study = results.join("engine");
    println!(
        "part                     {:8.1} MB",
        megabytes(&study.join("parts"))
    );
    println!(
        "registrations.parquet    {:8.1} MB",
        megabytes(&study.join("registrations.parquet"))
    );

    time("continue, nothing left", || {
        noop::run_share(&config, results, Shard::WHOLE, 2, Duration::ZERO).expect("runs");
    });
    let read = || Snapshot::read(StudyFolder::of(results, "engine")).expect("reads");
    time("status", || {
        assert_eq!(Status::of(&read()).done, count);
    });
    time("plan --remaining", || {
        let study = read();
        let rates = Rates::of_rows(&study.plan, &study.state);
        let cost = Cost::of(&study.plan, Some(&study.state), rates.as_ref());
        assert_eq!(cost.registrations, 0);
    });
    time("plan", || {
        let plan = Plan::of(&read().config);
        assert_eq!(plan.len(), count);
    });
    time("report", || {
        let study = read();
        study.write_table().expect("writes");
        let rows = Rows::read(&study.folder.table()).expect("reads");
        let about = About {
            planned: BTreeMap::new(),
            ..About::default()
        };
        let report = study.folder.report();
        std::fs::create_dir_all(&report).expect("creates");
        write(&rows, &about, &report).expect("writes");
    });
    if let Some(bytes) = pao_sim::study::runner::peak_memory_bytes() {
        println!("most memory              {:8.0} MB", bytes as f64 / 1e6);
    }

    let shared = folder.path().join("shares");
    let begin = Instant::now();
    for index in 0..100 {
        let shard = Shard::new(index, 100).expect("there is such a share");
        noop::run_share(&config, &shared, shard, 2, Duration::ZERO).expect("runs");
    }
    let seconds = begin.elapsed().as_secs_f64();
    println!(
        "100 shares one by one    {seconds:8.2} s, {:.3} ms a row",
        1e3 * seconds / count as f64
    );
    let parts = std::fs::read_dir(shared.join("engine/parts"))
        .expect("lists")
        .count();
    println!("parts of 100 attempts    {parts:8}");
}

fn time(what: &str, work: impl Fn()) {
    let mut least = f64::INFINITY;
    for _ in 0..3 {
        let begin = Instant::now();
        work();
        least = least.min(begin.elapsed().as_secs_f64());
    }
    println!("{what:<24} {least:8.2} s");
}

fn megabytes(path: &Path) -> f64 {
    let size = |path: &Path| path.metadata().map_or(0, |metadata| metadata.len());
    let bytes: u64 = match std::fs::read_dir(path) {
        Ok(entries) => entries.flatten().map(|entry| size(&entry.path())).sum(),
        Err(_) => size(path),
    };
    bytes as f64 / 1e6
}

//! `pao-sim plan`: counts, cost, memory, disk and shares before anything runs.

use super::args::Common;
use super::error::{Exit, Failure};
use super::output::say;
use super::progress::duration;
use pao_sim::study::calibration::Calibration;
use pao_sim::study::cost::{Basis, Cost, Rates};
use pao_sim::study::{CaseWorker, Config, Plan, Snapshot, Status, StudyFolder};
use serde_json::json;
use std::path::PathBuf;

/// Count what a study consists of, before anything runs.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Configuration file.
    config: PathBuf,
    /// Print the whole configuration instead, every key with its value.
    #[arg(long)]
    keys: bool,
    /// Count only what is left to do.
    #[arg(long)]
    remaining: bool,
    /// Measure first what the study costs: simulate its first case and make one registration for each
    /// scenario and strategy, on one thread. Takes minutes at full size; keeps no row.
    #[arg(long)]
    calibrate: bool,
    /// Threads of each process, for the suggested shares.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=4096))]
    threads: u32,
    /// Hours that each process may take, for the suggested shares.
    #[arg(long, value_name = "H", default_value_t = 8.0, value_parser = hours)]
    hours: f64,
}

/// Bytes of a row in its part and in the table together, and in a journal while its attempt runs: measured
/// on 72,000 rows (docs/engine.md).
const BYTES_A_ROW: f64 = 1900.0;
const JOURNAL_BYTES_A_ROW: f64 = 1400.0;

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let config = Config::read(&arguments.config)?;
    if arguments.keys {
        say!("{}", config.to_toml());
        return Ok(Exit::Complete);
    }
    let plan = Plan::of(&config);
    let folder = StudyFolder::of(&common.results, &config.study.name);
    if arguments.calibrate {
        calibrate(&config, &plan, &folder)?;
    }
    let begun = folder.config_file().is_file();
    let snapshot = match begun {
        true => Some(Snapshot::read(folder.clone())?),
        false => None,
    };
    let calibration = Calibration::read(&folder, &config);
    let rates = snapshot
        .as_ref()
        .and_then(|study| Rates::of_rows(&plan, &study.state))
        .or_else(|| calibration.as_ref().map(Rates::of_calibration));
    let done = snapshot.as_ref().map(|study| &study.state);
    let done = done.filter(|_| arguments.remaining);
    let cost = Cost::of(&plan, done, rates.as_ref());
    let memory = memory(snapshot.as_ref(), calibration.as_ref());
    if common.json {
        print_json(&config, &plan, &cost, memory, arguments);
    } else {
        print(&config, &plan, &cost, memory, arguments);
    }
    Ok(Exit::Complete)
}

fn calibrate(config: &Config, plan: &Plan, folder: &StudyFolder) -> Result<(), Failure> {
    eprintln!("measuring on {} with one thread", plan.cases[0]);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let pool = pool.map_err(|cause| Failure::Io {
        action: "start a thread".into(),
        cause: std::io::Error::other(cause),
    })?;
    let worker = CaseWorker::new(config);
    let calibration = pool.install(|| Calibration::measure(config, plan, &worker))?;
    calibration.write(folder)?;
    eprintln!(
        "kept in {}: preparation of a hip {:.1} s, simulation of a case {:.1} s",
        Calibration::file(folder).display(),
        calibration.preparation_seconds,
        calibration.simulation_seconds
    );
    for (cell, seconds) in &calibration.registration_seconds {
        eprintln!("  {cell}: {seconds:.1} s a registration");
    }
    Ok(())
}

/// The most memory that a process held, and its threads.
fn memory(snapshot: Option<&Snapshot>, calibration: Option<&Calibration>) -> Option<(u64, usize)> {
    let of_attempts = snapshot.and_then(|study| Status::of(study).peak_memory_bytes);
    of_attempts.or_else(|| Some((calibration?.peak_memory_bytes?, 1)))
}

fn print_json(
    config: &Config,
    plan: &Plan,
    cost: &Cost,
    memory: Option<(u64, usize)>,
    arguments: &Arguments,
) {
    let cells: Vec<_> = plan
        .cells()
        .into_iter()
        .map(|(scenario, strategy, _)| {
            let count = cost.cells.get(&format!("{scenario}/{strategy}"));
            json!({
                "scenario": scenario.name(), "strategy": strategy,
                "registrations": count.copied().unwrap_or(0),
            })
        })
        .collect();
    let threads = arguments.threads as usize;
    say!(
        "{}",
        json!({
            "format": 1,
            "study": config.study.name,
            "specimens": plan.specimens.iter().map(|s| s.name()).collect::<Vec<_>>(),
            "cases": cost.cases,
            "registrations": cost.registrations,
            "cells": cells,
            "thread_seconds": cost.thread_seconds,
            "basis": cost.basis,
            "memory": memory.map(|(bytes, threads)| json!({"bytes": bytes, "threads": threads})),
            "megabytes": BYTES_A_ROW * plan.len() as f64 / 1e6,
            "shares": cost.shares(threads, arguments.hours),
            "share_threads": threads,
            "share_hours": arguments.hours,
        })
    );
}

fn print(
    config: &Config,
    plan: &Plan,
    cost: &Cost,
    memory: Option<(u64, usize)>,
    arguments: &Arguments,
) {
    let left = if arguments.remaining { " left" } else { "" };
    let (name, registrations, cases) = (&config.study.name, cost.registrations, cost.cases);
    say!("study {name}: {registrations} registrations of {cases} cases{left}");
    if !config.study.reduced.is_empty() {
        say!("REDUCED: {}", config.study.reduced);
    }
    let specimens: Vec<String> = plan.specimens.iter().map(|s| s.name()).collect();
    say!(
        "  {} specimens ({}) x {} sides x {} fragments x {} movements x {} initializations",
        specimens.len(),
        specimens.join(", "),
        config.population.sides.len(),
        config.surgery.fragments,
        config.movement.movements,
        config.study.initializations
    );
    say!(
        "\n  {:<24}{:<16}{:>14}",
        "scenario",
        "strategy",
        "registrations"
    );
    for (scenario, strategy, _) in plan.cells() {
        let count = cost.cells.get(&format!("{scenario}/{strategy}"));
        let count = count.copied().unwrap_or(0);
        say!("  {:<24}{strategy:<16}{count:>14}", scenario.name());
    }
    say!("");
    print_cost(cost, arguments);
    match memory {
        Some((bytes, threads)) => say!(
            "memory: a process with {threads} thread{} held {:.1} GiB at most",
            if threads == 1 { "" } else { "s" },
            bytes as f64 / f64::from(1u32 << 30)
        ),
        None => say!("memory: not measured yet"),
    }
    let megabytes = |bytes: f64| bytes * plan.len() as f64 / 1e6;
    say!(
        "disk: about {:.1} MB in a few tens of files, journals of running processes {:.1} MB at most; and a log a process",
        megabytes(BYTES_A_ROW),
        megabytes(JOURNAL_BYTES_A_ROW)
    );
}

fn print_cost(cost: &Cost, arguments: &Arguments) {
    let threads = arguments.threads as usize;
    let (Some(seconds), Some(basis)) = (cost.thread_seconds, cost.basis) else {
        say!("cost: not measured yet; `--calibrate` measures it on one case");
        return;
    };
    let basis = match basis {
        Basis::Rows(rows) => format!("the study's {rows} complete registrations"),
        Basis::Calibration => "the calibration on one case".into(),
    };
    say!(
        "cost: {} of one thread, going by {basis}",
        duration(seconds)
    );
    for cores in [1, 64, 1024] {
        let cores_at_work = cores.min(cost.registrations.max(1));
        say!(
            "  {cores:>5} cores: {}",
            duration(seconds / cores_at_work as f64)
        );
    }
    if let Some(shares) = cost.shares(threads, arguments.hours) {
        say!(
            "shares: {shares} of {threads} threads each, to end within {} h (--threads, --hours)",
            arguments.hours
        );
    }
}

fn hours(text: &str) -> Result<f64, String> {
    let hours = text
        .parse()
        .ok()
        .filter(|hours| (0.01..=10_000.0).contains(hours));
    hours.ok_or_else(|| "expected 0.01 to 10000 hours".into())
}

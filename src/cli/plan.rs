//! `pao-sim plan`: counts and rough cost before anything runs.

use super::args::Common;
use super::error::{Exit, Failure};
use super::output::say;
use super::progress::duration;
use pao_sim::study::{Config, Plan, Snapshot, Status, StudyFolder};
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
}

/// Bytes of a row in journal and table together, measured.
const BYTES_A_ROW: f64 = 2000.0;

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let config = Config::read(&arguments.config)?;
    if arguments.keys {
        say!("{}", config.to_toml());
        return Ok(Exit::Complete);
    }
    let plan = Plan::of(&config);
    let status = StudyFolder::find(&arguments.config, &common.results)
        .and_then(Snapshot::read)
        .map(|snapshot| Status::of(&snapshot))
        .ok();
    let seconds = status.as_ref().and_then(|status| {
        let (each, case) = (status.registration_seconds?, status.simulation_seconds?);
        Some(each * plan.len() as f64 + case * plan.cases.len() as f64)
    });
    let megabytes = BYTES_A_ROW * plan.len() as f64 / 1e6;
    if common.json {
        let cells = plan.cells().into_iter();
        let cells: Vec<_> = cells
            .map(|(scenario, strategy, registrations)| {
                json!({"scenario": scenario.name(), "strategy": strategy, "registrations": registrations})
            })
            .collect();
        let plan = json!({
            "study": config.study.name,
            "specimens": plan.specimens.iter().map(|s| s.name()).collect::<Vec<_>>(),
            "cases": plan.cases.len(),
            "registrations": plan.len(),
            "cells": cells,
            "thread_seconds": seconds,
            "megabytes": megabytes,
        });
        say!("{plan}");
        return Ok(Exit::Complete);
    }
    say!(
        "study {}: {} registrations of {} cases",
        config.study.name,
        plan.len(),
        plan.cases.len()
    );
    if !config.study.reduced.is_empty() {
        say!("REDUCED: {}", config.study.reduced);
    }
    let names: Vec<String> = plan
        .specimens
        .iter()
        .map(|specimen| specimen.name())
        .collect();
    say!(
        "  {} specimens ({}) x {} sides x {} fragments x {} movements x {} initializations",
        names.len(),
        names.join(", "),
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
    for (scenario, strategy, registrations) in plan.cells() {
        say!("  {:<24}{strategy:<16}{registrations:>14}", scenario.name());
    }
    say!("");
    match (seconds, status) {
        (Some(seconds), Some(status)) => say!(
            "cost: {} of one thread, going by the {} registrations that are there",
            duration(seconds),
            status.done
        ),
        _ => say!("cost: not known before the first registrations; `pao-sim status` tells it then"),
    }
    say!("disk: about {megabytes:.1} MB in a few files");
    Ok(Exit::Complete)
}

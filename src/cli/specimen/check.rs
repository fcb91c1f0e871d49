//! `pao-sim specimen check`: is a specimen what it says?

use super::source::Source;
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::output::say;
use pao_sim::anatomy::check::{Check, Verdict, check_specimen};
use pao_sim::anatomy::{Hip, Side, Specimen, specimen_problems};
use pao_sim::surgery::{FragmentParameters, NominalCutParameters, cut_fragment, nominal_cuts};
use serde_json::json;
use std::sync::Arc;

/// Prove on a specimen's own data that its sides and frames are right, its landmarks on bone, its bones
/// whole, its CT in Hounsfield units, and that both hips can be operated on.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    source: Source,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let specimen = Arc::new(arguments.source.specimen()?);
    let mut checks: Vec<Check> = specimen_problems(&specimen)
        .iter()
        .map(|problem| Check::holds("specimen", false, problem.to_string(), "no problem"))
        .collect();
    checks.extend(check_specimen(&specimen));
    checks.extend(Side::BOTH.map(|side| surgery(&specimen, side)));
    print(&specimen, &checks, common);
    let wrong = checks.iter().any(|check| check.verdict == Verdict::Wrong);
    Ok(if wrong { Exit::Error } else { Exit::Complete })
}

/// Whether the planned cuts of a hip free a fragment of a usual size.
fn surgery(specimen: &Arc<Specimen>, side: Side) -> Check {
    let what = format!("{side} fragment of the planned cuts");
    let volume = || -> Result<f64, String> {
        let hip = Hip::new(specimen.clone(), side).map_err(|e| e.to_string())?;
        let cuts =
            nominal_cuts(&hip, &NominalCutParameters::default()).map_err(|e| e.to_string())?;
        let map = cut_fragment(&hip, &cuts, &FragmentParameters::default());
        Ok(map.map_err(|e| e.to_string())?.fragment_cm3())
    };
    match volume() {
        Ok(cm3) => Check::number(what, cm3, "cm3", (30.0, 130.0), (10.0, 250.0)),
        Err(reason) => Check::holds(what, false, reason, "a fragment"),
    }
}

fn print(specimen: &Specimen, checks: &[Check], common: &Common) {
    if common.json {
        for check in checks {
            say!(
                "{}",
                json!({"specimen": specimen.name, "check": check.what, "found": check.found,
                    "expected": check.expected, "verdict": check.verdict.name()})
            );
        }
        return;
    }
    let width = |of: fn(&Check) -> &str| checks.iter().map(|c| of(c).chars().count()).max();
    let (what, found, expected) = (
        width(|c| &c.what).unwrap_or(0),
        width(|c| &c.found).unwrap_or(0).min(40),
        width(|c| &c.expected).unwrap_or(0),
    );
    say!(
        "specimen {} ({}, {}): {}",
        specimen.name,
        specimen.source.kind,
        specimen.source.sex,
        specimen.source.description
    );
    say!("licence: {}\n", specimen.source.licence);
    say!(
        "{:<what$}  {:<found$}  {:<expected$}  verdict",
        "check",
        "found",
        "expected"
    );
    for check in checks {
        say!(
            "{:<what$}  {:<found$}  {:<expected$}  {}",
            check.what,
            check.found,
            check.expected,
            check.verdict.name()
        );
    }
    let count = |verdict| checks.iter().filter(|c| c.verdict == verdict).count();
    say!(
        "\n{} checks: {} ok, {} doubtful, {} wrong",
        checks.len(),
        count(Verdict::Fine),
        count(Verdict::Doubtful),
        count(Verdict::Wrong)
    );
}

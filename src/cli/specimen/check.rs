//! `pao-sim specimen check`: is a specimen what it says?

use super::check_ending;
use super::show::plan;
use super::source::Source;
use crate::cli::args::Common;
use crate::cli::error::{Exit, Failure};
use crate::cli::output::say;
use pao_sim::anatomy::check::{Check, Verdict, check_specimen};
use pao_sim::anatomy::{Hip, Side, Specimen, specimen_problems};
use pao_sim::report::specimen::{HipPlan, Painting, check_sheet};
use pao_sim::surgery::{CutPlanes, SurgeryMap};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;

/// Prove on a specimen's own data that its sides and frames are right, its landmarks on bone, its bones
/// whole, its CT in Hounsfield units, and that both hips can be operated on.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    #[command(flatten)]
    source: Source,
    /// Also draw everything on one page: radiograph, slices with labels, surfaces with landmarks, cuts and
    /// rim, and this table. A picture that is there is replaced
    #[arg(long, value_name = "FILE.png")]
    sheet: Option<PathBuf>,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    if let Some(file) = &arguments.sheet {
        check_ending("--sheet", file, ".png")?;
    }
    let specimen = Arc::new(arguments.source.specimen()?);
    let (checks, hips) = judge(&specimen);
    if let Some(file) = &arguments.sheet {
        sheet(&specimen, &hips, &checks).write(file)?;
    }
    print(&specimen, &checks, common);
    if let Some(file) = &arguments.sheet
        && !common.json
    {
        say!("{}", file.display());
    }
    Ok(exit(&checks))
}

/// [`Exit::Error`] where anything is wrong.
pub fn exit(checks: &[Check]) -> Exit {
    match checks.iter().any(|check| check.verdict == Verdict::Wrong) {
        true => Exit::Error,
        false => Exit::Complete,
    }
}

/// All checks, and both hips with their planned cuts.
fn judge(specimen: &Arc<Specimen>) -> (Vec<Check>, Vec<(Hip, Plan)>) {
    let mut checks: Vec<Check> = specimen_problems(specimen)
        .iter()
        .map(|problem| {
            Check::holds("specimen", false, problem.to_string(), "no problem")
                .advise("a study refuses it; mend what is named")
        })
        .collect();
    checks.extend(check_specimen(specimen));
    let hips: Vec<(Hip, Plan)> = Side::BOTH
        .into_iter()
        .filter_map(|side| Hip::new(specimen.clone(), side).ok())
        .map(|hip| {
            let plan = plan(&hip);
            (hip, plan)
        })
        .collect();
    checks.extend(hips.iter().map(|(hip, plan)| surgery(hip, plan)));
    (checks, hips)
}

/// What is not fine about a specimen, and how many checks there were.
pub fn findings(specimen: &Arc<Specimen>) -> (Vec<Check>, usize) {
    let (mut checks, _) = judge(specimen);
    let count = checks.len();
    checks.retain(|check| check.verdict != Verdict::Fine);
    (checks, count)
}

type Plan = Result<(CutPlanes, SurgeryMap), String>;

/// Whether the planned cuts of a hip free a fragment of a usual size.
fn surgery(hip: &Hip, plan: &Plan) -> Check {
    let what = format!("{} fragment of the planned cuts", hip.side);
    match plan {
        Ok((_, map)) => {
            let cm3 = map.fragment_cm3();
            Check::number(what, cm3, "cm3", (30.0, 130.0), (10.0, 250.0)).advise(
                "the study's fragments vary about this one; look at the planned cuts in `specimen show`, and \
                 set [surgery.nominal] if they are not where you would cut",
            )
        }
        Err(reason) => Check::holds(what, false, reason, "a fragment").advise(
            "a study on this hip would stop; look at the landmarks ASIS, AIIS, FH and at the rim, from which \
             the cuts are planned",
        ),
    }
}

fn sheet(specimen: &Specimen, hips: &[(Hip, Plan)], checks: &[Check]) -> Painting {
    let hips: Vec<_> = hips
        .iter()
        .map(|(hip, plan)| {
            let plan = plan.as_ref().ok();
            (hip.clone(), plan.map(|(cuts, map)| HipPlan { cuts, map }))
        })
        .collect();
    check_sheet(specimen, &hips, checks)
}

/// A check for programs, with its advice where something is to be done.
pub fn as_json(check: &Check) -> Value {
    let advice = (check.verdict != Verdict::Fine).then_some(&check.advice);
    json!({"check": check.what, "found": check.found, "expected": check.expected,
        "verdict": check.verdict.name(), "advice": advice})
}

fn print(specimen: &Specimen, checks: &[Check], common: &Common) {
    if common.json {
        for check in checks {
            let mut line = as_json(check);
            line["specimen"] = specimen.name.as_str().into();
            say!("{line}");
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
    for check in checks.iter().filter(|c| c.verdict != Verdict::Fine) {
        say!(
            "\n{} ({}): {}",
            check.what,
            check.verdict.name(),
            check.advice
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

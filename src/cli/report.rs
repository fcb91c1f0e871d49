//! `pao-sim report`: the tables and figures of whatever is there.

use super::args::Common;
use super::error::{Exit, Failure};
use super::output::say;
use pao_sim::report::{About, Group, Rows, write};
use pao_sim::study::{Snapshot, StudyFolder};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Write the tables and figures of whatever is there.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The study's folder or its configuration file.
    study: PathBuf,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let folder = StudyFolder::find(&arguments.study, &common.results)?;
    let snapshot = Snapshot::read(folder)?;
    snapshot.write_table()?;
    let groups = make(&snapshot)?;
    let folder = snapshot.folder.report();
    if common.json {
        let groups: Vec<&str> = groups.iter().map(|group| group.name.as_str()).collect();
        say!(
            "{}",
            serde_json::json!({ "report": folder, "groups": groups })
        );
    } else {
        print(&groups);
        eprintln!("{}", folder.join("report.html").display());
    }
    Ok(Exit::Complete)
}

/// Makes the report of the rows in a study's table.
pub fn make(study: &Snapshot) -> Result<Vec<Group>, Failure> {
    let rows = Rows::read(&study.folder.table())?;
    let folder = study.folder.report();
    std::fs::create_dir_all(&folder).map_err(|cause| Failure::Io {
        action: format!("create {}", folder.display()),
        cause,
    })?;
    Ok(write(&rows, &about(study), &folder)?)
}

/// Prints Table I, the shares and Table II of each group.
pub fn print(groups: &[Group]) {
    for group in groups {
        say!("{}\n", group.title);
        for table in &group.tables {
            if ["table1", "shares", "table2"].contains(&table.name.as_str()) {
                say!("{}", table.text());
            }
        }
    }
}

fn about(study: &Snapshot) -> About {
    let mut planned = BTreeMap::new();
    for case in &study.plan.cases {
        for key in study.plan.registrations(case) {
            *planned
                .entry((case.fragment.specimen.clone(), key.strategy))
                .or_default() += 1;
        }
    }
    let section = &study.config.study;
    About {
        study: section.name.clone(),
        description: section.description.clone(),
        reduced: section.reduced.clone(),
        seed: section.seed,
        specimens: study.specimens(),
        planned,
        provenance: study.provenance_summary(),
    }
}

//! `pao-sim replay`: makes one registration again and compares it with its row.

use super::args::Common;
use super::error::{Exit, Failure};
use super::output::say;
use pao_sim::store::{COMPLETE, CRASHED, FAILED, Role, Row, SCHEMA, Value};
use pao_sim::study::{self, CaseWorker, RegistrationKey, Snapshot, StudyFolder, Worker};
use std::path::PathBuf;

/// Make one registration again and compare it with its row.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// The study's folder or its configuration file.
    study: PathBuf,
    /// Key of the registration: phantom-1/left/f03/m07/i2/no_cuts_known/paper
    key: String,
}

pub fn main(arguments: &Arguments, common: &Common) -> Result<Exit, Failure> {
    let key: RegistrationKey = arguments.key.parse()?;
    let folder = StudyFolder::find(&arguments.study, &common.results)?;
    let snapshot = Snapshot::read(folder)?;
    if !snapshot.plan.contains(&key) {
        return Err(Failure::NotPlanned(key.to_string()));
    }
    snapshot.select_simd()?;
    // Rows of other data or another program are no contradiction: say so before they are compared.
    for change in snapshot.changes()? {
        eprintln!("changed since the study ran:{change}");
    }
    let row = make(&CaseWorker::new(&snapshot.config), &key);
    let before = snapshot.state.row(&key);
    let differences = before.map(|before| before.differences(&row));
    if common.json {
        say!("{}", json(&row, differences.as_ref().map(Vec::len)));
    } else {
        print(&row);
    }
    match differences {
        None => eprintln!("the study has no row of this registration yet"),
        Some(_) if before.is_some_and(|before| before.text("status") == CRASHED) => {
            eprintln!("it was set aside because it ended its process; this time it did not");
        }
        Some(differences) if differences.is_empty() => {
            eprintln!("equal to the study's row in every result, bit by bit");
        }
        Some(differences) => {
            for (column, before, now) in &differences {
                eprintln!(
                    "{column}: the study's row has {}, now {}",
                    text(before),
                    text(now)
                );
            }
            return Ok(Exit::Error);
        }
    }
    Ok(match row.text("status") {
        COMPLETE => Exit::Complete,
        _ => Exit::FailedRows,
    })
}

/// The row of one registration, made on this thread. A panic ends the program with its place.
fn make(worker: &CaseWorker, key: &RegistrationKey) -> Row {
    let mut row = key.row();
    let case = worker.simulate(&key.case);
    let result = case.and_then(|case| worker.register(&case, key, &mut row));
    match result {
        Ok(()) => row.set("status", COMPLETE),
        Err(study::Failure { phase, message }) => {
            row.set("status", FAILED);
            row.set("phase", phase);
            row.set("message", message);
        }
    }
    row
}

fn print(row: &Row) {
    for column in &SCHEMA.columns {
        if let Some(value) = row.get(&column.name) {
            say!("{:<36} {}", column.name, text(&Some(value.clone())));
        }
    }
}

fn text(value: &Option<Value>) -> String {
    match value {
        None => "nothing".into(),
        Some(Value::Text(text)) => text.clone(),
        Some(Value::Integer(number)) => number.to_string(),
        Some(Value::Number(number)) => number.to_string(),
        Some(Value::Flag(flag)) => flag.to_string(),
    }
}

fn json(row: &Row, differences: Option<usize>) -> serde_json::Value {
    let results = SCHEMA
        .columns
        .iter()
        .filter(|c| c.role != Role::Measurement);
    let values = results.filter_map(|column| {
        let value = match row.get(&column.name)? {
            Value::Text(text) => text.as_str().into(),
            Value::Integer(number) => (*number).into(),
            Value::Number(number) => (*number).into(),
            Value::Flag(flag) => (*flag).into(),
        };
        Some((column.name.clone(), value))
    });
    let row: serde_json::Map<String, serde_json::Value> = values.collect();
    serde_json::json!({ "row": row, "differences": differences })
}

//! The report of a study: every table and figure, and one page that holds them.

use super::canvas::{self, FigureError};
use super::histograms::{JointHistograms, LceHistograms};
use super::numbers::{Summaries, Tests};
use super::rows::Rows;
use super::table::Table;
use super::{effort_table, errors_table, offsets_table, sampling_table, tests_table};
use crate::statistics::StatisticsError;
use crate::store::COMPLETE;
use crate::store::durable;
use polars::prelude::{DataFrame, ParquetWriter};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What the report says of the study as a whole.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct About {
    pub study: String,
    pub description: String,
    /// In which way the study is reduced; empty when it stands for itself.
    pub reduced: String,
    /// Seed of the bootstrap.
    pub seed: u64,
    /// Planned registrations of each specimen and strategy.
    pub planned: BTreeMap<(String, String), usize>,
}

/// Rows of one kind of specimen and one strategy: they are never pooled with others.
#[derive(Debug)]
pub struct Group {
    /// Folder of its files: `phantom-paper`, for instance.
    pub name: String,
    pub title: String,
    pub tables: Vec<Table>,
}

/// A report that cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    #[error("a complete row holds a value that is not finite: {0}")]
    Statistics(#[from] StatisticsError),
    #[error(transparent)]
    Figure(#[from] FigureError),
    #[error("cannot write {}: {cause}", path.display())]
    Write {
        path: PathBuf,
        #[source]
        cause: std::io::Error,
    },
}

/// Writes the report of a study's rows into `folder` and gives its groups.
///
/// `report.md` holds all tables and figures; a folder for each group holds its tables as Markdown,
/// CSV and LaTeX and its figures as SVG and PNG; `summaries.parquet` and `tests.parquet` hold the
/// numbers.
///
/// # Errors
/// When a value is not finite or a file cannot be written.
pub fn write(rows: &Rows, about: &About, folder: &Path) -> Result<Vec<Group>, ReportError> {
    let (mut groups, mut page) = (Vec::new(), head(rows, about));
    let (mut summaries, mut tests) = (Summaries::default(), Tests::default());
    for kind in rows.distinct("specimen_kind") {
        let of_kind = rows.with("specimen_kind", &kind);
        for strategy in of_kind.distinct("strategy") {
            let own = of_kind.with("strategy", &strategy);
            let complete = own.with("status", COMPLETE);
            if complete.is_empty() {
                continue;
            }
            let group = group(&kind, &strategy, &own, &complete, about)?;
            let place = folder.join(&group.name);
            let figures = write_group(&group, &complete, &place)?;
            page += &section(&group, &figures);
            summaries.add(&group.name, &complete)?;
            tests.add(&group.name, &complete)?;
            groups.push(group);
        }
    }
    page += &failures(rows);
    write_file(&folder.join("report.md"), page.as_bytes())?;
    write_frame(&folder.join("summaries.parquet"), summaries.frame())?;
    write_frame(&folder.join("tests.parquet"), tests.frame())?;
    Ok(groups)
}

fn group(
    kind: &str,
    strategy: &str,
    own: &Rows,
    complete: &Rows,
    about: &About,
) -> Result<Group, ReportError> {
    let specimens = own.distinct("specimen");
    let planned: usize = specimens
        .iter()
        .filter_map(|specimen| about.planned.get(&(specimen.clone(), strategy.to_owned())))
        .sum();
    let mut tables = vec![
        errors_table::table1(complete)?,
        errors_table::medians(complete, about.seed)?,
        errors_table::shares(complete)?,
        tests_table::table2(complete)?,
        offsets_table::offsets(complete)?,
        offsets_table::movements(complete)?,
        sampling_table::sampling(complete)?,
        sampling_table::shape_estimation(complete)?,
        effort_table::effort(complete)?,
    ];
    let assigned = kind != "phantom" && own.numbers("assigned_density").contains(&1.0);
    for table in &mut tables {
        if complete.len() < planned {
            table.title += &format!(" - {} of {planned} registrations", complete.len());
        }
        if !about.reduced.is_empty() {
            table
                .notes
                .push(format!("REDUCED STUDY: {}.", about.reduced));
        }
        if assigned {
            table
                .notes
                .push("Hounsfield values were assigned by rule, not measured.".into());
        }
    }
    let count = specimens.len();
    Ok(Group {
        name: format!("{kind}-{strategy}"),
        title: format!(
            "Strategy {strategy}, {count} specimen{} of kind {kind}: {} of {planned} registrations",
            if count == 1 { "" } else { "s" },
            complete.len()
        ),
        tables,
    })
}

/// Writes a group's files and gives the names of its figures.
fn write_group(
    group: &Group,
    complete: &Rows,
    folder: &Path,
) -> Result<Vec<&'static str>, ReportError> {
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    for table in &group.tables {
        let file = |extension: &str| folder.join(format!("{}.{extension}", table.name));
        write_file(&file("md"), table.markdown().as_bytes())?;
        write_file(&file("tex"), table.latex().as_bytes())?;
        let csv = table.csv().map_err(std::io::Error::other);
        write_file(&file("csv"), &csv.map_err(failed(&file("csv")))?)?;
    }
    canvas::write(&JointHistograms::errors(complete), folder)?;
    canvas::write(&LceHistograms::of(complete), folder)?;
    canvas::write(&JointHistograms::movements(complete), folder)?;
    Ok(vec!["errors_joint", "lce_errors", "movements_joint"])
}

fn head(rows: &Rows, about: &About) -> String {
    let planned: usize = about.planned.values().sum();
    let mut text = format!("# Study {}\n\n", about.study);
    if !about.description.is_empty() {
        text += &format!("{}\n\n", about.description);
    }
    if !about.reduced.is_empty() {
        text += &format!("**REDUCED STUDY: {}.**\n\n", about.reduced);
    }
    let complete = rows.with("status", COMPLETE).len();
    text += &format!("{complete} of {planned} registrations are complete");
    match rows.len() - complete {
        0 => text += ".\n\n",
        failed => text += &format!(", {failed} failed (listed at the end).\n\n"),
    }
    text
}

fn section(group: &Group, figures: &[&str]) -> String {
    let mut text = format!("## {}\n\n", group.title);
    for table in &group.tables {
        text += &table.markdown();
        text.push('\n');
    }
    for figure in figures {
        text += &format!("![{figure}]({}/{figure}.png)\n\n", group.name);
    }
    text
}

/// How many registrations failed for which reason.
fn failures(rows: &Rows) -> String {
    let mut reasons: BTreeMap<(&str, &str, &str), usize> = BTreeMap::new();
    let (status, phase, message) = (
        rows.text("status"),
        rows.text("phase"),
        rows.text("message"),
    );
    for i in 0..rows.len() {
        if status[i] != COMPLETE {
            let reason = (status[i].as_str(), phase[i].as_str(), message[i].as_str());
            *reasons.entry(reason).or_default() += 1;
        }
    }
    if reasons.is_empty() {
        return String::new();
    }
    let mut text = "## Registrations without a result\n\n| number | status | phase | message |\n|---|---|---|---|\n".to_owned();
    for ((status, phase, message), count) in reasons {
        let message = message.replace('|', "\\|").replace('\n', " ");
        text += &format!("| {count} | {status} | {phase} | {message} |\n");
    }
    text
}

fn write_frame(
    path: &Path,
    frame: polars::prelude::PolarsResult<DataFrame>,
) -> Result<(), ReportError> {
    let written = frame.map_err(std::io::Error::other).and_then(|mut frame| {
        durable::write(path, |out| {
            let written = ParquetWriter::new(out).finish(&mut frame);
            written.map(drop).map_err(std::io::Error::other)
        })
    });
    written.map_err(failed(path))
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), ReportError> {
    durable::write(path, |out| out.write_all(bytes)).map_err(failed(path))
}

fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> ReportError {
    let path = path.to_owned();
    move |cause| ReportError::Write { path, cause }
}

#[cfg(test)]
mod tests {
    use super::super::errors_table::SCENARIOS;
    use super::*;
    use crate::store::{Kind, SCHEMA};

    /// 48 made-up registrations of six cases and four scenarios, one of them failed, with every
    /// column of the schema.
    fn rows() -> Rows {
        let n = 48;
        let (mut text, mut numbers) = (BTreeMap::new(), BTreeMap::new());
        for (place, column) in SCHEMA.columns.iter().enumerate() {
            let name = column.name.clone();
            if column.kind == Kind::Text {
                let value = |i: usize| match name.as_str() {
                    "specimen" => "phantom-1".to_owned(),
                    "specimen_kind" => "phantom".to_owned(),
                    "side" => "left".to_owned(),
                    "strategy" => "paper".to_owned(),
                    "scenario" => SCENARIOS[i % 4].to_owned(),
                    "status" if i == 5 => "failed".to_owned(),
                    "status" => COMPLETE.to_owned(),
                    "phase" if i == 5 => "view2_search".to_owned(),
                    "message" if i == 5 => "no candidate | is finite".to_owned(),
                    "pubis_fallback" if i == 3 => "too few points".to_owned(),
                    _ => String::new(),
                };
                text.insert(name.clone(), (0..n).map(value).collect());
            } else {
                let value = |i: usize| match name.as_str() {
                    "fragment" => 0.0,
                    "movement" => (i / 8) as f64,
                    "initialization" => (i / 4 % 2) as f64,
                    "true_rotation_deg" => 10.0 + (i / 8) as f64,
                    name if name.ends_with("_capped") => 0.0,
                    _ => ((i * (place + 7)) as f64 * 0.618).fract() * (1.0 + (i % 4) as f64),
                };
                numbers.insert(name.clone(), (0..n).map(value).collect());
            }
        }
        Rows::of(text, numbers)
    }

    #[test]
    fn a_report_of_made_up_rows() {
        let about = About {
            study: "made-up".into(),
            description: "48 registrations that nobody made".into(),
            reduced: String::new(),
            seed: 7,
            planned: BTreeMap::from([(("phantom-1".into(), "paper".into()), 96)]),
        };
        let folder = tempfile::tempdir().unwrap();
        let groups = write(&rows(), &about, folder.path()).unwrap();
        assert_eq!(groups.len(), 1);
        let page = std::fs::read_to_string(folder.path().join("report.md")).unwrap();
        insta::assert_snapshot!(page);
        let tests = Rows::read(&folder.path().join("tests.parquet")).unwrap();
        assert_eq!(tests.len(), 15);
        let summaries = Rows::read(&folder.path().join("summaries.parquet")).unwrap();
        assert_eq!(summaries.len(), 36);
        assert_eq!(summaries.numbers("paper_mean")[3], 1.25);
    }
}

//! The report of a study: every table and figure, and one page that holds them.

use super::canvas::{self, FigureError};
use super::histograms::{JointHistograms, LceHistograms};
use super::numbers::{Summaries, Tests};
use super::rows::Rows;
use super::specimens_table::specimens;
use super::table::Table;
use super::{effort_table, errors_table, html, offsets_table, sampling_table, tests_table};
use crate::anatomy::Source;
use crate::statistics::StatisticsError;
use crate::store::{COMPLETE, Role, SCHEMA, durable};
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
    /// Where each specimen comes from, in the study's order.
    pub specimens: Vec<(String, Source)>,
    /// Planned registrations of each specimen and strategy.
    pub planned: BTreeMap<(String, String), usize>,
    /// With what the rows were made: what, and its values.
    pub provenance: Vec<(String, Vec<String>)>,
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
/// `report.md` and `report.html` (one page without other files) hold all tables and figures; a folder
/// for each group holds its tables as Markdown,
/// CSV and LaTeX and its figures as SVG and PNG; `summaries.parquet` and `tests.parquet` hold the
/// numbers; `specimens.md` and `specimens.csv` say whose anatomy it is; `columns.md` says what the columns of `registrations.parquet` are.
///
/// # Errors
/// When a value is not finite or a file cannot be written.
pub fn write(rows: &Rows, about: &About, folder: &Path) -> Result<Vec<Group>, ReportError> {
    let mut groups = Vec::new();
    let (mut page, mut web) = (head(rows, about), web_head(rows, about));
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
            web += &web_section(&group, &figures, &place)?;
            summaries.add(&group.name, &complete)?;
            tests.add(&group.name, &complete)?;
            groups.push(group);
        }
    }
    if let Some(specimens) = specimens(&about.specimens) {
        page += &(specimens.markdown() + "\n");
        web += &html::table(&specimens);
        write_file(
            &folder.join("specimens.md"),
            specimens.markdown().as_bytes(),
        )?;
        let path = folder.join("specimens.csv");
        let csv = specimens.csv().map_err(std::io::Error::other);
        write_file(&path, &csv.map_err(failed(&path))?)?;
    }
    let provenance = provenance(about);
    page += &(provenance.markdown() + "\n");
    web += &html::table(&provenance);
    if let Some(failures) = failures(rows) {
        page += &failures.markdown();
        web += &html::table(&failures);
    }
    web += html::end();
    write_file(&folder.join("report.md"), page.as_bytes())?;
    write_file(&folder.join("report.html"), web.as_bytes())?;
    write_file(&folder.join("columns.md"), columns().markdown().as_bytes())?;
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
    let mut text = format!("# Study {}\n\n", about.study);
    if !about.description.is_empty() {
        text += &format!("{}\n\n", about.description);
    }
    if !about.reduced.is_empty() {
        text += &format!("**REDUCED STUDY: {}.**\n\n", about.reduced);
    }
    text + &progress(rows, about) + "\n\n"
}

/// How many registrations there are, in words.
fn progress(rows: &Rows, about: &About) -> String {
    let planned: usize = about.planned.values().sum();
    let complete = rows.with("status", COMPLETE).len();
    let text = format!("{complete} of {planned} registrations are complete");
    match rows.len() - complete {
        0 => text + ".",
        failed => format!("{text}, {failed} failed (listed at the end)."),
    }
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

/// The page's head as HTML.
fn web_head(rows: &Rows, about: &About) -> String {
    let mut text = html::begin(&format!("Study {}", about.study));
    text += &html::paragraph(&about.description, "");
    if !about.reduced.is_empty() {
        text += &html::paragraph(&format!("REDUCED STUDY: {}.", about.reduced), "warning");
    }
    text + &html::paragraph(&progress(rows, about), "")
}

/// A group's tables and its figures, which are put into the page itself.
fn web_section(group: &Group, figures: &[&str], folder: &Path) -> Result<String, ReportError> {
    let mut text = html::heading(&group.title);
    text.extend(group.tables.iter().map(html::table));
    for figure in figures {
        let path = folder.join(format!("{figure}.svg"));
        text += &std::fs::read_to_string(&path).map_err(failed(&path))?;
    }
    Ok(text)
}

/// With what the rows were made. No times: the same rows give the same report.
fn provenance(about: &About) -> Table {
    let rows = about.provenance.iter();
    Table {
        name: "provenance".into(),
        title: "Provenance".into(),
        header: vec!["what".into(), "value".into()],
        rows: rows
            .map(|(what, values)| vec![what.clone(), values.join(", ")])
            .collect(),
        notes: vec!["`manifest.json` has it by attempt.".into()],
    }
}

/// How many registrations failed for which reason; none when all are complete.
fn failures(rows: &Rows) -> Option<Table> {
    let mut reasons: BTreeMap<[&str; 3], usize> = BTreeMap::new();
    let columns = ["status", "phase", "message"].map(|column| rows.text(column));
    for i in 0..rows.len() {
        let reason = columns.map(|column| column[i].as_str());
        if reason[0] != COMPLETE {
            *reasons.entry(reason).or_default() += 1;
        }
    }
    let line = |(reason, count): (&[&str; 3], &usize)| {
        let cells = [count.to_string()]
            .into_iter()
            .chain(reason.map(String::from));
        cells.collect()
    };
    (!reasons.is_empty()).then(|| Table {
        name: "failures".into(),
        title: "Registrations without a result".into(),
        header: ["number", "status", "phase", "message"]
            .map(String::from)
            .to_vec(),
        rows: reasons.iter().map(line).collect(),
        notes: vec![
            "`pao-sim status STUDY --failures` lists each with the command that repeats it.".into(),
        ],
    })
}

/// What the columns of the table of registrations are.
fn columns() -> Table {
    let line = |column: &crate::store::Column| {
        let role = match column.role {
            Role::Key => "key",
            Role::Result => "result",
            Role::Measurement => "measurement",
        };
        let kind = format!("{:?}", column.kind).to_lowercase();
        vec![column.name.clone(), kind, role.into(), column.doc.clone()]
    };
    Table {
        name: "columns".into(),
        title: "Columns of registrations.parquet".into(),
        header: ["column", "type", "role", "meaning"].map(String::from).to_vec(),
        rows: SCHEMA.columns.iter().map(line).collect(),
        notes: vec![
            "Results depend on configuration, seed and key alone; measurements tell how it went this time. Angles are \
             degrees and lengths mm in the hip's anterior pelvic plane: LR = x, IS = y, AP = z."
                .into(),
        ],
    }
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
            specimens: vec![(
                "phantom-1".into(),
                Source {
                    kind: "phantom".into(),
                    description: "nobody | made up".into(),
                    licence: "none".into(),
                    sex: "unknown".into(),
                    assigned_density: true,
                },
            )],
            planned: BTreeMap::from([(("phantom-1".into(), "paper".into()), 96)]),
            provenance: vec![("commit".into(), vec!["abc".into(), "def".into()])],
        };
        let folder = tempfile::tempdir().unwrap();
        let groups = write(&rows(), &about, folder.path()).unwrap();
        assert_eq!(groups.len(), 1);
        let page = std::fs::read_to_string(folder.path().join("report.md")).unwrap();
        insta::assert_snapshot!(page);
        let list = std::fs::read_to_string(folder.path().join("specimens.csv")).unwrap();
        assert_eq!(
            list.lines().last(),
            Some("phantom-1,phantom,unknown,none,assigned by rule,nobody | made up")
        );
        let web = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
        assert!(web.contains("<td>assigned by rule</td>"), "{web}");
        let tests = Rows::read(&folder.path().join("tests.parquet")).unwrap();
        assert_eq!(tests.len(), 15);
        let summaries = Rows::read(&folder.path().join("summaries.parquet")).unwrap();
        assert_eq!(summaries.len(), 36);
        assert_eq!(summaries.numbers("paper_mean")[3], 1.25);
    }
}

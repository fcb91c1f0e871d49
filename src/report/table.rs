//! A table of text, and the formats it is written in.

use std::fmt::Write;

/// A rectangular table. Cells are what people read; the numbers behind them go to Parquet.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// File stem: `table1`, `table2`, ...
    pub name: String,
    /// One line above the table.
    pub title: String,
    pub header: Vec<String>,
    pub rows: Vec<Vec<String>>,
    /// Lines below the table.
    pub notes: Vec<String>,
}

impl Table {
    /// GitHub-flavoured Markdown.
    pub fn markdown(&self) -> String {
        let mut out = format!("**{}**\n\n", self.title);
        // A cell is one line, and a bar in it is no end of it.
        let cell = |text: &String| text.replace('|', "\\|").replace('\n', " ");
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(cell).collect();
            format!("| {} |\n", cells.join(" | "))
        };
        out += &line(&self.header);
        out += &format!("|{}\n", "---|".repeat(self.header.len()));
        for row in &self.rows {
            out += &line(row);
        }
        for note in &self.notes {
            let _ = write!(out, "\n{note}\n");
        }
        out
    }

    /// Comma-separated values with a header line.
    pub fn csv(&self) -> Result<Vec<u8>, csv::Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(&self.header)?;
        for row in &self.rows {
            writer.write_record(row)?;
        }
        writer
            .into_inner()
            .map_err(|error| csv::Error::from(error.into_error()))
    }

    /// A LaTeX `tabular` with its title as a comment.
    pub fn latex(&self) -> String {
        let cell = |text: &String| {
            text.replace('\\', "\\textbackslash{}")
                .replace('&', "\\&")
                .replace('%', "\\%")
                .replace('_', "\\_")
                .replace('<', "$<$")
                .replace("+-", "$\\pm$")
        };
        let line = |cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(cell).collect();
            format!("{} \\\\\n", cells.join(" & "))
        };
        let mut out = format!("% {}\n", self.title);
        let columns = "c".repeat(self.header.len().saturating_sub(1));
        let _ = writeln!(out, "\\begin{{tabular}}{{l{columns}}}\n\\hline");
        out += &line(&self.header);
        out += "\\hline\n";
        for row in &self.rows {
            out += &line(row);
        }
        out += "\\hline\n\\end{tabular}\n";
        for note in &self.notes {
            let _ = writeln!(out, "% {note}");
        }
        out
    }

    /// Aligned columns for a terminal.
    pub fn text(&self) -> String {
        let width = |column: usize| {
            (self.rows.iter().chain([&self.header]))
                .map(|row| row[column].chars().count())
                .max()
                .unwrap_or(0)
        };
        let widths: Vec<usize> = (0..self.header.len()).map(width).collect();
        let line = |cells: &[String]| {
            let mut out = String::new();
            for (cell, width) in cells.iter().zip(&widths) {
                let _ = write!(out, "{cell:<width$}  ");
            }
            out.trim_end().to_string() + "\n"
        };
        let mut out = format!("{}\n\n{}", self.title, line(&self.header));
        let rule: usize = widths
            .iter()
            .map(|w| w + 2)
            .sum::<usize>()
            .saturating_sub(2);
        out += &("-".repeat(rule) + "\n");
        for row in &self.rows {
            out += &line(row);
        }
        for note in &self.notes {
            let _ = writeln!(out, "{note}");
        }
        out
    }
}

/// `1.25 +- 2.24`.
pub fn mean_sd(mean: f64, sd: f64) -> String {
    format!("{mean:.2} +- {sd:.2}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        Table {
            name: "t".into(),
            title: "A title".into(),
            header: vec!["a".into(), "b".into()],
            rows: vec![vec!["x & y".into(), mean_sd(1.0, 0.456)]],
            notes: vec!["8 of 10".into()],
        }
    }

    #[test]
    fn every_format_holds_the_cells() {
        insta::assert_snapshot!(table().markdown(), @r"
        **A title**

        | a | b |
        |---|---|
        | x & y | 1.00 +- 0.46 |

        8 of 10
        ");
        insta::assert_snapshot!(table().latex(), @r"
        % A title
        \begin{tabular}{lc}
        \hline
        a & b \\
        \hline
        x \& y & 1.00 $\pm$ 0.46 \\
        \hline
        \end{tabular}
        % 8 of 10
        ");
        assert_eq!(table().csv().unwrap(), b"a,b\nx & y,1.00 +- 0.46\n");
        assert!(table().text().contains("x & y  1.00 +- 0.46"));
    }
}

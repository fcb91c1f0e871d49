//! One page without any other file: tables and figures of all groups.

use super::table::Table;
use std::fmt::Write;

/// The page's looks: nothing is loaded, so that it reads the same from any disk.
const STYLE: &str = "body{font:15px/1.45 sans-serif;max-width:75rem;margin:2rem auto;padding:0 1rem}\
table{border-collapse:collapse;margin:.6rem 0;font-size:.85rem}\
th,td{border-bottom:1px solid #ccc;padding:.2rem .6rem;text-align:left}\
caption{text-align:left;font-weight:bold;padding:.6rem 0 .2rem}\
.warning{color:#a00;font-weight:bold}.note{color:#555;font-size:.85rem}svg{max-width:100%;height:auto}";

/// Opens a page.
pub fn begin(title: &str) -> String {
    let title = escaped(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n"
    )
}

/// Closes a page.
pub fn end() -> &'static str {
    "</body></html>\n"
}

/// A paragraph; `class` is `note`, `warning` or empty.
pub fn paragraph(text: &str, class: &str) -> String {
    format!("<p class=\"{class}\">{}</p>\n", escaped(text))
}

/// A heading of the second level.
pub fn heading(text: &str) -> String {
    format!("<h2>{}</h2>\n", escaped(text))
}

/// A table with its title and notes.
pub fn table(table: &Table) -> String {
    let cells = |cells: &[String], tag: &str| {
        let cells = cells
            .iter()
            .map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell)));
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let mut out = format!(
        "<table><caption>{}</caption>\n<thead>",
        escaped(&table.title)
    );
    out += &cells(&table.header, "th");
    out += "</thead><tbody>\n";
    for row in &table.rows {
        out += &cells(row, "td");
    }
    out += "</tbody></table>\n";
    for note in &table.notes {
        let _ = write!(out, "{}", paragraph(note, "note"));
    }
    out
}

/// The text with what HTML would read as its own replaced.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_stays_text() {
        let page = table(&Table {
            name: "t".into(),
            title: "p <1e-6 & more".into(),
            header: vec!["a".into()],
            rows: vec![vec!["\"<b>\"".into()]],
            notes: vec!["8 of 10".into()],
        });
        assert!(page.contains("p &lt;1e-6 &amp; more"), "{page}");
        assert!(page.contains("<td>&quot;&lt;b&gt;&quot;</td>"), "{page}");
        assert!(page.contains("<p class=\"note\">8 of 10</p>"), "{page}");
    }
}

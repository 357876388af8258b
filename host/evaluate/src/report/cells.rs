//! Table of cells, aligned for a terminal or in Markdown.

use std::fmt::{self, Write};

/// Format of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Columns aligned with spaces.
    Text,
    /// With vertical bars, as in a README.
    Markdown,
}

/// Table of a head and rows with the same number of cells.
pub(super) struct Table {
    pub(super) head: Vec<String>,
    pub(super) rows: Vec<Vec<String>>,
}

impl Table {
    pub fn write(&self, style: Style, to: &mut String) -> fmt::Result {
        match style {
            Style::Text => self.write_text(to),
            Style::Markdown => self.write_markdown(to),
        }
    }

    fn write_markdown(&self, to: &mut String) -> fmt::Result {
        writeln!(to, "| {} |", self.head.join(" | "))?;
        writeln!(to, "|{}", "---|".repeat(self.head.len()))?;
        for row in &self.rows {
            writeln!(to, "| {} |", row.join(" | "))?;
        }
        Ok(())
    }

    fn write_text(&self, to: &mut String) -> fmt::Result {
        let lines = || [&self.head].into_iter().chain(&self.rows);
        let width = |column: usize| lines().map(|row| row[column].chars().count()).max();
        let widths: Vec<_> = (0..self.head.len())
            .map(|c| width(c).unwrap_or(0))
            .collect();
        for row in lines() {
            let cells = row.iter().zip(&widths);
            let line: Vec<_> = cells
                .map(|(cell, width)| format!("{cell:<width$}"))
                .collect();
            writeln!(to, "{}", line.join("  ").trim_end())?;
        }
        Ok(())
    }
}

/// Writes the title of a table, after an empty line where another table precedes.
pub(super) fn write_title(title: &str, style: Style, to: &mut String) -> fmt::Result {
    if !to.is_empty() {
        to.push('\n');
    }
    match style {
        Style::Text => writeln!(to, "== {title}"),
        Style::Markdown => writeln!(to, "## {title}\n"),
    }
}

pub(super) fn written(write: impl FnOnce(&mut String) -> fmt::Result) -> String {
    let mut text = String::new();
    // Writing to a String does not fail.
    let _ = write(&mut text);
    text
}

/// Cell of a missing value.
pub(super) fn none() -> String {
    "–".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let row = |cells: [&str; 2]| cells.map(str::to_owned).into();
        Table {
            head: row(["method", "RMSE"]),
            rows: vec![row(["ours", "0.25"]), row(["authors'", "–"])],
        }
    }

    #[test]
    fn text_columns_are_aligned() {
        let text = written(|to| table().write(Style::Text, to));
        assert_eq!(text, "method    RMSE\nours      0.25\nauthors'  –\n");
    }

    #[test]
    fn markdown_rows_have_vertical_bars() {
        let text = written(|to| table().write(Style::Markdown, to));
        assert_eq!(
            text,
            "| method | RMSE |\n|---|---|\n| ours | 0.25 |\n| authors' | – |\n"
        );
    }
}

//! An evaluation as tables: aligned for a terminal, or in Markdown.

use std::fmt::{self, Write};

use super::method::Method;
use super::score::Figures;
use super::{Evaluated, Evaluation, Group};
use crate::metrics::Latency;

/// How a table is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Columns aligned with spaces.
    Text,
    /// With vertical bars, as in a README.
    Markdown,
}

/// A table: a head and rows of as many cells.
struct Table {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn write(&self, style: Style, to: &mut String) -> fmt::Result {
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

/// A column of a table over groups of recordings: of which group, its title, and what it shows.
type Column = (Group, &'static str, fn(&Figures) -> String);

/// What a README has room for: this estimator, the authors' and who is best of each other kind.
const BRIEF_METHODS: [Method; 8] = [
    Method::Default,
    Method::Calibrated,
    Method::Paper,
    Method::Authors,
    Method::Shoe,
    Method::Force,
    Method::ForceTrigger,
    Method::FuzzyCMeans,
];

const BRIEF_COLUMNS: [Column; 5] = [
    (Group::Atlas, "RMSE", rmse),
    (Group::Atlas, "ROC-AUC", auc),
    (Group::Atlas, "calibration error", calibration_error),
    (Group::Slip, "RMSE", rmse),
    (Group::Lcd, "RMSE", rmse),
];

impl Evaluation {
    /// The table for the README: some methods and some figures of the first of the
    /// [full tables](Self::full_tables).
    #[must_use]
    pub fn brief_table(&self, style: Style) -> String {
        let methods = self.methods.iter();
        let brief = methods.filter(|evaluated| BRIEF_METHODS.contains(&evaluated.method));
        let table = group_table(brief, &BRIEF_COLUMNS);
        written(|to| table.write(style, to))
    }

    /// RMSE, ranking and calibration of every method on each group of recordings.
    fn overview(&self) -> Table {
        let columns: [Column; 9] = [
            (Group::Atlas, "RMSE", rmse),
            (Group::Atlas, "ROC-AUC", auc),
            (Group::Atlas, "best F1", best_f1),
            (Group::Atlas, "calibration error", calibration_error),
            (Group::Slip, "RMSE", rmse),
            (Group::Slip, "ROC-AUC", auc),
            (Group::Lcd, "RMSE", rmse),
            (Group::Lcd, "ROC-AUC", auc),
            (Group::Lcd, "calibration error", calibration_error),
        ];
        group_table(self.methods.iter(), &columns)
    }

    /// Everything: all methods on the groups of recordings, then for each recording all figures and
    /// what each method knew.
    #[must_use]
    pub fn full_tables(&self, style: Style) -> String {
        written(|to| {
            write_title("All recordings", style, to)?;
            self.overview().write(style, to)?;
            for (place, about) in self.recordings.iter().enumerate() {
                to.push('\n');
                write_title(&about.recording, style, to)?;
                writeln!(
                    to,
                    "{} samples at {} Hz, {:.1} % of them stable.\n",
                    about.samples,
                    about.sample_rate_hz,
                    100.0 * about.stable_share
                )?;
                self.recording_table(place).write(style, to)?;
            }
            Ok(())
        })
    }

    /// All figures on the recording at a place in [`SOURCES`](super::labelled::SOURCES).
    fn recording_table(&self, place: usize) -> Table {
        let head = [
            "method",
            "RMSE",
            "Brier",
            "ROC-AUC",
            "F1 at 0.5",
            "best F1",
            "calibration error",
            "on",
            "off",
            "missed",
            "what it knew",
        ];
        let row = |evaluated: &Evaluated| {
            let on = evaluated.recordings.get(place)?;
            let figures = &on.figures;
            Some(vec![
                evaluated.name.to_owned(),
                rmse(figures),
                format!("{:.4}", figures.brier_score),
                auc(figures),
                or_none(figures.f1_at_0_5),
                best_f1(figures),
                calibration_error(figures),
                latency(&figures.latency_on),
                latency(&figures.latency_off),
                missed(figures),
                on.knowledge.learnt.clone(),
            ])
        };
        Table {
            head: head.map(str::to_owned).into(),
            rows: self.methods.iter().filter_map(row).collect(),
        }
    }
}

/// Methods as rows, figures on groups as columns.
fn group_table<'a>(methods: impl Iterator<Item = &'a Evaluated>, columns: &[Column]) -> Table {
    let titles = columns
        .iter()
        .map(|(group, title, _)| format!("{} {title}", group.name()));
    let row = |evaluated: &Evaluated| {
        let cell = |(group, _, show): &Column| {
            let on = evaluated.groups.iter().find(|on| on.group == *group);
            on.map_or_else(none, |on| show(&on.figures))
        };
        let name = [evaluated.name.to_owned()];
        name.into_iter().chain(columns.iter().map(cell)).collect()
    };
    Table {
        head: ["method".to_owned()].into_iter().chain(titles).collect(),
        rows: methods.map(row).collect(),
    }
}

fn write_title(title: &str, style: Style, to: &mut String) -> fmt::Result {
    match style {
        Style::Text => writeln!(to, "== {title}"),
        Style::Markdown => writeln!(to, "## {title}\n"),
    }
}

fn written(write: impl FnOnce(&mut String) -> fmt::Result) -> String {
    let mut text = String::new();
    // A string takes all that is written to it.
    let _ = write(&mut text);
    text
}

fn none() -> String {
    "–".to_owned()
}

fn or_none(value: Option<f64>) -> String {
    value.map_or_else(none, |value| format!("{value:.3}"))
}

fn rmse(figures: &Figures) -> String {
    format!("{:.4}", figures.rmse)
}

fn auc(figures: &Figures) -> String {
    or_none(figures.roc_auc)
}

fn best_f1(figures: &Figures) -> String {
    or_none(figures.best_f1)
}

fn calibration_error(figures: &Figures) -> String {
    format!("{:.3}", figures.calibration_error)
}

fn latency(latency: &Latency) -> String {
    let milliseconds = latency.median_s.map(|s| format!("{:.1} ms", 1.0e3 * s));
    milliseconds.unwrap_or_else(none)
}

fn missed(figures: &Figures) -> String {
    let (on, off) = (&figures.latency_on, &figures.latency_off);
    let all = figures.missed() + on.followed + off.followed;
    format!("{} of {all}", figures.missed())
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
    fn columns_line_up_for_a_terminal() {
        let text = written(|to| table().write(Style::Text, to));
        assert_eq!(text, "method    RMSE\nours      0.25\nauthors'  –\n");
    }

    #[test]
    fn markdown_has_its_bars() {
        let text = written(|to| table().write(Style::Markdown, to));
        assert_eq!(
            text,
            "| method | RMSE |\n|---|---|\n| ours | 0.25 |\n| authors' | – |\n"
        );
    }

    #[test]
    fn a_latency_that_is_not_there_is_no_zero() {
        assert_eq!(latency(&Latency::default()), "–");
        let followed = Latency {
            median_s: Some(0.0125),
            followed: 1,
            missed: 0,
        };
        assert_eq!(latency(&followed), "12.5 ms");
    }
}

//! Tables of an evaluation, aligned for a terminal or in Markdown.

use std::fmt::Write;

use crate::evaluation::{Evaluated, EvaluatedSet, Evaluation};
use crate::method::ComparedMethod;
use crate::peers::Detector;
use crate::rates::{AtRate, BOARD_RATE};
use crate::score::{Figures, Scores};
use crate::sets::{Pool, Set};
use crate::teaching::Teachers;
use scoring::metrics::Latency;

use super::cells::{Style, Table, none, write_title, written};
use super::rates;

samples::named! {
    /// Figure of merit in a table.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    enum Figure {
        Rmse = "RMSE",
        Brier = "Brier",
        RocAuc = "ROC-AUC",
        F1 = "F1 at 0.5",
        BestF1 = "best F1",
        CalibrationError = "calibration error",
        FalseStable = "false stable",
    }
}

impl Figure {
    fn cell(self, scores: Option<&Scores>) -> String {
        let Some(scores) = scores else { return none() };
        match self {
            Self::Rmse => format!("{:.4}", scores.rmse),
            Self::Brier => format!("{:.4}", scores.brier_score),
            Self::RocAuc => or_none(scores.roc_auc),
            Self::F1 => or_none(scores.f1_at_0_5),
            Self::BestF1 => or_none(scores.best_f1),
            Self::CalibrationError => format!("{:.3}", scores.calibration_error),
            Self::FalseStable => or_none(scores.false_stable),
        }
    }
}

/// Samples that a figure is computed over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scope {
    /// The mean over [`Set::AVERAGED`].
    Mean,
    /// The mean over [`Set::ROBOTS`].
    Robots,
    Pool(Pool),
    Set(Set),
}

impl Scope {
    const fn name(self) -> &'static str {
        match self {
            Self::Mean => "mean",
            Self::Robots => "real robots",
            Self::Pool(pool) => pool.name(),
            Self::Set(set) => set.name(),
        }
    }

    fn scores(self, evaluated: &Evaluated) -> Option<&Scores> {
        match self {
            Self::Mean => evaluated.mean.as_ref(),
            Self::Robots => evaluated.robots.as_ref(),
            Self::Pool(pool) => evaluated.on_pool(pool).map(|figures| &figures.scores),
            Self::Set(set) => evaluated.on_set(set).map(|figures| &figures.scores),
        }
    }

    fn scores_at_rate(self, at: &AtRate) -> Option<&Scores> {
        match self {
            Self::Mean => at.mean.as_ref(),
            Self::Robots => at.robots.as_ref(),
            Self::Pool(Pool::Atlas) => at.atlas_pooled.as_ref(),
            Self::Pool(Pool::Lcd) => at.lcd_pooled.as_ref(),
            Self::Set(set) => at.on_set(set),
        }
    }
}

/// Methods in the README: this estimator, the authors' script, detectors without and with tuning, and the best
/// with a force.
const BRIEF_METHODS: [ComparedMethod; 11] = [
    ComparedMethod::Default,
    ComparedMethod::WarmStart,
    ComparedMethod::LeftOut,
    ComparedMethod::Paper,
    ComparedMethod::Authors,
    ComparedMethod::PublishedShoe,
    ComparedMethod::PublishedAred,
    ComparedMethod::tuned(Detector::Shoe, Teachers::OtherFamilies),
    ComparedMethod::tuned(Detector::Force, Teachers::OtherFamilies),
    ComparedMethod::ForceTrigger,
    ComparedMethod::FuzzyCMeans,
];

const BRIEF_COLUMNS: [(Scope, Figure); 9] = [
    (Scope::Mean, Figure::Rmse),
    (Scope::Mean, Figure::RocAuc),
    (Scope::Mean, Figure::CalibrationError),
    (Scope::Pool(Pool::Atlas), Figure::Rmse),
    (Scope::Set(Set::Slip), Figure::Rmse),
    (Scope::Pool(Pool::Lcd), Figure::Rmse),
    (Scope::Set(Set::Shoe), Figure::Rmse),
    (Scope::Set(Set::Demo), Figure::Rmse),
    (Scope::Robots, Figure::Rmse),
];

/// Figures that are compared across sets.
const COMPARED: [Figure; 5] = [
    Figure::Rmse,
    Figure::RocAuc,
    Figure::F1,
    Figure::CalibrationError,
    Figure::FalseStable,
];

/// Table for the README: some methods and figures of the [full tables](full_tables), and the default preset
/// at the board's sample rate.
#[must_use]
pub fn brief_table(evaluation: &Evaluation, style: Style) -> String {
    let methods = evaluation.methods.iter();
    let brief = methods.filter(|evaluated| BRIEF_METHODS.contains(&evaluated.method));
    let title = |(scope, figure): &(Scope, Figure)| format!("{} {}", scope.name(), figure.name());
    let row = |evaluated: &Evaluated| -> Vec<String> {
        let cells = BRIEF_COLUMNS.iter();
        let cells = cells.map(|(scope, figure)| figure.cell(scope.scores(evaluated)));
        [evaluated.name.clone()].into_iter().chain(cells).collect()
    };
    let at_rate = |at: &AtRate| -> Vec<String> {
        let cells = BRIEF_COLUMNS.iter();
        let cells = cells.map(|(scope, figure)| figure.cell(scope.scores_at_rate(at)));
        let name = format!("{}, at {}", ComparedMethod::Default.name(), at.rate.name());
        [name].into_iter().chain(cells).collect()
    };
    let board = evaluation.rates.iter().filter(|at| at.rate == BOARD_RATE);
    let mut rows: Vec<_> = brief.map(row).collect();
    // The row follows the default preset at the recordings' own rates.
    rows.splice(1..1, board.map(at_rate));
    let table = Table {
        head: head(BRIEF_COLUMNS.iter().map(title)),
        rows,
    };
    written(|to| table.write(style, to))
}

/// All tables: the means over sets, the sample rates, the pools, each figure across sets, then for each set all
/// figures and the knowledge of each method.
#[must_use]
pub fn full_tables(evaluation: &Evaluation, style: Style) -> String {
    written(|to| {
        write_title("Means over seven sets", style, to)?;
        scope_table(evaluation, Scope::Mean).write(style, to)?;
        write_title("Means over four real robots", style, to)?;
        scope_table(evaluation, Scope::Robots).write(style, to)?;
        write_title("Default preset at several sample rates", style, to)?;
        rates::by_set(evaluation).write(style, to)?;
        for pool in Pool::ALL {
            write_title(pool.name(), style, to)?;
            scope_table(evaluation, Scope::Pool(pool)).write(style, to)?;
        }
        for figure in COMPARED {
            write_title(&format!("{} by set", figure.name()), style, to)?;
            figure_table(evaluation, figure).write(style, to)?;
        }
        for about in &evaluation.sets {
            write_title(&set_title(about), style, to)?;
            writeln!(to, "{}\n", described(about))?;
            set_table(evaluation, about.set).write(style, to)?;
        }
        Ok(())
    })
}

/// Table of all figures of one scope, for the methods that have any.
fn scope_table(evaluation: &Evaluation, scope: Scope) -> Table {
    let row = |evaluated: &Evaluated| {
        let scores = scope.scores(evaluated)?;
        let cells = Figure::ALL.map(|figure| figure.cell(Some(scores)));
        Some([evaluated.name.clone()].into_iter().chain(cells).collect())
    };
    Table {
        head: head(Figure::ALL.map(|figure| figure.name().to_owned())),
        rows: evaluation.methods.iter().filter_map(row).collect(),
    }
}

/// Table of one figure of all methods: the means, ATLAS pooled, and every set.
fn figure_table(evaluation: &Evaluation, figure: Figure) -> Table {
    let scopes = || {
        let sets = Set::ALL.into_iter().map(Scope::Set);
        [Scope::Mean, Scope::Robots, Scope::Pool(Pool::Atlas)]
            .into_iter()
            .chain(sets)
    };
    let row = |evaluated: &Evaluated| {
        let cells = scopes().map(|scope| figure.cell(scope.scores(evaluated)));
        [evaluated.name.clone()].into_iter().chain(cells).collect()
    };
    Table {
        head: head(scopes().map(|scope| scope.name().to_owned())),
        rows: evaluation.methods.iter().map(row).collect(),
    }
}

/// Table of all figures on a set, for the methods that can run on it.
fn set_table(evaluation: &Evaluation, set: Set) -> Table {
    let titles = Figure::ALL.into_iter().map(Figure::name);
    let titles = titles.chain(["on", "off", "missed", "what it knew"]);
    let row = |evaluated: &Evaluated| {
        let on = evaluated.sets.iter().find(|on| on.set == set)?;
        let figures = &on.figures;
        let scores = Figure::ALL.map(|figure| figure.cell(Some(&figures.scores)));
        let others = [
            latency(&figures.latency_on),
            latency(&figures.latency_off),
            missed(figures),
            on.knowledge.learnt.clone(),
        ];
        let name = [evaluated.name.clone()];
        Some(name.into_iter().chain(scores).chain(others).collect())
    };
    Table {
        head: head(titles.map(str::to_owned)),
        rows: evaluation.methods.iter().filter_map(row).collect(),
    }
}

fn head(titles: impl IntoIterator<Item = String>) -> Vec<String> {
    ["method".to_owned()].into_iter().chain(titles).collect()
}

/// Name of a set, with that of its recording if it has only one.
fn set_title(about: &EvaluatedSet) -> String {
    match about.recordings.as_slice() {
        [recording] => format!("{}: {recording}", about.set.name()),
        recordings => format!("{}: {} recordings", about.set.name(), recordings.len()),
    }
}

fn described(about: &EvaluatedSet) -> String {
    format!(
        "{} samples at {} Hz, {:.1} % of them stable.",
        about.samples,
        about.sample_rate_hz,
        100.0 * about.stable_share
    )
}

fn or_none(value: Option<f64>) -> String {
    value.map_or_else(none, |value| format!("{value:.3}"))
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

    #[test]
    fn missing_latency_is_not_shown_as_zero() {
        assert_eq!(latency(&Latency::default()), "–");
        let followed = Latency {
            median_s: Some(0.0125),
            followed: 1,
            missed: 0,
        };
        assert_eq!(latency(&followed), "12.5 ms");
    }
}

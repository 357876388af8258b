//! Tables of the default preset at several sample rates.

use crate::evaluation::Evaluation;
use crate::rates::AtRate;
use crate::score::Scores;

use super::cells::{Table, none};

/// RMSE and share of the stable samples that are missed, with a row per set and a column per rate.
pub(super) fn by_set(evaluation: &Evaluation) -> Table {
    let cell = |scores: Option<&Scores>| -> String {
        let Some(scores) = scores else { return none() };
        let missed = scores.missed_stable.map(|share| 100.0 * share);
        let missed = missed.map_or_else(none, |percent| format!("{percent:.1} %"));
        format!("{:.4} · {missed}", scores.rmse)
    };
    let row = |name: &str, rate: &str, of: &dyn Fn(&AtRate) -> Option<Scores>| {
        let cells = evaluation.rates.iter().map(|at| cell(of(at).as_ref()));
        let title = [name.to_owned(), rate.to_owned()];
        title.into_iter().chain(cells).collect::<Vec<_>>()
    };
    let sets = evaluation.sets.iter().map(|about| {
        let rate = format!("{} Hz", about.sample_rate_hz);
        row(about.set.name(), &rate, &|at| at.on_set(about.set).copied())
    });
    let rates = evaluation.rates.iter().map(|at| at.rate.name());
    let title = ["RMSE · stable samples missed", "native rate"].map(str::to_owned);
    Table {
        head: title.into_iter().chain(rates).collect(),
        rows: [
            row("mean", "", &|at| at.mean),
            row("real robots", "", &|at| at.robots),
            row("ATLAS pooled", "", &|at| at.atlas_pooled),
        ]
        .into_iter()
        .chain(sets)
        .collect(),
    }
}

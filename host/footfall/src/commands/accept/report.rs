//! Report of an acceptance as text and as JSON.

use crate::commands::foot::{Identity, to_json};
use crate::foot_error::FootError;
use crate::json::{Described, Document};
use feet::foot::accept::{AcceptStep, Figure, FigureOutcome, Verdict};
use feet::foot::client::Client;
use serde::Serialize;

/// Figures of a healthy foot on the virtual board, by the names of the step and of the quantity.
const PREDICTIONS: &str = include_str!("virtual-board.csv");

/// How an acceptance has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// All steps were done.
    Complete,
    /// The person has left, or the line has failed.
    Early,
}

/// Report of the acceptance of a board.
#[derive(Debug, Default, Serialize)]
pub struct AcceptReport {
    /// Whether all chosen steps were done, at least one figure was measured, and none is out of its limits.
    pub(super) accepted: bool,
    /// The steps that were chosen.
    steps: Vec<&'static str>,
    /// Number of figures within their limits.
    passed: usize,
    /// Number of figures out of their limits.
    out: usize,
    /// Number of figures that were not measured.
    not_tested: usize,
    /// The foot's name, such as FL.
    pub(super) foot: &'static str,
    /// Its node id, 1 to 127; null on a serial line.
    pub(super) node: Option<u8>,
    /// Its serial number (object 0x1018).
    pub(super) serial: u32,
    /// Its hardware (object 0x1009).
    pub(super) hardware: String,
    /// The version of its program (object 0x100A).
    pub(super) version: String,
    /// The number of its program (object 0x1F56), hexadecimal; null where no image and no commit names it.
    pub(super) program: Option<String>,
    /// The figures, in the order in which they were measured.
    pub(super) figures: Vec<Judged>,
}

/// A figure with its limits and the judgement.
#[derive(Debug, Serialize)]
pub(super) struct Judged {
    /// Step in which it was measured.
    pub(super) step: &'static str,
    /// Name of the quantity.
    pub(super) name: &'static str,
    /// The value; null where nothing was measured, or where it is not finite.
    pub(super) value: Option<f64>,
    /// Unit; empty for counts and codes.
    pub(super) unit: &'static str,
    /// Least accepted value; null without one.
    lowest: Option<f64>,
    /// Greatest accepted value; null without one.
    highest: Option<f64>,
    /// Origin of the limits.
    pub(super) source: &'static str,
    /// Value on the virtual board; null where it has none.
    pub(super) predicted: Option<f64>,
    /// pass, OUT or not tested.
    pub(super) verdict: &'static str,
    /// Parts of the value, such as the names of faults, or why nothing was measured.
    pub(super) detail: String,
    /// What to do; empty where the value is within its limits, or where there is none.
    pub(super) remedy: &'static str,
}

impl Described for AcceptReport {
    const SCHEMA: &'static str = "urn:footfall:accept:1";
}

impl AcceptReport {
    /// Creates the report of a foot before the first step.
    pub(super) fn of(client: &mut Client, steps: &[AcceptStep]) -> Result<Self, FootError> {
        let identity = Identity::read(client)?;
        Ok(Self {
            steps: steps.iter().map(|step| step.name()).collect(),
            foot: identity.foot,
            node: identity.node,
            serial: identity.serial,
            hardware: identity.hardware,
            version: identity.version,
            program: identity.program,
            ..Self::default()
        })
    }

    /// Takes the figures of all steps, and judges.
    pub(super) fn take(&mut self, figures: &[Figure], end: End) {
        let count = |verdict| {
            let judged = figures.iter();
            judged.filter(|figure| figure.verdict() == verdict).count()
        };
        self.passed = count(Verdict::Pass);
        self.out = count(Verdict::Out);
        self.not_tested = count(Verdict::NotTested);
        self.accepted = end == End::Complete && self.out == 0 && self.passed > 0;
        self.figures = figures.iter().map(Judged::of).collect();
    }

    pub(super) fn to_json(&self) -> String {
        to_json(&Document::line(self))
    }

    /// The values that are out, with their remedies; steps that failed; and the counts.
    pub(super) fn summary(&self) -> String {
        let out = self.figures.iter().filter(|figure| figure.is_out());
        let mut lines: Vec<String> = out
            .map(|figure| match figure.remedy {
                "" => format!("{}: {}\n", figure.step, figure.detail),
                remedy => format!("{}: {remedy}\n", figure.name),
            })
            .collect();
        // A step that failed has the same reason for all its figures.
        lines.dedup();
        lines.concat() + &self.counts() + "\n"
    }

    pub(super) fn counts(&self) -> String {
        let not = if self.accepted { "" } else { "not " };
        let of = match self.steps.len() == AcceptStep::ALL.len() {
            true => String::new(),
            false => format!(" in {}", self.steps.join(", ")),
        };
        format!(
            "{not}accepted{of}: {} passed, {} out, {} not tested",
            self.passed, self.out, self.not_tested
        )
    }
}

impl Judged {
    fn is_out(&self) -> bool {
        self.verdict == Verdict::Out.name()
    }

    fn of(figure: &Figure) -> Self {
        let limit = figure.limit;
        let finite = |value: f64| value.is_finite().then_some(value);
        let verdict = figure.verdict();
        let (value, reason, remedy) = match &figure.outcome {
            FigureOutcome::Measured(value) => (finite(*value), "", limit.remedy),
            FigureOutcome::Failed(reason) | FigureOutcome::NotTested(reason) => {
                (None, reason.as_str(), "")
            }
        };
        Self {
            step: limit.step.name(),
            name: limit.name,
            value,
            unit: limit.unit,
            lowest: finite(limit.lowest),
            highest: finite(limit.highest),
            source: limit.source,
            predicted: predicted(limit.step.name(), limit.name),
            verdict: verdict.name(),
            detail: figure.detail.clone() + reason,
            remedy: if verdict == Verdict::Out { remedy } else { "" },
        }
    }
}

/// Value of a quantity on the virtual board.
fn predicted(step: &str, name: &str) -> Option<f64> {
    let mut rows = PREDICTIONS.lines().map(|line| line.split(','));
    rows.find_map(|mut cells| {
        let is_this = cells.next() == Some(step) && cells.next() == Some(name);
        cells.next()?.parse().ok().filter(|_| is_this)
    })
}

/// Formats a figure as a line: name, value, limits, verdict.
pub(super) fn line(figure: &Figure) -> String {
    let limit = figure.limit;
    let name = limit.name;
    let verdict = figure.verdict().name();
    match &figure.outcome {
        FigureOutcome::NotTested(reason) | FigureOutcome::Failed(reason) => {
            format!("{name:<32} {verdict}: {reason}")
        }
        FigureOutcome::Measured(value) => {
            let value = format!("{} {}", short(*value), limit.unit);
            let range = limit.range();
            let detail = match figure.detail.as_str() {
                "" => String::new(),
                detail => format!("  ({detail})"),
            };
            format!("{name:<32} {value:<14} {range:<14} {verdict}{detail}")
        }
    }
}

/// Formats a value with four digits.
pub(super) fn short(value: f64) -> String {
    let digits = match value.abs() {
        large if large >= 1000.0 || value.fract() == 0.0 => 0,
        large if large >= 10.0 => 2,
        large if large >= 1.0 => 3,
        _ => 4,
    };
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use feet::foot::accept::figure::LIMITS;

    #[test]
    fn every_quantity_has_a_prediction_within_its_limits() {
        for limit in LIMITS {
            let value = predicted(limit.step.name(), limit.name);
            let value = value.unwrap_or_else(|| panic!("{} has none", limit.name));
            assert!((limit.lowest..=limit.highest).contains(&value), "{}", limit.name);
        }
        assert_eq!(PREDICTIONS.lines().count(), 1 + LIMITS.len());
    }

    #[test]
    fn values_have_four_digits() {
        let texts = [0.0, 1.0, 0.02512, 9.8066, 99.987, 1000.4].map(short);
        assert_eq!(texts, ["0", "1", "0.0251", "9.807", "99.99", "1000"]);
    }
}

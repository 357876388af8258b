//! `footfall accept`: measures a board with a person's help, and judges each figure.

use std::sync::LazyLock;
use std::time::Duration;

use clap::Args;
use feet::LineSource;
use feet::foot::Client;
use feet::foot::accept::{
    self, AcceptStep, Figure, FigureHint, FigureOutcome, LimitedQuantity, Person, Verdict,
};
use serde::{Deserialize, Serialize};
use wire::NodeId;

use super::foot::{Identity, to_json};
use super::options::{HELP_OF_BOARDS, parse_node};
use crate::error::{Error, Worded};
use crate::interruption::{finish_when_interrupted, is_interrupted};
use crate::messages;
use crate::report::{Described, Document, print_text};
use crate::source::{Source, SourceArgument, find_all};
use crate::words::with_hint;

/// Arguments of `footfall accept`.
#[derive(Debug, Args)]
pub struct AcceptArguments {
    /// Sources of the boards, which are measured one after the other.
    #[arg(required = true, value_name = "SOURCE", help = HELP_OF_BOARDS)]
    pub sources: Vec<SourceArgument>,
    /// Node id on a CAN bus, 1 to 127; not needed if there is only one foot
    #[arg(long, value_name = "ID", value_parser = parse_node)]
    pub node: Option<NodeId>,
    /// Run only these steps, such as still,sides. The steps are board, self-test, still, sides, taps, steps, load, unplug
    #[arg(long, value_name = "STEPS", value_delimiter = ',', value_parser = parse_step)]
    pub only: Vec<AcceptStep>,
    /// Timeout of each step, s
    #[arg(long, value_name = "S", default_value_t = 120, value_parser = clap::value_parser!(u16).range(1..=3600))]
    pub seconds: u16,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

fn parse_step(text: &str) -> Result<AcceptStep, String> {
    let step = AcceptStep::ALL.into_iter().find(|step| step.name() == text);
    let names = AcceptStep::ALL.map(AcceptStep::name).join(", ");
    step.ok_or_else(|| format!("write some of {names}, with commas between"))
}

impl AcceptArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let sources = find_all(&self.sources)?;
        let mut rejected = Vec::new();
        for source in &sources {
            if sources.len() > 1 {
                messages::aside(format!("{source}:"));
            }
            match self.accept(source)? {
                Some(why) if sources.len() > 1 => rejected.push(format!("{source}: {why}")),
                Some(why) => rejected.push(why),
                None => {}
            }
            if is_interrupted() {
                break;
            }
        }
        if rejected.is_empty() { Ok(()) } else { Err(NotAccepted(rejected.join("; ")).into()) }
    }

    /// Measures one board. Returns the reason if it is not accepted.
    fn accept(&self, source: &Source) -> Result<Option<String>, Error> {
        let link = source.open_for_requests()?;
        let mut client = Client::new(link, self.node)?;
        // Some steps change settings of the foot, and restore them at their end.
        finish_when_interrupted();
        let mut steps =
            if self.only.is_empty() { AcceptStep::ALL.to_vec() } else { self.only.clone() };
        steps.sort_unstable();
        steps.dedup();
        let mut report = AcceptReport::of(&mut client, &steps)?;
        let mut person = Person {
            patience: Duration::from_secs(self.seconds.into()),
            tell: &mut |words| messages::aside(words),
            has_left: &is_interrupted,
        };
        let mut figures = Vec::new();
        let done = accept::run(&mut client, &steps, &mut person, &mut |figure: Figure| {
            messages::aside(line(&figure));
            figures.push(figure);
        });
        let reason = match &done {
            Err(error) => Some(with_hint(error, error.hint())),
            Ok(()) => is_interrupted().then(|| "interrupted".to_owned()),
        };
        if let Some(reason) = &reason {
            let is_done = |step: AcceptStep| figures.iter().any(|figure| figure.limit.step == step);
            let rest: Vec<_> = steps.iter().filter(|step| !is_done(**step)).collect();
            figures.extend(rest.into_iter().flat_map(|step| step.not_tested(reason)));
        }
        let end = match reason {
            Some(_) => End::Early,
            None => End::Complete,
        };
        report.finish(&figures, end);
        let text = if self.json { report.to_json() } else { report.summary() };
        print_text(&text).map_err(Error::Print)?;
        done?;
        let is_out = |figure: &&Figure| figure.verdict() == Verdict::Out;
        let out = figures.iter().filter(is_out);
        let names: Vec<_> = out.map(|figure| figure.limit.name).collect();
        if report.accepted {
            return Ok(None);
        }
        let why = if !names.is_empty() {
            names.join(", ")
        } else if end == End::Early {
            "interrupted".to_owned()
        } else {
            "nothing was measured".to_owned()
        };
        Ok(Some(why))
    }
}

/// Figures of a board are out of their limits.
#[derive(Debug, thiserror::Error)]
#[error("not accepted: {0}")]
struct NotAccepted(String);

impl Worded for NotAccepted {}

/// Result with the figures of a healthy foot on the virtual board: a row for each step and quantity.
const PREDICTIONS: &str = include_str!("acceptance.json");

/// How an acceptance has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    /// All steps were done.
    Complete,
    /// The person has left, or the line has failed.
    Early,
}

/// Report of the acceptance of a board.
#[derive(Debug, Default, Serialize)]
pub struct AcceptReport {
    /// Whether all chosen steps were done, at least one figure was measured, and none is out of its limits.
    accepted: bool,
    /// The steps that were chosen.
    steps: Vec<&'static str>,
    /// Number of figures within their limits.
    passed: usize,
    /// Number of figures out of their limits.
    out: usize,
    /// Number of figures that were not measured.
    not_tested: usize,
    /// The foot's name, such as FL.
    foot: &'static str,
    /// Node id of the foot, 1 to 127; null on a serial line.
    node: Option<u8>,
    /// Serial number of the board (object 0x1018).
    serial: u32,
    /// Hardware of the board (object 0x1009).
    hardware: String,
    /// The version of its program (object 0x100A).
    version: String,
    /// The number of its program (object 0x1F56), hexadecimal; null if neither an image nor a commit identifies it.
    program: Option<String>,
    /// The figures, in the order in which they were measured.
    figures: Vec<JudgedFigure>,
}

/// A figure with its limits and its verdict.
#[derive(Debug, Serialize)]
struct JudgedFigure {
    /// Step in which it was measured.
    step: &'static str,
    /// Name of the quantity.
    name: &'static str,
    /// The value; null if nothing was measured, or if it is not finite.
    value: Option<f64>,
    /// Unit; empty for counts and codes.
    unit: &'static str,
    /// Least accepted value; null without one.
    lowest: Option<f64>,
    /// Greatest accepted value; null without one.
    highest: Option<f64>,
    /// Origin of the limits.
    source: &'static str,
    /// Value on the virtual board; null if it has none.
    predicted: Option<f64>,
    /// pass, OUT or not tested.
    verdict: &'static str,
    /// Parts of the value, such as the names of faults, or the reason nothing was measured.
    detail: String,
    /// Remedy; empty if the value is within its limits or was not measured.
    remedy: String,
}

impl Described for AcceptReport {
    const SCHEMA: &'static str = "urn:footfall:accept:1";
}

impl AcceptReport {
    /// Creates the report of a foot before the first step.
    fn of(client: &mut Client, steps: &[AcceptStep]) -> Result<Self, Error> {
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

    /// Adds the figures of all steps, and decides whether the board is accepted.
    fn finish(&mut self, figures: &[Figure], end: End) {
        let count = |verdict| {
            let judged = figures.iter();
            judged.filter(|figure| figure.verdict() == verdict).count()
        };
        self.passed = count(Verdict::Pass);
        self.out = count(Verdict::Out);
        self.not_tested = count(Verdict::NotTested);
        self.accepted = end == End::Complete && self.out == 0 && self.passed > 0;
        self.figures = figures.iter().map(JudgedFigure::of).collect();
    }

    fn to_json(&self) -> String {
        to_json(&Document::line(self))
    }

    /// Returns the values out of their limits with their remedies, the steps that failed, and the counts.
    fn summary(&self) -> String {
        let out = self.figures.iter().filter(|figure| figure.is_out());
        let mut lines: Vec<String> = out
            .map(|figure| match figure.remedy.as_str() {
                "" => format!("{}: {}\n", figure.step, figure.detail),
                remedy => format!("{}: {remedy}\n", figure.name),
            })
            .collect();
        // A step that failed has the same reason for all its figures.
        lines.dedup();
        lines.concat() + &self.counts() + "\n"
    }

    fn counts(&self) -> String {
        let not = if self.accepted { "" } else { "not " };
        let of = if self.steps.len() == AcceptStep::ALL.len() {
            String::new()
        } else {
            format!(" in {}", self.steps.join(", "))
        };
        format!(
            "{not}accepted{of}: {} passed, {} out, {} not tested",
            self.passed, self.out, self.not_tested
        )
    }
}

impl JudgedFigure {
    fn is_out(&self) -> bool {
        self.verdict == Verdict::Out.name()
    }

    fn of(figure: &Figure) -> Self {
        let limit = figure.limit;
        let finite = |value: f64| value.is_finite().then_some(value);
        let verdict = figure.verdict();
        let (value, reason, remedy) = match &figure.outcome {
            FigureOutcome::Measured(value) => (finite(*value), "", remedy(limit)),
            FigureOutcome::Failed(reason) | FigureOutcome::NotTested(reason) => {
                (None, reason.as_str(), String::new())
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
            remedy: if verdict == Verdict::Out { remedy } else { String::new() },
        }
    }
}

/// Returns what to do about a value out of its limits: the command of a hint, then the remedy.
fn remedy(limit: &LimitedQuantity) -> String {
    let command = limit.hint.map(|hint| match hint {
        FigureHint::ExplainFaults => "footfall explain has a remedy for each",
        FigureHint::ExplainCode => "footfall explain names the code",
        FigureHint::WatchContacts => "footfall monitor names the flag or fault",
        FigureHint::CalibrateRests => "footfall calibrate --rests finds bias and scale",
    });
    let remedy = Some(limit.remedy).filter(|remedy| !remedy.is_empty());
    command.into_iter().chain(remedy).collect::<Vec<_>>().join("; ")
}

/// Value of a quantity on the virtual board.
fn predicted(step: &str, name: &str) -> Option<f64> {
    static ROWS: LazyLock<Vec<Prediction>> = LazyLock::new(|| {
        let result: Result<Predictions, _> = serde_json::from_str(PREDICTIONS);
        result.map_or_else(|_| Vec::new(), |result| result.rows)
    });
    let row = ROWS.iter().find(|row| (row.step.as_str(), row.quantity.as_str()) == (step, name));
    row.map(|row| row.value)
}

/// The part of a stored result that is read.
#[derive(Deserialize)]
struct Predictions {
    rows: Vec<Prediction>,
}

#[derive(Deserialize)]
struct Prediction {
    step: String,
    quantity: String,
    value: f64,
}

/// Formats a figure as a line: name, value, limits, verdict.
fn line(figure: &Figure) -> String {
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
fn short(value: f64) -> String {
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
        let result: Predictions = serde_json::from_str(PREDICTIONS).expect("a result");
        assert_eq!(result.rows.len(), LIMITS.len());
    }

    #[test]
    fn values_have_four_digits() {
        let texts = [0.0, 1.0, 0.02512, 9.8066, 99.987, 1000.4].map(short);
        assert_eq!(texts, ["0", "1", "0.0251", "9.807", "99.99", "1000"]);
    }
}

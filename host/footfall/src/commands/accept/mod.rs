//! `footfall accept`: measures a board with a person's help, and judges each figure.
//!
//! | content | file |
//! |---|---|
//! | arguments, and the walk through the steps | this one |
//! | report as text and as JSON | `report` |

mod report;

use std::time::Duration;

use clap::Args;
use feet::Source;
use feet::foot::accept::{self, AcceptStep, Figure, Person, Verdict};
use feet::foot::client::Client;
use feet::link;
use wire::NodeId;

use super::options::feet::parse_node;
use super::options::listen::SOURCES;
use crate::error::Error;
use crate::files::{finish_when_interrupted, is_interrupted};
use crate::foot_error::FootError;
use crate::messages;
use crate::report::print_text;
pub use report::AcceptReport;
use report::End;

/// Arguments of `footfall accept`.
#[derive(Debug, Args)]
pub struct AcceptArguments {
    /// Where the foot is.
    #[arg(help = SOURCES)]
    pub source: Source,
    /// Which node of a CAN bus, 1 to 127; may be left out where there is only one foot
    #[arg(long, value_name = "ID", value_parser = parse_node)]
    pub node: Option<NodeId>,
    /// Do these steps alone, such as still,sides: board, self-test, still, sides, taps, steps, load, unplug
    #[arg(long, value_name = "STEPS", value_delimiter = ',', value_parser = parse_step)]
    pub only: Vec<AcceptStep>,
    /// How long each step waits for you, s
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
        let link = link::open_for_requests(&self.source)?;
        let mut client = Client::new(link, self.node).map_err(FootError::from)?;
        // The self-test changes a setting meanwhile, and so do the streams of a serial line.
        finish_when_interrupted();
        let mut steps = match self.only.is_empty() {
            true => AcceptStep::ALL.to_vec(),
            false => self.only.clone(),
        };
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
            messages::aside(report::line(&figure));
            figures.push(figure);
        });
        let reason = match &done {
            Err(error) => Some(error.to_string()),
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
        report.take(&figures, end);
        let text = if self.json { report.to_json() } else { report.summary() };
        print_text(&text).map_err(Error::Print)?;
        done.map_err(FootError::from)?;
        let is_out = |figure: &&Figure| figure.verdict() == Verdict::Out;
        let out = figures.iter().filter(is_out);
        let names: Vec<_> = out.map(|figure| figure.limit.name).collect();
        let why = match (report.accepted, names.is_empty(), end) {
            (true, ..) => return Ok(()),
            (false, false, _) => names.join(", "),
            (false, true, End::Early) => "interrupted".to_owned(),
            (false, true, End::Complete) => "nothing was measured".to_owned(),
        };
        Err(FootError::NotAccepted(why).into())
    }
}

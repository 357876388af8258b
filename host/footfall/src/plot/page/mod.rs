//! Page of a replay: all feet in one HTML file that needs no network, with zoom by mouse.
//!
//! [uPlot](https://github.com/leeoniya/uPlot) draws the JSON data in the page. Lines are envelopes of [`COLUMNS`]
//! columns that keep every peak, so the size of a page depends on the number of feet and not on the length of the
//! recordings. Feet whose times overlap on their clocks share an axis.

mod pack;

use std::fmt::Write as _;
use std::io::{self, Write};
use std::ops::Range;

use estimator_core::{ContactEstimate, Decision, Phase};
use recordings::events::{ContactEvent, EventKind};
use recordings::input::About;
use recordings::samples::recording::{Label, RecordedSample};

use super::decimate::{Stretching, Width};
use super::series::Collector;
use super::time_title;
use pack::{json_string, shared_axes};

/// Number of columns in the envelope of each line.
pub const COLUMNS: u32 = 20_000;

/// Maximum number of events of one foot in a page; the page states how many were omitted.
pub const MOST_EVENTS: usize = 20_000;

const FRAME: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");
const UPLOT: &str = include_str!("../uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../uplot/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("../uplot/LICENSE");

/// Names of decisions and labels by their codes in the page.
const DECISIONS: [Decision; 2] = [Decision::NotStable, Decision::Stable];
const DECISION_NAMES: [&str; 2] = ["not_stable", "stable"];
const LABELS: [Option<Label>; 3] = [None, Some(Label::NotStable), Some(Label::Stable)];
const LABEL_NAMES: [&str; 3] = ["unknown", "not_stable", "stable"];

/// Page data of one foot, collected sample by sample.
pub struct PageFoot {
    name: String,
    start_us: i64,
    load_title: String,
    sample_rate: f32,
    span: Range<f64>,
    samples: usize,
    collector: Collector,
    decisions: Stretching<Decision>,
    events: Vec<ContactEvent>,
    /// Number of events per kind, in the order of [`EventKind::ALL`].
    counts: [usize; EventKind::ALL.len()],
}

impl PageFoot {
    /// Creates the page data of a recording from `span.start` to `span.end`, s since its first sample.
    #[must_use]
    pub fn new(name: &str, about: &About, span: Range<f64>) -> Self {
        let width = Width { span: span.clone(), columns: COLUMNS };
        Self {
            name: name.to_owned(),
            start_us: about.start_us,
            load_title: about.load_title.clone(),
            sample_rate: about.sample_rate,
            span,
            samples: 0,
            collector: Collector::new(width.clone(), 1),
            decisions: Stretching::new(width),
            events: Vec::new(),
            counts: [0; EventKind::ALL.len()],
        }
    }

    /// Adds a sample with its estimate.
    pub fn add(&mut self, sample: &RecordedSample, estimate: &ContactEstimate) {
        self.samples += 1;
        self.collector.add(sample, estimate);
        self.decisions.add(sample.time_s(), estimate.decision);
    }

    /// Adds an event.
    pub fn add_event(&mut self, event: &ContactEvent) {
        self.counts[event.kind as usize] += 1;
        if self.events.len() < MOST_EVENTS {
            self.events.push(*event);
        }
    }

    /// Returns the covered time on the foot's clock, µs.
    fn on_clock(&self) -> Range<i64> {
        let at = |seconds: f64| self.start_us.saturating_add(pack::micros(seconds));
        at(self.span.start)..at(self.span.end)
    }

    /// Appends the data as JSON; `axis` is the index of its axis, whose 0 is `origin_us` on the clock.
    fn pack(self, axis: usize, origin_us: i64, to: &mut String) -> std::fmt::Result {
        let counted: usize = self.counts.iter().sum();
        write!(
            to,
            "{{\"name\":{},\"group\":{axis},\"shift\":{},\"samples\":{},\"rate\":{},\"from\":{},\"duration\":{},\
             \"left_out\":{},\"counts\":{{",
            json_string(&self.name),
            (self.start_us - origin_us) as f64 / 1.0e6,
            self.samples,
            self.sample_rate,
            self.span.start,
            self.span.end - self.span.start,
            counted - self.events.len(),
        )?;
        for (k, (kind, count)) in EventKind::ALL.into_iter().zip(self.counts).enumerate() {
            let comma = if k > 0 { "," } else { "" };
            write!(to, "{comma}\"{}\":{count}", kind.name())?;
        }
        to.push_str("},\"lines\":[");
        let series = self.collector.finish();
        if let Some((trace, range)) = &series.load {
            pack::line("load", &self.load_title, trace, range.clone(), to)?;
            to.push(',');
        }
        let [tangential, vertical, total] = &series.probabilities;
        pack::line("tangential", "P tangential", tangential, 0.0..1.0, to)?;
        to.push(',');
        pack::line("vertical", "P vertical", vertical, 0.0..1.0, to)?;
        to.push(',');
        pack::line("total", "P stable", total, 0.0..1.0, to)?;
        to.push_str("],\"states\":");
        pack::stretches(&series.phases, &Phase::ALL, to)?;
        to.push_str(",\"decisions\":");
        pack::stretches(&self.decisions.finish(), &DECISIONS, to)?;
        to.push_str(",\"labels\":");
        match &series.labels {
            Some(labels) => pack::stretches(labels, &LABELS, to)?,
            None => to.push_str("null"),
        }
        to.push_str(",\"events\":");
        pack::events(&self.events, to)?;
        to.push('}');
        Ok(())
    }
}

/// Writes the page of the given feet.
///
/// # Errors
/// Errors of the writer.
pub fn write(feet: Vec<PageFoot>, to: &mut dyn Write) -> io::Result<()> {
    let title = title(&feet);
    let data = data(&title, feet).map_err(io::Error::other)?;
    let mut rest = FRAME;
    // Placeholders are replaced in template order; inserted content is not searched again.
    for (place, content) in [
        ("{title}", escaped(&title).as_str()),
        ("{uplot_style}", UPLOT_STYLE),
        ("{style}", STYLE),
        ("{data}", &data),
        ("{licence}", UPLOT_LICENCE),
        ("{uplot}", UPLOT),
        ("{script}", SCRIPT),
    ] {
        let (before, after) = rest
            .split_once(place)
            .ok_or_else(|| io::Error::other(format!("the frame has no place for {place}")))?;
        to.write_all(before.as_bytes())?;
        to.write_all(content.as_bytes())?;
        rest = after;
    }
    to.write_all(rest.as_bytes())
}

/// Returns the names of the feet, or their number.
fn title(feet: &[PageFoot]) -> String {
    let names: Vec<_> = feet.iter().map(|foot| foot.name.as_str()).collect();
    match names.len() {
        0..=3 => names.join(", "),
        many => format!("{} and {} more", names[0], many - 1),
    }
}

/// Returns all data for the page's script, as JSON.
fn data(title: &str, feet: Vec<PageFoot>) -> Result<String, std::fmt::Error> {
    let clocks: Vec<_> = feet.iter().map(PageFoot::on_clock).collect();
    let (axes, axis_of) = shared_axes(&clocks);
    let mut to = String::new();
    let program = concat!("footfall ", env!("CARGO_PKG_VERSION"));
    write!(
        to,
        "{{\"title\":{},\"program\":\"{program}\",\"states\":{},\"decisions\":{},\"labels\":{},\"events\":{},\
         \"groups\":[",
        json_string(title),
        pack::names(Phase::ALL.map(Phase::name)),
        pack::names(DECISION_NAMES),
        pack::names(LABEL_NAMES),
        pack::names(EventKind::ALL.map(EventKind::name)),
    )?;
    // As in the figure of a foot, 0 on an axis is timestamp 0 of its first foot.
    let origin = |axis| {
        let of_axis = feet.iter().zip(&axis_of).filter(|(_, of)| **of == axis);
        of_axis.map(|(foot, _)| foot.start_us).min().unwrap_or(0)
    };
    let origins: Vec<i64> = (0..axes.len()).map(origin).collect();
    for (k, (axis, origin)) in axes.iter().zip(&origins).enumerate() {
        let comma = if k > 0 { "," } else { "" };
        let seconds = |micros: i64| (micros - origin) as f64 / 1.0e6;
        write!(
            to,
            "{comma}{{\"title\":{},\"from\":{},\"to\":{}}}",
            json_string(&time_title(*origin)),
            seconds(axis.start),
            seconds(axis.end),
        )?;
    }
    to.push_str("],\"feet\":[");
    for (k, (foot, axis)) in feet.into_iter().zip(axis_of).enumerate() {
        to.push_str(if k > 0 { "," } else { "" });
        foot.pack(axis, origins[axis], &mut to)?;
    }
    to.push_str("]}");
    Ok(to)
}

/// Escapes a text for use between tags.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests;

//! Page of a replay: all feet in one HTML file that needs no network, with zoom by mouse.
//!
//! [uPlot](https://github.com/leeoniya/uPlot) draws the JSON data in the page. Lines are envelopes of [`COLUMNS`]
//! columns that keep every peak, so the size of a page depends on the number of feet and not on the length of the
//! recordings. Feet whose times overlap on their clocks share an axis.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::ops::Range;

use estimator_core::{ContactEstimate, Decision, Phase};
use replay::events::{ContactEvent, EventKind};
use samples::{Label, RecordedSample};
use serde::Serialize;
use stored::About;

use super::series::{Collector, Line, LineKind, Width};
use super::time_title;

/// Number of columns in the envelope of each line.
pub const COLUMNS: u32 = 20_000;

/// Maximum number of events of one foot in a page; the page states how many were omitted.
pub const MOST_EVENTS: usize = 20_000;

/// Levels of a line between its lowest and its highest value: finer than a pixel, as values cannot be zoomed.
const LEVELS: u16 = 10_000;

const FRAME: &str = include_str!("page/page.html");
const STYLE: &str = include_str!("page/page.css");
const SCRIPT: &str = include_str!("page/page.js");
const UPLOT: &str = include_str!("uplot/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("uplot/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("uplot/LICENSE");

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
    events: Vec<ContactEvent>,
    /// Number of events per kind, in the order of [`EventKind::ALL`].
    counts: [usize; EventKind::ALL.len()],
    /// Sum of the known distances of all slips, m.
    slipped: f64,
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
            collector: Collector::new(width, 1),
            events: Vec::new(),
            counts: [0; EventKind::ALL.len()],
            slipped: 0.0,
        }
    }

    /// Adds a sample with its estimate.
    pub fn add(&mut self, sample: &RecordedSample, estimate: &ContactEstimate) {
        self.samples += 1;
        self.collector.add(sample, estimate);
    }

    /// Adds an event.
    pub fn add_event(&mut self, event: &ContactEvent) {
        self.counts[event.kind as usize] += 1;
        // The end of a slip has the same distance, so only the start is counted.
        if event.kind == EventKind::SlipStart {
            self.slipped += event.distance_m.unwrap_or(0.0);
        }
        if self.events.len() < MOST_EVENTS {
            self.events.push(*event);
        }
    }

    /// Returns the covered time on the foot's clock, µs.
    fn on_clock(&self) -> Range<i64> {
        let at = |seconds: f64| self.start_us.saturating_add(micros(seconds));
        at(self.span.start)..at(self.span.end)
    }

    /// Returns the data for the page's script; `axis` is the index of the foot's axis, whose 0 is `origin_us` on the clock.
    fn pack(self, axis: usize, origin_us: i64) -> FootData {
        let counted: usize = self.counts.iter().sum();
        let kinds = EventKind::ALL.map(EventKind::name).into_iter();
        let series = self.collector.finish();
        FootData {
            name: self.name,
            group: axis,
            shift: (self.start_us - origin_us) as f64 / 1.0e6,
            samples: self.samples,
            rate: self.sample_rate,
            from: self.span.start,
            duration: self.span.end - self.span.start,
            left_out: counted - self.events.len(),
            counts: kinds.zip(self.counts).collect(),
            slipped: self.slipped,
            lines: series.lines(&self.load_title).iter().map(LineData::of).collect(),
            tracks: series.tracks(),
            states: packed_intervals(&series.phases, &Phase::ALL),
            decisions: packed_intervals(&series.decisions, &DECISIONS),
            labels: series.labels.as_ref().map(|labels| packed_intervals(labels, &LABELS)),
            events: self.events.iter().map(packed_event).collect(),
        }
    }
}

/// Writes the page of the given feet.
///
/// # Errors
/// Errors of the writer.
pub fn write(feet: Vec<PageFoot>, to: &mut dyn Write) -> io::Result<()> {
    let title = title(&feet);
    // Escape < so that no text in the data can end the enclosing script. In JSON, < occurs only in texts.
    let data = serde_json::to_string(&page_data(&title, feet))?.replace('<', "\\u003c");
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

/// Data for the page's script.
#[derive(Serialize)]
struct PageData<'a> {
    title: &'a str,
    program: &'static str,
    /// Names of states, decisions, labels and kinds of events, by their codes.
    states: [&'static str; Phase::ALL.len()],
    decisions: [&'static str; DECISIONS.len()],
    labels: [&'static str; LABELS.len()],
    events: [&'static str; EventKind::ALL.len()],
    /// Axes.
    groups: Vec<AxisData>,
    feet: Vec<FootData>,
}

/// An axis that feet share.
#[derive(Serialize)]
struct AxisData {
    title: String,
    /// Shown time, s on the axis.
    from: f64,
    to: f64,
}

/// Data of a foot. Lists of times hold differences, µs, the first from 0.
#[derive(Serialize)]
struct FootData {
    name: String,
    /// Index of its axis.
    group: usize,
    /// Time of its first sample on the axis, s.
    shift: f64,
    samples: usize,
    /// Sample rate, Hz.
    rate: f32,
    /// Shown time since its first sample, s.
    from: f64,
    duration: f64,
    /// Number of events that are not in the page.
    left_out: usize,
    /// Number of all events per kind.
    counts: BTreeMap<&'static str, usize>,
    /// Sum of the known distances of all slips, m.
    slipped: f64,
    lines: Vec<LineData>,
    tracks: Vec<&'static str>,
    states: Vec<i64>,
    decisions: Vec<i64>,
    labels: Option<Vec<i64>>,
    events: Vec<EventData>,
}

/// A line over time. A point without a value separates two pieces.
#[derive(Serialize)]
struct LineData {
    kind: &'static str,
    name: String,
    /// Values of the lowest and the highest level.
    low: f64,
    high: f64,
    levels: u16,
    /// Times.
    t: Vec<i64>,
    /// Levels.
    v: Vec<Option<u16>>,
}

/// An event: time, µs, and code of its kind; duration, µs, and distance, m.
type EventData = (u64, usize, Option<u64>, Option<f64>);

/// Returns all data for the page's script.
fn page_data(title: &str, feet: Vec<PageFoot>) -> PageData<'_> {
    let clocks: Vec<_> = feet.iter().map(PageFoot::on_clock).collect();
    let (axes, axis_of) = shared_axes(&clocks);
    // The 0 of an axis is timestamp 0 of its first foot, as in the figure of a foot.
    let origin = |axis| {
        let of_axis = feet.iter().zip(&axis_of).filter(|(_, of)| **of == axis);
        of_axis.map(|(foot, _)| foot.start_us).min().unwrap_or(0)
    };
    let origins: Vec<i64> = (0..axes.len()).map(origin).collect();
    let groups = axes.iter().zip(&origins).map(|(axis, origin)| {
        let seconds = |micros: i64| (micros - origin) as f64 / 1.0e6;
        AxisData { title: time_title(*origin), from: seconds(axis.start), to: seconds(axis.end) }
    });
    let packed = feet.into_iter().zip(axis_of).map(|(foot, axis)| foot.pack(axis, origins[axis]));
    PageData {
        title,
        program: concat!("footfall ", env!("CARGO_PKG_VERSION")),
        states: Phase::ALL.map(Phase::name),
        decisions: DECISION_NAMES,
        labels: LABEL_NAMES,
        events: EventKind::ALL.map(EventKind::name),
        groups: groups.collect(),
        feet: packed.collect(),
    }
}

/// Escapes a text for use between tags.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Returns the axes for feet with these times, and the axis index of each foot. An axis is the time range shown by feet
/// with overlapping times, µs on their clocks; axes are in the order of their first feet.
fn shared_axes(times: &[Range<i64>]) -> (Vec<Range<i64>>, Vec<usize>) {
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by_key(|k| (times[*k].start, *k));
    let mut axes: Vec<(usize, Range<i64>)> = Vec::new();
    let mut of = vec![0; times.len()];
    for foot in order {
        let time = &times[foot];
        match axes.last_mut() {
            Some((first, axis)) if time.start <= axis.end => {
                axis.end = axis.end.max(time.end);
                *first = foot.min(*first);
            }
            _ => axes.push((foot, time.clone())),
        }
        of[foot] = axes.len() - 1;
    }
    let mut places: Vec<usize> = (0..axes.len()).collect();
    places.sort_by_key(|k| axes[*k].0);
    let place = |axis: usize| places.iter().position(|k| *k == axis).unwrap_or(axis);
    let of = of.into_iter().map(place).collect();
    let axes = places.iter().map(|k| axes[*k].1.clone()).collect();
    (axes, of)
}

/// Converts a time to whole µs.
fn micros(seconds: f64) -> i64 {
    // The cast saturates.
    (seconds * 1.0e6).round() as i64
}

/// Encodes times as differences, the first from 0.
#[derive(Default)]
struct Steps(i64);

impl Steps {
    fn to(&mut self, seconds: f64) -> i64 {
        let now = micros(seconds);
        now - std::mem::replace(&mut self.0, now)
    }
}

impl LineData {
    fn of(line: &Line<'_>) -> Self {
        let Line { kind, name, trace, range: Range { start, end } } = line;
        let scale = if end > start { f64::from(LEVELS) / (end - start) } else { 0.0 };
        let mut steps = Steps::default();
        let (mut t, mut v) = (Vec::new(), Vec::new());
        for piece in *trace {
            if !t.is_empty() {
                t.push(0);
                v.push(None);
            }
            for (time, value) in piece {
                t.push(steps.to(*time));
                // The cast saturates.
                v.push(Some(((value - start) * scale).round() as u16));
            }
        }
        Self {
            kind: match kind {
                LineKind::Load => "load",
                LineKind::Tangential => "tangential",
                LineKind::Vertical => "vertical",
                LineKind::Total => "total",
            },
            name: (*name).to_owned(),
            low: *start,
            high: *end,
            levels: LEVELS,
            t,
            v,
        }
    }
}

/// Packs consecutive intervals: for each, the step to its start and the index of its value in `all`; then the
/// step to the end of the last.
fn packed_intervals<T: PartialEq>(intervals: &[(Range<f64>, T)], all: &[T]) -> Vec<i64> {
    let mut steps = Steps::default();
    let mut packed = Vec::new();
    for (time, value) in intervals {
        let code = all.iter().position(|known| known == value).unwrap_or(0);
        packed.extend([steps.to(time.start), code as i64]);
    }
    packed.extend(intervals.last().map(|(time, _)| steps.to(time.end)));
    packed
}

/// Packs an event; its distance in whole µm.
fn packed_event(event: &ContactEvent) -> EventData {
    let distance = event.distance_m.map(|distance| (distance * 1.0e6).round() / 1.0e6);
    (event.time.as_micros(), event.kind as usize, event.duration_us, distance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::estimate_with;
    use estimator_core::{Gravity, ImuSample, Load, Timestamp};

    /// Returns a foot with this many samples at 1 kHz, whose clock starts at `start_us`.
    fn foot(name: &str, start_us: i64, samples: u64) -> PageFoot {
        let about = About {
            samples: samples as usize,
            duration_us: (samples - 1) * 1000,
            load_title: format!("force of {name} (N)"),
            start_us,
            ..About::new(name.to_owned(), 1000.0, Gravity::Included)
        };
        let mut foot = PageFoot::new(name, &about, 0.0..about.duration_s());
        for k in 0..samples {
            let sample = RecordedSample {
                imu: ImuSample {
                    timestamp: Timestamp::from_micros(k * 1000),
                    ..ImuSample::default()
                },
                load: (k % 100 != 50).then_some(Load((k * 7919 % 1000) as f32)),
                label: Some(if k % 2 == 0 { Label::Stable } else { Label::NotStable }),
            };
            let p = (k * 104_729 % 1009) as f32 / 1008.0;
            let estimate = ContactEstimate {
                timestamp: sample.imu.timestamp,
                phase: Phase::ALL[k as usize % Phase::ALL.len()],
                decision: DECISIONS[k as usize % 2],
                ..estimate_with(p)
            };
            foot.add(&sample, &estimate);
        }
        foot
    }

    fn written(feet: Vec<PageFoot>) -> String {
        let mut bytes = Vec::new();
        write(feet, &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    }

    /// The JSON in a page.
    fn data_of(page: &str) -> serde_json::Value {
        let start = page.split_once("id=\"data\">").unwrap().1;
        serde_json::from_str(start.split_once("</script>").unwrap().0).unwrap()
    }

    #[test]
    fn names_cannot_end_the_script_or_open_a_tag() {
        let names =
            ["</script><script>alert(1)</script>", "<!--<script>", "a & b > \"c\" \\ \u{2028}"];
        let page = written(names.map(|name| foot(name, 0, 10)).into());
        let empty = written(vec![foot("a", 0, 10)]);
        for tag in ["<script", "</script", "<!--", "<title", "</title"] {
            assert_eq!(page.matches(tag).count(), empty.matches(tag).count(), "{tag}");
        }
        let data = data_of(&page);
        for (k, name) in names.into_iter().enumerate() {
            assert_eq!(data["feet"][k]["name"], name);
            assert_eq!(data["feet"][k]["lines"][0]["name"], format!("force of {name} (N)"));
        }
    }

    #[test]
    fn page_loads_no_external_resource() {
        let page = written(vec![foot("a", 0, 10)]);
        assert!(page.contains("default-src 'none'"));
        for fetch in [
            " src=",
            " href=",
            "url(",
            "@import",
            "fetch(",
            "XMLHttpRequest",
            "WebSocket",
            "import(",
        ] {
            assert!(!page.contains(fetch), "{fetch}");
        }
        // The only address is uPlot's home, in a comment.
        let addresses: Vec<_> = page.match_indices("://").collect();
        assert_eq!(addresses.len(), 1);
        assert!(page.contains("/*! https://github.com/leeoniya/uPlot (v1.6.32) */"));
        assert!(page.contains("Copyright (c) 2022 Leon Sorokin"));
    }

    #[test]
    fn page_stays_below_4_mb_per_foot() {
        let page = written(vec![foot("busy", 0, 400_000)]);
        assert!(page.len() < 4_000_000, "{} bytes", page.len());
        let line = &data_of(&page)["feet"][0]["lines"][3];
        let points = line["v"].as_array().unwrap();
        assert!(points.len() > 60_000, "{}", points.len());
        let levels = points.iter().filter_map(serde_json::Value::as_i64);
        assert_eq!((levels.clone().min(), levels.max()), (Some(0), Some(10_000)));
    }

    #[test]
    fn line_keeps_values_and_gaps_of_the_recording() {
        let data = data_of(&written(vec![foot("a", 0, 200)]));
        let load = &data["feet"][0]["lines"][0];
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        let (low, high) = (number(&load["low"]), number(&load["high"]));
        let mut time = 0;
        let mut values = Vec::new();
        for (step, level) in load["t"].as_array().unwrap().iter().zip(load["v"].as_array().unwrap())
        {
            time += step.as_i64().unwrap();
            match level.as_f64() {
                Some(level) => {
                    values.push((time, low + level * (high - low) / number(&load["levels"])));
                }
                None => assert!(time % 100_000 == 49_000, "{time}"),
            }
        }
        assert_eq!(values.len(), 198);
        for (time, value) in values {
            let expected = (time / 1000 * 7919 % 1000) as f64;
            assert!((value - expected).abs() < 0.1, "{time}: {value}");
        }
    }

    #[test]
    fn feet_with_overlapping_times_share_an_axis() {
        let day = 86_400_000_000;
        let feet = [("a", day), ("b", 5), ("c", day + 50_000), ("d", 120_000)];
        let data = data_of(&written(feet.map(|(name, start)| foot(name, start, 100)).into()));
        let groups = [0, 1, 2, 3].map(|k| data["feet"][k]["group"].clone());
        assert_eq!(groups, [0, 1, 0, 2]);
        assert_eq!(data["groups"][0]["title"], "time (s) since t = 86400 s");
        assert_eq!(data["groups"][0]["from"], 0.0);
        assert_eq!(data["groups"][0]["to"], 0.149);
        assert_eq!(data["feet"][2]["shift"], 0.05);
        assert_eq!(data["groups"][1]["title"], "time (s) since t = 0.000005 s");
    }

    #[test]
    fn excess_events_are_counted() {
        let mut busy = foot("busy", 0, 100);
        for k in 0..MOST_EVENTS as u64 + 7 {
            let kind = EventKind::ALL[k as usize % 4];
            let is_of_slip = matches!(kind, EventKind::SlipStart | EventKind::SlipEnd);
            busy.add_event(&ContactEvent {
                time: Timestamp::from_micros(k),
                kind,
                duration_us: Some(1),
                peak: 1.0,
                distance_m: is_of_slip.then_some(0.25),
            });
        }
        let foot = &data_of(&written(vec![busy]))["feet"][0];
        assert_eq!(foot["left_out"], 7);
        assert_eq!(foot["events"].as_array().unwrap().len(), MOST_EVENTS);
        assert_eq!(foot["events"][1], serde_json::json!([1, 1, 1, null]));
        assert_eq!(foot["counts"]["touch_down"], 5002);
        assert_eq!(foot["counts"]["slip_start"], 5002);
        assert_eq!(foot["slipped"], 0.25 * 5002.0);
    }
}

//! Compact JSON of lines, intervals and events: times as steps in µs, values as levels.

use std::fmt::{self, Write};
use std::ops::Range;

use recordings::events::ContactEvent;

use crate::plot::decimate::Trace;

/// Levels of a line between its lowest and its highest value: finer than a pixel, as values cannot be zoomed.
const LEVELS: u32 = 10_000;

/// Returns the axes for feet with these times, and the axis index of each foot. An axis is the time range shown by feet
/// with overlapping times, µs on their clocks; axes are in the order of their first feet.
pub(super) fn shared_axes(times: &[Range<i64>]) -> (Vec<Range<i64>>, Vec<usize>) {
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

/// Encodes a text as JSON that cannot end the enclosing script.
pub(super) fn json_string(text: &str) -> String {
    let quoted = serde_json::Value::from(text).to_string();
    quoted.replace('<', "\\u003c")
}

/// Returns names as a JSON list.
pub(super) fn names<const N: usize>(names: [&str; N]) -> String {
    let all: Vec<_> = names.map(json_string).into();
    format!("[{}]", all.join(","))
}

/// Converts a time to whole µs.
pub(super) fn micros(seconds: f64) -> i64 {
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

/// Appends a line. Missing values become a point without value.
pub(super) fn line(
    kind: &str,
    name: &str,
    trace: &Trace,
    range: Range<f64>,
    to: &mut String,
) -> fmt::Result {
    let Range { start, end } = range;
    write!(
        to,
        "{{\"kind\":\"{kind}\",\"name\":{},\"low\":{start},\"high\":{end},\"levels\":{LEVELS},\"t\":[",
        json_string(name)
    )?;
    let mut steps = Steps::default();
    pieces(trace, "0", |(time, _)| steps.to(time), to)?;
    to.push_str("],\"v\":[");
    let scale = if end > start { f64::from(LEVELS) / (end - start) } else { 0.0 };
    let level = |(_, value): (f64, f64)| ((value - start) * scale).round() as i64;
    pieces(trace, "null", level, to)?;
    to.push_str("]}");
    Ok(())
}

/// Appends a number for each point of a line, with `between` its pieces.
fn pieces(
    trace: &Trace,
    between: &str,
    mut number: impl FnMut((f64, f64)) -> i64,
    to: &mut String,
) -> fmt::Result {
    for (k, piece) in trace.iter().enumerate() {
        if k > 0 {
            write!(to, ",{between}")?;
        }
        for (i, point) in piece.iter().enumerate() {
            let comma = if k + i > 0 { "," } else { "" };
            write!(to, "{comma}{}", number(*point))?;
        }
    }
    Ok(())
}

/// Appends consecutive intervals: for each, the step to its start and the index of its value in `all`; then the
/// step to the end of the last.
pub(super) fn stretches<T: PartialEq>(
    stretches: &[(Range<f64>, T)],
    all: &[T],
    to: &mut String,
) -> fmt::Result {
    let mut steps = Steps::default();
    to.push('[');
    for (time, value) in stretches {
        let code = all.iter().position(|known| known == value).unwrap_or(0);
        write!(to, "{},{code},", steps.to(time.start))?;
    }
    if let Some((time, _)) = stretches.last() {
        write!(to, "{}", steps.to(time.end))?;
    }
    to.push(']');
    Ok(())
}

/// Appends events: time and kind, duration and distance.
pub(super) fn events(events: &[ContactEvent], to: &mut String) -> fmt::Result {
    to.push('[');
    for (k, event) in events.iter().enumerate() {
        let comma = if k > 0 { "," } else { "" };
        let (time, kind) = (event.time.as_micros(), event.kind as usize);
        write!(to, "{comma}[{time},{kind},")?;
        match event.duration_us {
            Some(duration) => write!(to, "{duration},")?,
            None => to.push_str("null,"),
        }
        match event.distance_m {
            Some(distance) => write!(to, "{distance:.6}]")?,
            None => to.push_str("null]"),
        }
    }
    to.push(']');
    Ok(())
}

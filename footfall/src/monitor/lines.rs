//! The state of each foot as a line of text or a JSON object, once a second.

use std::io::{self, Write};

use estimator_core::Decision;
use serde::Serialize;

use super::foot::Foot;
use super::robot::{Event, Robot};

/// A foot as it is, for programs.
#[derive(Debug, Serialize)]
struct FootLine<'a> {
    t: f64,
    foot: &'a str,
    line: &'a str,
    node: Option<u8>,
    p_stable: Option<f32>,
    p_tangential: Option<f32>,
    p_vertical: Option<f32>,
    state: Option<&'static str>,
    decision: Option<u8>,
    flags: Vec<&'static str>,
    faults: Vec<&'static str>,
    rate_hz: Option<f32>,
    jitter_ms: Option<f32>,
    missing: u64,
    dropped: u64,
    load_n: Option<f32>,
    roll_deg: Option<f32>,
    pitch_deg: Option<f32>,
    temperature_c: Option<f32>,
    silent: bool,
}

/// An event, for programs.
#[derive(Debug, Serialize)]
struct EventLine<'a> {
    t: f64,
    foot: Option<&'a str>,
    event: &'a str,
}

fn foot_line<'a>(robot: &Robot, foot: &'a Foot) -> FootLine<'a> {
    let row = foot.row.as_ref();
    FootLine {
        t: robot.elapsed_s(),
        foot: &foot.name,
        line: &foot.key.line,
        node: foot.key.node,
        p_stable: row.map(|row| row.stable),
        p_tangential: row.map(|row| row.tangential),
        p_vertical: row.map(|row| row.vertical),
        state: row.map(|row| row.status.phase().name()),
        decision: row.map(|row| u8::from(row.status.decision() == Decision::Stable)),
        flags: row.map(decode::Row::flag_names).unwrap_or_default(),
        faults: foot.faults.iter().map(wire::Fault::name).collect(),
        rate_hz: foot.rate_hz(),
        jitter_ms: foot.jitter_ms(),
        missing: foot.missing,
        dropped: foot.dropped,
        load_n: foot.load,
        roll_deg: foot.tilt.map(|[roll, _]| roll),
        pitch_deg: foot.tilt.map(|[_, pitch]| pitch),
        temperature_c: foot.temperature,
        silent: foot.is_silent(robot.now()),
    }
}

/// Writes each foot as a JSON object.
///
/// # Errors
/// What the writer reports.
pub fn write_json(robot: &Robot, to: &mut dyn Write) -> io::Result<()> {
    for foot in robot.feet() {
        serde_json::to_writer(&mut *to, &foot_line(robot, foot))?;
        writeln!(to)?;
    }
    to.flush()
}

/// Writes an event as a JSON object.
///
/// # Errors
/// What the writer reports.
pub fn write_event_json(event: &Event, to: &mut dyn Write) -> io::Result<()> {
    let line = EventLine {
        t: event.t,
        foot: event.foot.as_deref(),
        event: &event.text,
    };
    serde_json::to_writer(&mut *to, &line)?;
    writeln!(to)
}

/// Writes each foot as a line of text.
///
/// # Errors
/// What the writer reports.
pub fn write_text(robot: &Robot, to: &mut dyn Write) -> io::Result<()> {
    for foot in robot.feet() {
        let line = foot_line(robot, foot);
        write!(to, "{:9.3} s  {:<4}", line.t, line.foot)?;
        match (line.p_stable, line.silent) {
            (_, true) => write!(to, "  silent")?,
            (None, _) => write!(to, "  no contact yet")?,
            (Some(p), _) => write!(
                to,
                "  P {p:.3}  {:<7}  {}",
                line.state.unwrap_or_default(),
                decision_text(line.decision)
            )?,
        }
        if let (Some(rate), Some(jitter)) = (line.rate_hz, line.jitter_ms) {
            write!(to, "  {rate:.0} Hz, jitter {jitter:.1} ms")?;
        }
        write!(to, ", missing {}, dropped {}", line.missing, line.dropped)?;
        if let Some(load) = line.load_n {
            write!(to, ", load {load:.0} N")?;
        }
        for names in [&line.flags, &line.faults] {
            if !names.is_empty() {
                write!(to, ", {}", names.join(", "))?;
            }
        }
        writeln!(to)?;
    }
    to.flush()
}

/// Writes an event as a line of text.
///
/// # Errors
/// What the writer reports.
pub fn write_event(event: &Event, to: &mut dyn Write) -> io::Result<()> {
    let Event { t, foot, text } = event;
    writeln!(
        to,
        "{t:9.3} s  {:<4}  {text}",
        foot.as_deref().unwrap_or("")
    )
}

/// A decision in words.
#[must_use]
pub const fn decision_text(decision: Option<u8>) -> &'static str {
    match decision {
        Some(1) => "stable",
        Some(_) => "not stable",
        None => "",
    }
}

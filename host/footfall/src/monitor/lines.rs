//! State of each foot as a line of text or a JSON object, once a second.

use std::borrow::Cow;
use std::io::{self, Write};

use estimator_core::Decision;
use feet::LiveFoot;
use feet::session::SEVERAL_BOARDS;
use serde::Serialize;

use super::robot::{MonitorEvent, MonitorState};
use crate::json::{Described, Document};

/// A foot as it is, for programs.
#[derive(Debug, Serialize)]
pub struct FootLine<'a> {
    /// Since the first arrival, s.
    t: f64,
    /// The foot's name, such as FL.
    foot: Cow<'a, str>,
    /// The line that it is heard on, such as can0.
    line: &'a str,
    /// Its node id, 1 to 127; null on a serial line where it has not said it.
    node: Option<u8>,
    /// Probability of stable contact, 0 to 1; null before the first contact, and where the foot is silent or
    /// several boards have its id.
    p_stable: Option<f32>,
    /// Probability of no motion along the ground, 0 to 1.
    p_tangential: Option<f32>,
    /// Probability of no lifting and no tilting, 0 to 1.
    p_vertical: Option<f32>,
    /// Phase of the gait: stance, slip, swing, `quiet_swing` or unknown.
    state: Option<&'static str>,
    /// The debounced answer: 1 stable, 0 not.
    decision: Option<u8>,
    /// The estimator's reasons for doubt, by name.
    flags: Vec<&'static str>,
    /// Faults of the board that last, by name.
    faults: Vec<&'static str>,
    /// Contacts in the newest second of the foot's clock, Hz.
    rate_hz: Option<f32>,
    /// By how much the delay from sample to reception varied in that second, ms.
    jitter_ms: Option<f32>,
    /// Contacts that did not arrive, by the foot's clock.
    missing: u64,
    /// Frames that the foot says it could not send.
    dropped: u64,
    /// Last load sent to the foot, N.
    load_n: Option<f32>,
    /// Roll, degrees.
    roll_deg: Option<f32>,
    /// Pitch, degrees.
    pitch_deg: Option<f32>,
    /// Temperature of the sensor, degrees Celsius.
    temperature_c: Option<f32>,
    /// Whether no contact has come for half a second: what else there is, came last.
    silent: bool,
    /// Whether contacts come that one board alone does not send: several have its id. There is no P then.
    several_boards: bool,
}

impl Described for FootLine<'_> {
    const SCHEMA: &'static str = "urn:footfall:monitor:1";
}

fn foot_line<'a>(robot: &MonitorState, foot: &'a LiveFoot) -> FootLine<'a> {
    let now = robot.session().now();
    let silent = foot.is_silent(now);
    let several_boards = foot.second.is_of_several_boards(now);
    // Old contacts and contacts from several boards do not show whether the foot stands.
    let row = foot.row.as_ref().filter(|_| !silent && !several_boards);
    FootLine {
        t: robot.session().elapsed_s(),
        foot: foot.name_or("node "),
        line: &foot.key.line,
        node: foot.key.node,
        p_stable: row.map(|row| row.stable),
        p_tangential: row.map(|row| row.tangential),
        p_vertical: row.map(|row| row.vertical),
        state: row.map(|row| row.status.phase().name()),
        decision: row.map(|row| u8::from(row.status.decision() == Decision::Stable)),
        flags: row.map(feet::decode::ContactRow::flag_names).unwrap_or_default(),
        faults: foot.faults.iter().map(wire::Fault::name).collect(),
        rate_hz: foot.second.rate_hz(),
        jitter_ms: foot.second.jitter_ms(),
        missing: foot.missing,
        dropped: foot.dropped,
        load_n: foot.load,
        roll_deg: foot.tilt_deg().map(|[roll, _]| roll),
        pitch_deg: foot.tilt_deg().map(|[_, pitch]| pitch),
        temperature_c: foot.temperature,
        silent,
        several_boards,
    }
}

/// Writes each foot as a JSON object.
///
/// # Errors
/// Errors of the writer.
pub fn write_json(robot: &MonitorState, to: &mut dyn Write) -> io::Result<()> {
    for foot in robot.feet() {
        serde_json::to_writer(&mut *to, &Document::line(&foot_line(robot, foot)))?;
        writeln!(to)?;
    }
    to.flush()
}

/// Writes an event as a JSON object.
///
/// # Errors
/// Errors of the writer.
pub fn write_event_json(event: &MonitorEvent, to: &mut dyn Write) -> io::Result<()> {
    serde_json::to_writer(&mut *to, &Document::line(event))?;
    writeln!(to)
}

/// Writes each foot as a line of text.
///
/// # Errors
/// Errors of the writer.
pub fn write_text(robot: &MonitorState, to: &mut dyn Write) -> io::Result<()> {
    for foot in robot.feet() {
        let line = foot_line(robot, foot);
        write!(to, "{:9.3} s  {:<4}", line.t, line.foot)?;
        match (line.p_stable, line.silent) {
            _ if line.several_boards => write!(to, "  {SEVERAL_BOARDS}")?,
            (_, true) => write!(to, "  silent")?,
            (None, _) => write!(to, "  no contact yet")?,
            (Some(p), _) => {
                let state = line.state.unwrap_or_default();
                let not = if line.decision == Some(1) { "" } else { "not " };
                write!(to, "  P {p:.3}  {state:<7}  {not}stable")?;
            }
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
/// Errors of the writer.
pub fn write_event(event: &MonitorEvent, to: &mut dyn Write) -> io::Result<()> {
    let MonitorEvent { t, foot, text } = event;
    let foot = foot.as_deref().unwrap_or("");
    writeln!(to, "{t:9.3} s  {foot:<4}  {text}")
}

//! `footfall monitor`: shows the current state of streaming feet, and events.

use std::borrow::Cow;
use std::io::{self, IsTerminal, Write};
use std::mem;
use std::time::Duration;

use anstream::{AutoStream, ColorChoice};
use anstyle::AnsiColor;
use clap::Args;
use estimator_core::Decision;
use feet::decode::live::MessageBody;
use feet::decode::{ContactRow, KnownFeet};
use feet::feed::FeedEvent;
use feet::session::SEVERAL_BOARDS;
use feet::{Feed, LinkError, LiveFoot, Session, Update};
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use wire::{Emergency, Fault, Faults};

use super::options::ListenArguments;
use crate::error::Error;
use crate::files::unless_closed;
use crate::report::{Described, Document};
use crate::stream::{
    SameName, UnheardLines, deadline, due_after, feed_of, is_over, line_event_text, parse_duration,
    unless_ended, warn_of_lost,
};

/// Period of the lines of a foot.
const LINE: Duration = Duration::from_secs(1);

/// Longest time that an event waits to be printed.
const EVENT_DELAY: Duration = Duration::from_millis(50);

/// Arguments of `footfall monitor`.
#[derive(Debug, Args)]
pub struct MonitorArguments {
    /// Feet that stream, and their source.
    #[command(flatten)]
    pub listen: ListenArguments,
    /// Print a JSON object for each foot once a second, and one for each event
    #[arg(long)]
    pub json: bool,
    /// Stop after this time
    #[arg(long, value_name = "SECONDS", value_parser = parse_duration)]
    pub seconds: Option<f64>,
}

impl MonitorArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let (sources, feet) = self.listen.sources_and_feet()?;
        let mut state = MonitorState::new(feet);
        state.unheard = UnheardLines::of(&sources);
        let feed = feed_of(sources.clone());
        let end = deadline(feed.clock(), self.seconds);
        let watched = unless_closed(watch(&feed, &mut state, end, self.json));
        warn_of_lost(&feed);
        watched.map_err(Error::Print)?;
        if let Some(same) = state.session().same_name() {
            return Err(SameName::of(same, &sources).into());
        }
        unless_ended(state.ended)
    }
}

fn watch(
    feed: &Feed,
    state: &mut MonitorState,
    end: Option<Duration>,
    json: bool,
) -> io::Result<()> {
    let clock = feed.clock();
    let mut screen = (!json && io::stdout().is_terminal()).then(Screen::new);
    let mut to = io::stdout().lock();
    loop {
        let due = due_after(clock, LINE, end);
        // Events are printed on arrival.
        while clock.now() < due && !state.has_ended() {
            state.listen(feed, due.min(clock.now() + EVENT_DELAY));
            state.add_unheard(clock.now());
            for event in state.take_events() {
                match &screen {
                    _ if json => write_event_json(&event, &mut to)?,
                    Some(screen) => screen.show_event(&event)?,
                    None => write_event(&event, &mut to)?,
                }
            }
            to.flush()?;
        }
        match &mut screen {
            _ if json => write_json(state, &mut to)?,
            Some(screen) => screen.show(state),
            None => write_text(state, &mut to)?,
        }
        if state.has_ended() || is_over(clock, end) {
            return Ok(());
        }
    }
}

/// Terminal on which each foot has a line that changes in place. Events scroll above.
struct Screen {
    lines: MultiProgress,
    feet: Vec<ProgressBar>,
    has_colour: bool,
}

impl Screen {
    fn new() -> Self {
        Self {
            lines: MultiProgress::with_draw_target(ProgressDrawTarget::stdout()),
            feet: Vec::new(),
            has_colour: AutoStream::choice(&io::stdout()) != ColorChoice::Never,
        }
    }

    /// Shows the lines of all feet.
    fn show(&mut self, state: &MonitorState) {
        for (place, foot) in state.feet().into_iter().enumerate() {
            let line = foot_line(state, foot);
            let text = foot_text(&line);
            let text = if self.has_colour { coloured(&line, &text) } else { text };
            if place == self.feet.len() {
                let style = ProgressStyle::with_template("{msg}");
                let bar = ProgressBar::new_spinner()
                    .with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()));
                self.feet.push(self.lines.add(bar));
            }
            self.feet[place].set_message(text);
            self.feet[place].tick();
        }
    }

    /// Shows an event above the feet.
    fn show_event(&self, event: &MonitorEvent) -> io::Result<()> {
        self.lines.println(event_line(event))
    }
}

impl Drop for Screen {
    /// Leaves the last lines on the terminal.
    fn drop(&mut self) {
        self.feet.iter().for_each(ProgressBar::abandon);
    }
}

/// Colours the text of a foot: green if it is stable, red if it has a fault, yellow if its state is unknown.
fn coloured(line: &FootLine<'_>, text: &str) -> String {
    let colour = if !line.faults.is_empty() || line.several_boards {
        AnsiColor::Red
    } else if line.silent || line.p_stable.is_none() {
        AnsiColor::Yellow
    } else if line.decision == Some(1) {
        AnsiColor::Green
    } else {
        return text.to_owned();
    };
    let style = colour.on_default();
    format!("{style}{text}{style:#}")
}

/// State of all feet on all lines.
#[derive(Default)]
struct MonitorState {
    session: Session,
    /// Reported faults of each foot of the session.
    known: Vec<Faults>,
    /// Events that have not been taken.
    events: Vec<MonitorEvent>,
    /// Lines on which no foot was received so far.
    unheard: UnheardLines,
    /// Reason the source has ended.
    ended: Option<LinkError>,
}

impl MonitorState {
    /// Creates the state before the first arrival.
    fn new(feet: KnownFeet) -> Self {
        Self { session: Session::new(feet), ..Self::default() }
    }

    /// Receives from a feed until `due` on its clock.
    fn listen(&mut self, feed: &Feed, due: Duration) {
        while !self.has_ended() {
            let left = feed.clock().until(due);
            if left.is_zero() {
                return;
            }
            self.session.listen(feed, left);
            self.process_updates();
        }
    }

    /// Processes all updates of the session.
    fn process_updates(&mut self) {
        while let Some(update) = self.session.next_update() {
            match update {
                Update::Message(foot, message) => self.process_message(foot, &message.body),
                Update::Quiet(_) => {}
                Update::Line(FeedEvent::Ended(error)) => {
                    // The normal end of a source is an event. For any other end, the command returns the error.
                    if let LinkError::Ended(_) = error {
                        self.add_event(None, error.to_string());
                    }
                    self.ended = Some(error);
                }
                Update::Line(event) => {
                    self.unheard.remove_waiting(&event);
                    if let Some(text) = line_event_text(&event) {
                        self.add_event(None, text);
                    }
                }
            }
        }
    }

    fn process_message(&mut self, index: usize, body: &MessageBody) {
        let feet = self.session.feet();
        self.known.resize(feet.len(), Faults::NONE);
        let foot = &feet[index];
        let known = mem::replace(&mut self.known[index], foot.faults);
        let name = foot.name_or("node ").into_owned();
        for text in event_texts(body, known) {
            self.add_event(Some(name.clone()), text);
        }
    }

    /// Adds an event for each line on which no foot was received until `now` on the clock of the feed.
    fn add_unheard(&mut self, now: Duration) {
        for text in self.unheard.take_overdue(now, &self.session) {
            self.add_event(None, text);
        }
    }

    fn add_event(&mut self, foot: Option<String>, text: String) {
        let t = self.session.elapsed_s();
        self.events.push(MonitorEvent { t, foot, text });
    }

    /// Returns the state of the feet and of their lines.
    const fn session(&self) -> &Session {
        &self.session
    }

    /// Returns the feet that have sent a message, in order of line and id.
    fn feet(&self) -> Vec<&LiveFoot> {
        let mut feet: Vec<_> = self.session.feet()[..self.known.len()].iter().collect();
        feet.sort_by_key(|foot| &foot.key);
        feet
    }

    /// Takes the events since the last call, newest last.
    fn take_events(&mut self) -> Vec<MonitorEvent> {
        mem::take(&mut self.events)
    }

    /// Returns whether the source has ended.
    fn has_ended(&self) -> bool {
        self.ended.is_some() || self.session.same_name().is_some()
    }
}

/// Returns the texts of the events of a message; `known` are the faults before it.
fn event_texts(body: &MessageBody, known: Faults) -> Vec<String> {
    match body {
        MessageBody::Board(board) => {
            let new = board.faults.iter().filter(|fault| !known.contains(*fault));
            new.map(|fault| fault_text("fault", fault)).collect()
        }
        MessageBody::Emergency(emergency) => vec![emergency_text(*emergency)],
        MessageBody::BootUp(_) => vec!["has started".to_owned()],
        MessageBody::Log(log) => vec![log.text().to_owned()],
        _ => Vec::new(),
    }
}

fn fault_text(what: &str, fault: Fault) -> String {
    format!("{what} 0x{:04X} {}", fault.code(), fault.name())
}

fn emergency_text(emergency: Emergency) -> String {
    let (code, detail) = (emergency.code, emergency.detail);
    match emergency.fault {
        None => format!("fault 0x{code:04X}, which is unknown to this version"),
        Some(fault) if code == 0 => fault_text("cleared:", fault),
        Some(fault) => match Fault::detail(fault) {
            "" => fault_text("fault", fault),
            meaning => format!("{}: {detail} ({meaning})", fault_text("fault", fault)),
        },
    }
}

/// Current state of a foot.
#[derive(Debug, Serialize)]
struct FootLine<'a> {
    /// Since the first arrival, s.
    t: f64,
    /// The foot's name, such as FL.
    foot: Cow<'a, str>,
    /// The line on which it is received, such as can0.
    line: &'a str,
    /// Node id of the foot, 1 to 127; null on a serial line until the foot has sent it.
    node: Option<u8>,
    /// Probability of stable contact, 0 to 1; null before the first contact, if the foot is silent, or if several
    /// boards have its id.
    p_stable: Option<f32>,
    /// Probability of no motion along the ground, 0 to 1.
    p_tangential: Option<f32>,
    /// Probability of no lifting, 0 to 1. With half-widths also of no tilting.
    p_vertical: Option<f32>,
    /// Phase of the gait: stance, slip, swing, `quiet_swing`, landing or unknown.
    state: Option<&'static str>,
    /// The debounced answer: 1 stable, 0 not.
    decision: Option<u8>,
    /// The estimator's reasons for doubt, by name.
    flags: Vec<&'static str>,
    /// Present faults of the board, by name.
    faults: Vec<&'static str>,
    /// Contacts in the newest second of the foot's clock, Hz.
    rate_hz: Option<f32>,
    /// Variation of the delay from sample to reception in that second, ms.
    jitter_ms: Option<f32>,
    /// Contacts that did not arrive, by the foot's clock.
    missing: u64,
    /// Frames that the foot could not send, as reported by it.
    dropped: u64,
    /// Last load sent to the foot, N.
    load_n: Option<f32>,
    /// Roll, degrees.
    roll_deg: Option<f32>,
    /// Pitch, degrees.
    pitch_deg: Option<f32>,
    /// Temperature of the sensor, degrees Celsius.
    temperature_c: Option<f32>,
    /// Whether no contact has arrived for half a second; the other values are then the last ones received.
    silent: bool,
    /// Whether several boards send contacts with this id; there is no probability then.
    several_boards: bool,
}

impl Described for FootLine<'_> {
    const SCHEMA: &'static str = "urn:footfall:monitor:1";
}

/// Event that is printed as text or JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct MonitorEvent {
    /// Since the first arrival, s.
    t: f64,
    /// The foot's name; null if the event belongs to no foot.
    foot: Option<String>,
    /// Event in words.
    #[serde(rename = "event")]
    text: String,
}

impl Described for MonitorEvent {
    const SCHEMA: &'static str = "urn:footfall:monitor-event:1";
}

fn foot_line<'a>(state: &MonitorState, foot: &'a LiveFoot) -> FootLine<'a> {
    let now = state.session().now();
    let silent = foot.is_silent(now);
    let several_boards = foot.second.is_of_several_boards(now);
    // Old contacts and contacts from several boards do not show whether the foot stands.
    let row = foot.row.as_ref().filter(|_| !silent && !several_boards);
    FootLine {
        t: state.session().elapsed_s(),
        foot: foot.name_or("node "),
        line: &foot.key.line,
        node: foot.key.node,
        p_stable: row.map(|row| row.stable),
        p_tangential: row.map(|row| row.tangential),
        p_vertical: row.map(|row| row.vertical),
        state: row.map(|row| row.status.phase().name()),
        decision: row.map(|row| u8::from(row.status.decision() == Decision::Stable)),
        flags: row.map(ContactRow::flag_names).unwrap_or_default(),
        faults: foot.faults.iter().map(Fault::name).collect(),
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
fn write_json(state: &MonitorState, to: &mut dyn Write) -> io::Result<()> {
    for foot in state.feet() {
        serde_json::to_writer(&mut *to, &Document::line(&foot_line(state, foot)))?;
        writeln!(to)?;
    }
    to.flush()
}

/// Writes an event as a JSON object.
fn write_event_json(event: &MonitorEvent, to: &mut dyn Write) -> io::Result<()> {
    serde_json::to_writer(&mut *to, &Document::line(event))?;
    writeln!(to)
}

/// Writes each foot as a line of text.
fn write_text(state: &MonitorState, to: &mut dyn Write) -> io::Result<()> {
    for foot in state.feet() {
        writeln!(to, "{}", foot_text(&foot_line(state, foot)))?;
    }
    to.flush()
}

/// Line of text about a foot.
fn foot_text(line: &FootLine<'_>) -> String {
    let mut text = format!("{:9.3} s  {:<4}", line.t, line.foot);
    if line.several_boards {
        text += &format!("  {SEVERAL_BOARDS}");
    } else if line.silent {
        text += "  silent";
    } else if let Some(p) = line.p_stable {
        let state = line.state.unwrap_or_default();
        let not = if line.decision == Some(1) { "" } else { "not " };
        text += &format!("  P {p:.3}  {state:<7}  {not}stable");
    } else {
        text += "  no contact yet";
    }
    if let (Some(rate), Some(jitter)) = (line.rate_hz, line.jitter_ms) {
        text += &format!("  {rate:.0} Hz, jitter {jitter:.1} ms");
    }
    text += &format!(", missing {}, dropped {}", line.missing, line.dropped);
    if let Some(load) = line.load_n {
        text += &format!(", load {load:.0} N");
    }
    for names in [&line.flags, &line.faults] {
        if !names.is_empty() {
            text += &format!(", {}", names.join(", "));
        }
    }
    text
}

/// Writes an event as a line of text.
fn write_event(event: &MonitorEvent, to: &mut dyn Write) -> io::Result<()> {
    writeln!(to, "{}", event_line(event))
}

fn event_line(MonitorEvent { t, foot, text }: &MonitorEvent) -> String {
    let foot = foot.as_deref().unwrap_or("");
    format!("{t:9.3} s  {foot:<4}  {text}")
}

#[cfg(test)]
mod tests {
    use estimator_core::{ContactEstimate, Timestamp};
    use feet::Arrival;
    use serde_json::Value;
    use wire::CanFrame;
    use wire::pdo::{ClockReading, Contact, Health, ShortTime};
    use wire::uart::{HealthMessage, Message, encode};

    use simulated_robot::Demo;

    use super::*;
    use crate::SourceArgument;

    impl MonitorState {
        fn take(&mut self, fed: FeedEvent) {
            self.session.take(fed);
            self.process_updates();
        }

        fn idle(&mut self, since: Duration) {
            self.session.idle(since);
            self.process_updates();
        }
    }

    #[test]
    fn line_of_a_foot_has_the_colour_of_its_state() {
        let state = watched("demo:seconds=1,speed=max");
        let colour = |change: &dyn Fn(&mut FootLine<'_>)| {
            let mut line = foot_line(&state, state.feet()[0]);
            (line.silent, line.p_stable, line.decision) = (false, Some(0.9), Some(1));
            change(&mut line);
            coloured(&line, "FL")
        };
        assert_eq!(colour(&|_| ()), "\u{1b}[32mFL\u{1b}[0m");
        assert_eq!(colour(&|line| line.silent = true), "\u{1b}[33mFL\u{1b}[0m");
        assert_eq!(colour(&|line| line.faults = vec!["sensor silent"]), "\u{1b}[31mFL\u{1b}[0m");
        assert_eq!(colour(&|line| line.decision = Some(0)), "FL");
    }

    /// Plays a source to its end.
    fn watched(source: &str) -> MonitorState {
        let feed = Feed::open(
            source.parse::<SourceArgument>().expect("a source").find_one().expect("one"),
        );
        let mut state = MonitorState::new(KnownFeet::default());
        while !state.has_ended() {
            state.listen(&feed, feed.clock().now() + Duration::from_secs(600));
        }
        state
    }

    /// Receives a frame from the bus.
    fn receive(state: &mut MonitorState, at_us: u64, id: u16, data: &[u8]) {
        let at = Timestamp::from_micros(at_us);
        let interface = "can0".into();
        let frame = CanFrame::new(id, data).expect("a frame");
        state.take(FeedEvent::Arrived((at, Arrival::Frame { interface, frame })));
    }

    /// Returns the JSON objects of all feet.
    fn lines(state: &MonitorState) -> Vec<Value> {
        let mut json = Vec::new();
        write_json(state, &mut json).expect("memory");
        let lines = json.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
        lines.map(|line| serde_json::from_slice(line).expect("JSON")).collect()
    }

    /// Returns the JSON object of the only foot.
    fn line(state: &MonitorState) -> Value {
        let mut lines = lines(state);
        assert_eq!(lines.len(), 1, "{lines:?}");
        lines.remove(0)
    }

    #[test]
    fn four_feet_at_1_khz_lose_no_contact() {
        let mut state = watched("demo:feet=4,speed=max,seconds=6");
        let lines = lines(&state);
        let names: Vec<_> = lines.iter().map(|line| &line["foot"]).collect();
        assert_eq!(names, ["FL", "FR", "RL", "RR"]);
        for line in &lines {
            assert_eq!((&line["missing"], &line["dropped"]), (&0.into(), &0.into()), "{line}");
            let rate_hz = line["rate_hz"].as_f64().expect("a rate");
            assert!((995.0..1005.0).contains(&rate_hz), "{line}");
            assert!(line["jitter_ms"].as_f64().expect("a jitter") < 1.0, "{line}");
            for name in ["load_n", "roll_deg", "pitch_deg", "temperature_c"] {
                assert!(line[name].is_number(), "{name}: {line}");
            }
            assert!((5.9..6.1).contains(&line["t"].as_f64().expect("a time")), "{line}");
        }
        assert!(state.take_events().iter().any(|event| event.text == "has started"));
    }

    #[test]
    fn foot_without_contacts_is_silent_despite_other_frames() {
        let mut state = watched("demo:speed=max,seconds=2");
        let now = state.session().now();
        assert_eq!(line(&state)["silent"], false);
        // Loads and heartbeats continue to arrive.
        for ms in 0..600 {
            for (id, data) in [(0x211, &[0; 4][..]), (0x711, &[127])] {
                receive(&mut state, now.as_micros() + ms * 1000, id, data);
            }
        }
        let line = line(&state);
        assert_eq!(line["silent"], true);
        assert!(line["p_stable"].is_null(), "{line}");
    }

    #[test]
    fn two_boards_with_one_id_report_no_decision() {
        let feed = Feed::open("feet=2,speed=max,seconds=3".parse::<Demo>().expect("keys"));
        let mut state = MonitorState::new(KnownFeet::default());
        while !state.has_ended() {
            let mut fed = feed.next(Duration::from_secs(600)).expect("it ends");
            if let FeedEvent::Arrived((_, Arrival::Frame { frame, .. })) = &mut fed
                && frame.id() & 0x7F == u16::from(wire::Foot::Right.default_node_id().get())
            {
                let id = frame.id() & !0x7F | u16::from(wire::Foot::Left.default_node_id().get());
                *frame = CanFrame::new(id, frame.data()).expect("a frame");
            }
            state.take(fed);
        }
        let line = line(&state);
        assert_eq!(line["several_boards"], true);
        assert!(line["p_stable"].is_null() && line["decision"].is_null(), "{line}");
    }

    #[test]
    fn single_board_is_not_reported_as_several() {
        for source in ["demo:speed=max,seconds=5", "demo:feet=2,speed=max,seconds=5,line=uart"] {
            for line in lines(&watched(source)) {
                assert_eq!(line["several_boards"], false, "{source}");
            }
        }
    }

    #[test]
    fn foot_is_silent_on_a_silent_line() {
        let mut state = watched("demo:speed=max,seconds=2");
        for (idle_ms, silent) in [(400, false), (600, true)] {
            state.idle(Duration::from_millis(idle_ms));
            assert_eq!(line(&state)["silent"], silent, "{idle_ms} ms");
        }
    }

    #[test]
    fn serial_foot_is_named_by_its_first_health_message() {
        let lines = lines(&watched("demo:feet=2,speed=max,seconds=2,line=uart"));
        let names: Vec<_> = lines.iter().map(|line| &line["foot"]).collect();
        assert_eq!(names, ["L", "R"]);
        assert!(lines.iter().all(|line| line["missing"] == 0), "{lines:?}");
    }

    #[test]
    fn start_and_faults_are_events() {
        let mut state = MonitorState::new(KnownFeet::default());
        let mut receive = |ms: u64, id, data: &[u8]| receive(&mut state, ms * 1000, id, data);
        let raised = Emergency::raised(Fault::WatchdogReset, 3, Faults::NONE).encode();
        let cleared = Emergency::cleared(Fault::WatchdogReset, Faults::NONE).encode();
        receive(0, 0x711, &[0]);
        receive(10, 0x091, &raised);
        receive(500, 0x711, &[5]);
        receive(900, 0x091, &cleared);
        assert_eq!(line(&state)["faults"], serde_json::json!([]));
        let events = state.take_events();
        let [started, raised, cleared] = &events[..] else { panic!("{events:?}") };
        assert_eq!((started.t, started.text.as_str()), (0.0, "has started"));
        assert!(raised.t == 0.01 && raised.text.starts_with("fault 0x"), "{raised:?}");
        assert!(cleared.t == 0.9 && cleared.text.starts_with("cleared: 0x"), "{cleared:?}");
    }

    #[test]
    fn each_new_fault_of_a_serial_foot_is_an_event() {
        let mut state = MonitorState::new(KnownFeet::default());
        let mut texts = |sequence, faults: &[Fault]| {
            let health = Message::Health(HealthMessage {
                timestamp: Timestamp::from_micros(1000),
                stage: wire::Stage::Running,
                state: wire::node::NmtState::Operational,
                id: None,
                faults: faults.iter().fold(Faults::NONE, |faults, fault| faults.with(*fault)),
                unknown_faults: 0,
                temperature: wire::pdo::Quantity::default(),
                counters: wire::Counters::default(),
            });
            let bytes = encode(sequence, &health).as_bytes().to_vec();
            let at = Timestamp::from_micros(1_000_000 * u64::from(sequence));
            state.take(FeedEvent::Arrived((at, Arrival::Bytes { port: "/a".into(), bytes })));
            state.idle(Duration::from_millis(500));
            let texts = state.take_events().into_iter().map(|event| event.text);
            texts.collect::<Vec<_>>()
        };
        let text = |fault| fault_text("fault", fault);
        let (frozen, watchdog) = (Fault::SensorFrozen, Fault::WatchdogReset);
        let mut both = [text(frozen), text(watchdog)];
        both.sort();
        let mut found = texts(1, &[frozen, watchdog]);
        found.sort();
        assert_eq!(found, both);
        assert!(texts(2, &[frozen, watchdog]).is_empty());
        let third = Fault::SensorSelfTest;
        assert_eq!(texts(3, &[frozen, watchdog, third]), [text(third)]);
    }

    #[test]
    fn boot_up_ends_the_faults_of_the_previous_run() {
        let mut state = MonitorState::new(KnownFeet::default());
        let mut receive = |ms: u64, id, data: &[u8]| receive(&mut state, ms * 1000, id, data);
        let frozen = Emergency::raised(Fault::SensorFrozen, 0, Faults::NONE).encode();
        let watchdog = Emergency::raised(Fault::WatchdogReset, 3, Faults::NONE).encode();
        receive(0, 0x091, &frozen);
        // The cause of a restart is sent just before its boot-up message.
        receive(900, 0x091, &watchdog);
        receive(901, 0x711, &[0]);
        assert_eq!(line(&state)["faults"], serde_json::json!([Fault::WatchdogReset.name()]));
    }

    #[test]
    fn health_flags_apply_to_following_contacts() {
        for source in ["demo:speed=max,seconds=3", "demo:speed=max,seconds=3,line=uart"] {
            let line = line(&watched(source));
            assert_eq!(line["flags"], serde_json::json!(["settling"]), "{source}");
        }
    }

    #[test]
    fn missing_contacts_are_counted() {
        let mut state = MonitorState::new(KnownFeet::default());
        for ms in (0..300_u64).filter(|ms| !(100..105).contains(ms) && *ms != 200) {
            let estimate = ContactEstimate {
                timestamp: Timestamp::from_micros(ms * 1000),
                ..ContactEstimate::default()
            };
            let bytes = Contact::new(&estimate, ms as u8, Faults::NONE).encode();
            receive(&mut state, 5_000_000 + ms * 1000, 0x191, &bytes);
        }
        assert_eq!(line(&state)["missing"], 6);
    }

    #[test]
    fn contacts_lost_in_a_stall_are_counted() {
        let mut state = MonitorState::new(KnownFeet::default());
        for ms in (0..6000_u64).filter(|ms| !(2300..5000).contains(ms)) {
            // Edges have 10 % jitter; nothing is read from 2 s to 5 s.
            let made_us = ms * 1000 + ms * 37 % 100;
            let read_us = if ms < 2000 { made_us } else { made_us.max(5_000_000) };
            let contact = Contact {
                timestamp: ShortTime((made_us / 10) as u16),
                sequence: ms as u8,
                ..Contact::default()
            };
            let mut frames = vec![(0x191, contact.encode())];
            if ms % 100 == 50 {
                let clock = ClockReading::to_report(
                    ClockReading::default(),
                    Timestamp::from_micros(made_us),
                );
                let health = Health { clock, ..Health::default() };
                frames.push((0x511, health.encode()));
            }
            for (id, bytes) in frames {
                receive(&mut state, 7_000_300 + read_us, id, &bytes);
            }
        }
        assert_eq!(line(&state)["missing"], 2700);
    }
}

//! Current state of all feet, and events.

use std::collections::VecDeque;
use std::path::Path;
use std::time::{Duration, Instant};

use decode::Feet;
use decode::live::{FootKey, Heard, Listener, Said};
use estimator_core::Timestamp;
use live::feed::Fed;
use live::{Arrival, LinkError};
use wire::pdo::TEMPERATURE_STEP;
use wire::{Counter, Emergency, Fault};

use super::foot::Foot;
use super::recorder::Recorder;
use crate::error::Error;

/// Maximum number of events kept.
const EVENTS: usize = 1000;

/// An event.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Time since the first arrival, s.
    pub t: f64,
    /// Foot to which the event belongs, if any.
    pub foot: Option<String>,
    /// Text of the event.
    pub text: String,
}

/// State of all feet on all lines.
pub struct Robot {
    listener: Listener,
    feet: Vec<Foot>,
    events: VecDeque<Event>,
    /// Number of events dropped from the front, so that readers can keep their position.
    forgotten: usize,
    first: Option<Timestamp>,
    now: Timestamp,
    /// Time of the newest arrival, on the clock that stamped it and on this machine's.
    newest: Timestamp,
    arrived: Instant,
    /// Resource the line is waiting for.
    waits_for: Option<String>,
    /// Reason the source has ended.
    ended: Option<LinkError>,
    /// Number of lines and fragments that could not be read.
    unreadable: u64,
    marks: u32,
    recorder: Option<Recorder>,
}

impl Robot {
    /// Creates the state before the first arrival.
    #[must_use]
    pub fn new(feet: Feet) -> Self {
        Self {
            listener: Listener::new(feet),
            feet: Vec::new(),
            events: VecDeque::new(),
            forgotten: 0,
            first: None,
            now: Timestamp::default(),
            newest: Timestamp::default(),
            arrived: Instant::now(),
            waits_for: None,
            ended: None,
            unreadable: 0,
            marks: 0,
            recorder: None,
        }
    }

    /// Processes an item from a feed.
    pub fn take(&mut self, fed: Fed) {
        match fed {
            Fed::Arrived((at, arrival)) => self.arrive(at, arrival),
            Fed::Remark(text) => self.say(None, text),
            Fed::Opened => {
                if self.waits_for.take().is_some() {
                    self.say(None, "the line is open again".to_owned());
                }
            }
            Fed::WaitsFor(error) => {
                self.say(None, format!("{error}; waiting for it"));
                self.waits_for = Some(error.to_string());
            }
            Fed::NotSent(error) => self.say(None, format!("not sent: {error}")),
            Fed::Ended(error) => {
                self.listener.finish();
                self.take_heard();
                self.say(None, error.to_string());
                self.ended = Some(error);
            }
        }
    }

    fn arrive(&mut self, at: Timestamp, arrival: Arrival) {
        self.first.get_or_insert(at);
        self.now = at;
        self.newest = at;
        self.arrived = Instant::now();
        if arrival.hand_to(&mut self.listener, at).is_some() {
            self.unreadable += 1;
        }
        self.take_heard();
    }

    /// Returns the time since the last arrival.
    #[must_use]
    pub fn quiet_for(&self) -> Duration {
        self.arrived.elapsed()
    }

    /// Advances the time to `since` after the newest arrival, if nothing else has arrived.
    pub fn idle(&mut self, since: Duration) {
        let now_us = self.newest.as_micros() + since.as_micros() as u64;
        let now = Timestamp::from_micros(now_us);
        if self.first.is_some() && now > self.now {
            self.now = now;
            self.listener.idle(now);
            self.take_heard();
            let recorded = self.recorder.as_mut().map(|recorder| recorder.idle(now));
            self.end_recording_that_fails(recorded.unwrap_or(Ok(())));
        }
    }

    fn take_heard(&mut self) {
        while let Some(heard) = self.listener.next_heard() {
            self.record(&heard);
            self.hear(heard);
        }
    }

    fn hear(&mut self, Heard { at, foot, said }: Heard) {
        let index = self.index(&foot, &said);
        let Some(foot) = self.feet.get_mut(index) else {
            return;
        };
        let mut event = None;
        match said {
            Said::Contact(row) => {
                foot.heard = at;
                foot.contact(*row, at);
            }
            Said::Health(health) => {
                foot.count_drops(health.dropped);
                foot.flags = Some(health.flags);
            }
            Said::Board(board) => {
                foot.state = Some(board.state);
                foot.stage = Some(board.stage.name());
                for fault in board.faults.iter().filter(|f| !foot.faults.contains(*f)) {
                    event = Some(format!("fault 0x{:04X} {}", fault.code(), fault.name()));
                }
                foot.faults = board.faults;
                let celsius = board.temperature.value(TEMPERATURE_STEP);
                foot.temperature = celsius.is_finite().then_some(celsius);
                let dropped = [Counter::CanDropped, Counter::UartDropped];
                let dropped = dropped.map(|counter| board.counters.get(counter));
                foot.dropped = dropped.map(u64::from).iter().sum();
            }
            Said::Emergency(emergency) => event = emergency_text(foot, emergency, at),
            Said::BootUp(faults) => {
                foot.boot_up(at, faults);
                event = Some("has started".to_owned());
            }
            Said::Heartbeat(state) => foot.state = Some(state),
            Said::Log(log) => event = Some(log.text().to_owned()),
            Said::Load(newtons) => foot.load = Some(newtons),
            Said::Raw(_) | Said::Answer(_) | Said::Sdo(_) => {}
        }
        if let Some(text) = event {
            let name = foot.name.to_string();
            self.now = at;
            self.say(Some(name), text);
        }
    }

    /// Returns the index of a foot, adding it on first reception. A foot on a serial line is received before its id
    /// is known.
    fn index(&mut self, key: &FootKey, said: &Said) -> usize {
        let name = match (self.listener.name(key), said) {
            (Some(name), _) => Some(name),
            (None, Said::Contact(row)) => row.foot.clone(),
            (None, _) => None,
        };
        let named = || -> std::sync::Arc<str> {
            match (&name, key.node) {
                (Some(name), _) => name.clone(),
                (None, Some(node)) => format!("node {node}").into(),
                (None, None) => key.line.clone(),
            }
        };
        let is_same = |foot: &Foot| {
            foot.key.line == key.line
                && match (foot.key.node, key.node) {
                    (Some(known), Some(node)) => known == node,
                    // Several feet of a recording share one line.
                    (None, None) => name.as_ref().is_none_or(|name| *name == foot.name),
                    (known, _) => known.is_none(),
                }
        };
        if let Some(index) = self.feet.iter().position(is_same) {
            if let Some(foot) = self.feet.get_mut(index)
                && foot.key.node.is_none()
                && key.node.is_some()
            {
                foot.key = key.clone();
                foot.name = named();
            }
            return index;
        }
        let place = self.feet.partition_point(|foot| foot.key < *key);
        self.feet.insert(place, Foot::new(key.clone(), named()));
        place
    }

    fn say(&mut self, foot: Option<String>, text: String) {
        if self.events.len() == EVENTS {
            self.events.pop_front();
            self.forgotten += 1;
        }
        let t = self.elapsed_s();
        self.events.push_back(Event { t, foot, text });
    }

    /// Starts a recording in the current directory, or stops the current one, and reports the result as an event.
    pub fn toggle_recording(&mut self) {
        if self.recorder.is_some() {
            self.finish_recording();
            return;
        }
        let event = match Recorder::begin() {
            Ok(recorder) => {
                let event = format!("recording to {}", recorder.path().display());
                self.recorder = Some(recorder);
                event
            }
            Err(error) => error.to_string(),
        };
        self.say(None, event);
    }

    /// Stops the recording, if any, and returns the text of its event.
    pub fn finish_recording(&mut self) -> Option<String> {
        // A contact may still be waiting for related messages.
        self.listener.finish();
        self.take_heard();
        let recorder = self.recorder.take()?;
        let path = recorder.path().display().to_string();
        let event = match recorder.finish() {
            Ok(()) => format!("wrote {path}"),
            Err(error) => error.to_string(),
        };
        self.say(None, event.clone());
        Some(event)
    }

    /// Returns the path of the current recording.
    #[must_use]
    pub fn recording_to(&self) -> Option<&Path> {
        self.recorder.as_ref().map(Recorder::path)
    }

    /// Records a received message if a recording is in progress. On a write error the recording stops.
    fn record(&mut self, heard: &Heard) {
        let Some(recorder) = &mut self.recorder else {
            return;
        };
        let name = self.listener.name(&heard.foot);
        let recorded = recorder.record(heard, name.as_deref());
        self.end_recording_that_fails(recorded);
    }

    fn end_recording_that_fails(&mut self, recorded: Result<(), Error>) {
        if let Err(error) = recorded {
            self.recorder = None;
            self.say(None, format!("recording ended: {error}"));
        }
    }

    /// Marks the current time; marks are numbered from 1.
    pub fn mark(&mut self) {
        self.marks += 1;
        self.say(None, format!("mark {}", self.marks));
    }

    /// Returns the time from the first to the newest arrival, s.
    #[must_use]
    pub fn elapsed_s(&self) -> f64 {
        let first = self.first.unwrap_or(self.now);
        self.now.as_micros().saturating_sub(first.as_micros()) as f64 / 1.0e6
    }

    /// Returns the time of the newest arrival.
    #[must_use]
    pub const fn now(&self) -> Timestamp {
        self.now
    }

    /// Returns the feet, by line and id.
    #[must_use]
    pub fn feet(&self) -> &[Foot] {
        &self.feet
    }

    /// Returns the events, newest last.
    #[must_use]
    pub const fn events(&self) -> &VecDeque<Event> {
        &self.events
    }

    /// Returns the events after the first `seen`, and the total number of events so far.
    pub fn events_since(&self, seen: usize) -> (impl Iterator<Item = &Event>, usize) {
        let skipped = seen.saturating_sub(self.forgotten);
        (
            self.events.iter().skip(skipped),
            self.forgotten + self.events.len(),
        )
    }

    /// Returns the resource the line is waiting for if it is not open.
    #[must_use]
    pub fn waits_for(&self) -> Option<&str> {
        self.waits_for.as_deref()
    }

    /// Returns whether the source has ended.
    #[must_use]
    pub const fn has_ended(&self) -> bool {
        self.ended.is_some()
    }

    /// Returns the error that prevented playback or ended it early.
    #[must_use]
    pub fn into_failure(self) -> Option<LinkError> {
        self.ended
            .filter(|error| !matches!(error, LinkError::Ended(_)))
    }

    /// Returns the number of unreadable lines and fragments in playback, from adapters and on serial lines.
    #[must_use]
    pub fn unreadable(&self) -> u64 {
        let reports = self.listener.reports();
        let problems = reports.iter().filter(|(line, _)| line.is_some());
        let problems = problems.flat_map(|(_, report)| report.problems.values());
        self.unreadable + problems.sum::<u64>()
    }
}

/// Processes an emergency message and returns its text.
fn emergency_text(foot: &mut Foot, emergency: Emergency, at: Timestamp) -> Option<String> {
    let Emergency {
        code,
        fault,
        detail,
        ..
    } = emergency;
    let Some(fault) = fault else {
        return Some(format!("fault 0x{code:04X}, which is not known here"));
    };
    let text = |what: &str| format!("{what} 0x{:04X} {}", fault.code(), fault.name());
    if code == 0 {
        foot.faults = foot.faults.without(fault);
        return Some(text("cleared:"));
    }
    foot.raise(fault, at);
    Some(match Fault::detail(fault) {
        "" => text("fault"),
        meaning => format!("{}: {detail} ({meaning})", text("fault")),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use live::Feed;
    use wire::{CanFrame, Faults};

    fn watched(source: &str) -> Robot {
        let feed = Feed::open(source.parse().expect("a source"));
        let mut robot = Robot::new(Feet::default());
        while !robot.has_ended() {
            robot.take(feed.next(Duration::from_secs(10)).expect("it ends"));
        }
        robot
    }

    #[test]
    fn four_feet_at_1_khz_lose_no_contact() {
        let robot = watched("demo:feet=4,speed=max,seconds=6");
        let names: Vec<_> = robot.feet().iter().map(|foot| &*foot.name).collect();
        assert_eq!(names, ["FL", "FR", "RL", "RR"]);
        for foot in robot.feet() {
            assert_eq!((foot.missing, foot.dropped), (0, 0), "{}", foot.name);
            let rate = foot.second().rate_hz().expect("a rate");
            assert!((995.0..1005.0).contains(&rate), "{rate}");
            assert!(foot.second().jitter_ms().expect("a jitter") < 1.0);
            assert!(foot.load.is_some() && foot.tilt.is_some() && foot.temperature.is_some());
            assert_eq!(foot.state, Some(wire::node::State::Operational));
            assert_eq!(foot.curve(80).len(), 80);
        }
        assert!((5.9..6.1).contains(&robot.elapsed_s()));
        assert!(
            robot
                .events()
                .iter()
                .any(|event| event.text == "has started")
        );
    }

    #[test]
    fn foot_without_contacts_is_silent_despite_other_frames() {
        let mut robot = watched("demo:speed=max,seconds=2");
        let now = robot.now();
        assert!(!robot.feet()[0].is_silent(now));
        // Loads and heartbeats continue to arrive.
        for ms in 0..600 {
            let at = Timestamp::from_micros(now.as_micros() + ms * 1000);
            for (id, data) in [(0x211, &[0; 4][..]), (0x711, &[127])] {
                let frame = CanFrame::new(id, data).expect("a frame");
                let interface = "can0".into();
                robot.take(Fed::Arrived((at, Arrival::Frame { interface, frame })));
            }
        }
        assert!(robot.feet()[0].is_silent(robot.now()));
    }

    #[test]
    fn two_boards_with_one_id_report_no_decision() {
        let feed = Feed::open("demo:feet=2,speed=max,seconds=3".parse().expect("a source"));
        let mut robot = Robot::new(Feet::default());
        while !robot.has_ended() {
            let mut fed = feed.next(Duration::from_secs(5)).expect("it ends");
            if let Fed::Arrived((_, Arrival::Frame { frame, .. })) = &mut fed
                && frame.id() & 0x7F == u16::from(wire::Foot::Right.default_node_id().get())
            {
                let id = frame.id() & !0x7F | u16::from(wire::Foot::Left.default_node_id().get());
                *frame = CanFrame::new(id, frame.data()).expect("a frame");
            }
            robot.take(fed);
        }
        assert_eq!(robot.feet().len(), 1);
        assert!(robot.feet()[0].second().is_of_several_boards(robot.now()));
        let mut json = Vec::new();
        crate::monitor::lines::write_json(&robot, &mut json).expect("memory");
        let line: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
        assert_eq!(line["several_boards"], true);
        assert!(line["p_stable"].is_null() && line["decision"].is_null());
    }

    #[test]
    fn single_board_is_not_reported_as_several() {
        for source in [
            "demo:speed=max,seconds=5",
            "demo:feet=2,speed=max,seconds=5,line=uart",
        ] {
            let robot = watched(source);
            for foot in robot.feet() {
                assert!(!foot.second().is_of_several_boards(robot.now()), "{source}");
            }
        }
    }

    #[test]
    fn foot_is_silent_on_a_silent_line() {
        let mut robot = watched("demo:speed=max,seconds=2");
        robot.idle(Duration::from_millis(400));
        assert!(!robot.feet()[0].is_silent(robot.now()));
        robot.idle(Duration::from_millis(600));
        assert!(robot.feet()[0].is_silent(robot.now()));
    }

    #[test]
    fn serial_foot_is_named_by_its_first_health_message() {
        let robot = watched("demo:feet=2,speed=max,seconds=2,line=uart");
        let names: Vec<_> = robot.feet().iter().map(|foot| &*foot.name).collect();
        assert_eq!(names, ["L", "R"]);
        assert!(robot.feet().iter().all(|foot| foot.missing == 0));
    }

    /// Receives a frame from the bus.
    fn receive(robot: &mut Robot, ms: u64, id: u16, data: &[u8]) {
        let at = Timestamp::from_micros(ms * 1000);
        let interface = "can0".into();
        let frame = CanFrame::new(id, data).expect("a frame");
        robot.take(Fed::Arrived((at, Arrival::Frame { interface, frame })));
    }

    #[test]
    fn faults_are_tracked_and_explain_a_restart() {
        let mut robot = Robot::new(Feet::default());
        let mut receive = |ms, id, data: &[u8]| receive(&mut robot, ms, id, data);
        let raised = Emergency::raised(Fault::WatchdogReset, 3, Faults::NONE).encode();
        let cleared = Emergency::cleared(Fault::WatchdogReset, Faults::NONE).encode();
        receive(0, 0x711, &[0]);
        receive(10, 0x091, &raised);
        receive(500, 0x711, &[5]);
        receive(900, 0x091, &cleared);
        let reason = |robot: &Robot| robot.feet()[0].started.and_then(|(_, reason)| reason);
        assert_eq!(reason(&robot), Some(Fault::WatchdogReset));
        assert_eq!(robot.feet()[0].faults, Faults::NONE);
        let texts: Vec<_> = robot
            .events()
            .iter()
            .map(|e| (e.t, e.text.as_str()))
            .collect();
        assert_eq!(texts[0], (0.0, "has started"));
        assert!(texts[1].1.starts_with("fault 0x"), "{texts:?}");
        assert!(
            texts[2].1.starts_with("cleared: 0x") && texts[2].0 == 0.9,
            "{texts:?}"
        );
    }

    #[test]
    fn fault_just_before_boot_up_belongs_to_the_new_start() {
        let mut robot = Robot::new(Feet::default());
        let mut receive = |ms, id, data: &[u8]| receive(&mut robot, ms, id, data);
        let frozen = Emergency::raised(Fault::SensorFrozen, 0, Faults::NONE).encode();
        let watchdog = Emergency::raised(Fault::WatchdogReset, 3, Faults::NONE).encode();
        receive(0, 0x091, &frozen);
        receive(900, 0x091, &watchdog);
        receive(901, 0x711, &[0]);
        let foot = &robot.feet()[0];
        assert_eq!(
            foot.started.and_then(|(_, reason)| reason),
            Some(Fault::WatchdogReset)
        );
        assert_eq!(foot.faults, Faults::NONE.with(Fault::WatchdogReset));
    }

    #[test]
    fn health_flags_apply_to_following_contacts() {
        for source in [
            "demo:speed=max,seconds=3",
            "demo:speed=max,seconds=3,line=uart",
        ] {
            let robot = watched(source);
            let row = robot.feet()[0].row.as_ref().expect("a contact");
            assert_eq!(row.flag_names(), ["settling"], "{source}");
        }
    }

    #[test]
    fn missing_contacts_are_counted() {
        use estimator_core::ContactEstimate;
        use wire::pdo::Contact;
        let mut robot = Robot::new(Feet::default());
        for ms in (0..300_u64).filter(|ms| !(100..105).contains(ms) && *ms != 200) {
            let estimate = ContactEstimate {
                timestamp: Timestamp::from_micros(ms * 1000),
                ..ContactEstimate::default()
            };
            let bytes = Contact::new(&estimate, ms as u8, Faults::NONE).encode();
            let frame = CanFrame::new(0x191, &bytes).expect("a frame");
            let at = Timestamp::from_micros(5_000_000 + ms * 1000);
            let interface = "can0".into();
            robot.take(Fed::Arrived((at, Arrival::Frame { interface, frame })));
        }
        assert_eq!(robot.feet()[0].missing, 6);
    }

    #[test]
    fn contacts_lost_in_a_stall_are_counted_within_1_percent() {
        use wire::pdo::{Contact, ShortTime};
        let mut robot = Robot::new(Feet::default());
        for ms in (0..6000_u64).filter(|ms| !(2300..5000).contains(ms)) {
            // Edges have 10 % jitter; nothing is read from 2 s to 5 s.
            let made_us = ms * 1000 + ms * 37 % 100;
            let read_us = if ms < 2000 {
                made_us
            } else {
                made_us.max(5_000_000)
            };
            let contact = Contact {
                timestamp: ShortTime((made_us / 10) as u16),
                sequence: ms as u8,
                ..Contact::default()
            };
            let frame = CanFrame::new(0x191, &contact.encode()).expect("a frame");
            let at = Timestamp::from_micros(7_000_300 + read_us);
            let interface = "can0".into();
            robot.take(Fed::Arrived((at, Arrival::Frame { interface, frame })));
        }
        let missing = robot.feet()[0].missing;
        assert!(missing.abs_diff(2700) <= 27, "{missing}");
    }
}

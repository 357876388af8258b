//! Requests to a foot over CAN and over its serial line, answered by the board's own program.

use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::time::Duration;

use estimator_core::Axis;
use feet::foot::self_test::{self, SelfTestResult};
use feet::foot::settings::{self, Lasting, SettingsError, Undone};
use feet::foot::{Client, Named, RequestError};
use feet::link::{Arrived, LineClock};
use feet::{Arrival, FootHint, Link, LinkError, Sending};
use simulated_robot::{Demo, DemoLine, Robot, SimulatedFeet};
use wire::dictionary::index;
use wire::node::{NmtCommand, NmtState};
use wire::uart::{Decoder, Message, NmtRequest, encode};
use wire::{AbortCode, Address, CanFrame, DataType, Foot, NodeId, Value};

const LINES: [&str; 2] = ["can", "uart"];

/// Simulated feet on whose clock timeouts are measured.
fn demo(keys: &str) -> Box<dyn Link> {
    Box::new(SimulatedFeet::in_steps(&keys.parse::<Demo>().expect("keys")))
}

fn client(line: &str) -> Client {
    let link = demo(&format!("feet=1,line={line}"));
    Client::new(link, None).expect("one foot")
}

/// Writes settings as texts, and returns the changes.
fn write(
    client: &mut Client,
    texts: &[(&str, &str)],
    lasting: Lasting,
) -> Result<Vec<(Named, Value, Value)>, SettingsError> {
    let node = client.node();
    let value = |(name, text): &(&str, &str)| {
        let named = Named::find(name).expect("a name");
        (named.address, named.parse(text, node).expect("a value"))
    };
    settings::write(client, &texts.iter().map(value).collect(), lasting)
}

fn get(client: &mut Client, name: &str) -> String {
    let named = Named::find(name).expect("a name");
    let value = client.read(named.address, named.entry.data_type());
    named.text(value.unwrap_or_else(|error| panic!("{error}")))
}

#[test]
fn new_foot_has_default_settings() {
    for line in LINES {
        let mut client = client(line);
        let name = client.read_text(Address::new(index::DEVICE_NAME, 0));
        assert!(name.expect("a long text").contains("footfall"), "{line}");
        let own = settings::read(&mut client).expect("answers");
        assert_eq!(own.len(), Named::settings().count());
        let defaults = settings::defaults(client.node());
        let differ = settings::differences(&defaults, &own);
        let names: Vec<_> = differ.iter().map(|(named, ..)| named.name()).collect();
        // The demo enables the load over CAN, and samples over the serial line.
        let expected = ["uart_streams.raw_sample", "load_input.source"];
        let expected = &expected[usize::from(line == "can")..];
        assert_eq!(names, expected, "{line}");
    }
}

/// Line that several clients may share.
type Shared = Rc<RefCell<Box<dyn Link>>>;

/// Function that returns the data to send instead, if any.
type Sent = Box<dyn FnMut(&Sending) -> Option<Sending>>;

/// Line on which data is lost, changed or repeated.
struct Changed {
    link: Shared,
    sent: Sent,
    /// Returns how often data arrives, at most twice.
    times: Box<dyn Fn() -> usize>,
    again: Option<Arrived>,
}

impl Changed {
    fn new(
        link: &Shared,
        sent: impl FnMut(&Sending) -> Option<Sending> + 'static,
        times: impl Fn() -> usize + 'static,
    ) -> Box<Self> {
        Box::new(Self {
            link: link.clone(),
            sent: Box::new(sent),
            times: Box::new(times),
            again: None,
        })
    }
}

impl Link for Changed {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        if let Some(again) = self.again.take() {
            return Ok(Some(again));
        }
        let arrived = self.link.borrow_mut().receive(longest)?;
        let times = (self.times)();
        self.again = arrived.clone().filter(|_| times > 1);
        Ok(arrived.filter(|_| times > 0))
    }

    fn send(&mut self, sending: &Sending) -> Result<(), LinkError> {
        match (self.sent)(sending) {
            Some(sending) => self.link.borrow_mut().send(&sending),
            None => Ok(()),
        }
    }

    fn clock(&self) -> LineClock {
        self.link.borrow().clock()
    }
}

fn shared(keys: &str) -> Shared {
    Rc::new(RefCell::new(demo(keys)))
}

#[test]
fn order_dependent_settings_are_accepted_in_any_order() {
    let mut client = client("can");
    // 90 and 80 exceed the foot's upper threshold, so the lower one is accepted only after the upper one.
    for [on, off] in [["90", "80"], ["12", "6"]] {
        let wanted = [("load.on_threshold", on), ("load.off_threshold", off)];
        write(&mut client, &wanted, Lasting::UntilReset).expect("taken");
        assert_eq!(get(&mut client, "load.on_threshold"), on);
        assert_eq!(get(&mut client, "load.off_threshold"), off);
        let again = write(&mut client, &wanted, Lasting::UntilReset);
        assert!(again.expect("taken").is_empty());
    }
}

#[test]
fn incompatible_settings_change_nothing() {
    for line in LINES {
        let mut client = client(line);
        let before = settings::read(&mut client).expect("answers");
        let wanted = [
            ("decision.threshold", "0.75"),
            ("load.on_threshold", "5"),
            ("load.off_threshold", "50"),
        ];
        match write(&mut client, &wanted, Lasting::UntilReset) {
            Err(SettingsError::Incompatible(_)) => {}
            other => panic!("{line}: {other:?}"),
        }
        let after = settings::read(&mut client).expect("answers");
        assert!(settings::differences(&before, &after).is_empty(), "{line}");
        assert_eq!(client.state().expect("a state"), NmtState::Operational, "{line}");
    }
}

#[test]
fn refused_value_error_states_the_reason() {
    for line in LINES {
        let mut client = client(line);
        let window = Named::find("window").expect("a name");
        // The foot is operational without a pause, and refuses settings.
        let error = client.write(window.address, window.entry.default).expect_err("refused");
        let RequestError::Refused { reason, .. } = &error else {
            panic!("{line}: {error}");
        };
        assert_eq!(*reason, AbortCode::DeviceState);
        let text = error.to_string();
        assert!(text.starts_with("writing window (0x2010:0) was refused: "), "{text}");
        assert!(text.contains("pre-operational state first"), "{text}");
        let unknown = client.read(Address::new(0x2FFF, 0), DataType::Unsigned8);
        assert!(unknown.expect_err("there is none").to_string().contains("no such object"));
    }
}

#[test]
fn several_feet_require_a_node_id() {
    let open = || demo("feet=4");
    let error = Client::new(open(), None).err().expect("which one?");
    assert_eq!(error.to_string(), "there are several feet, 17, 18, 19, 20");
    assert_eq!(error.hint(), Some(FootHint::NameOneFoot));
    let mut second = Client::new(open(), NodeId::new(18)).expect("a foot");
    assert_eq!(get(&mut second, "foot"), "2");
    let mut absent = Client::new(open(), NodeId::new(99)).expect("a line");
    let error = absent.read(Address::new(index::FOOT, 0), DataType::Unsigned8);
    assert!(
        error
            .expect_err("no foot")
            .to_string()
            .starts_with("node 99 does not answer: reading foot")
    );
}

#[test]
fn foot_lost_during_a_write_is_reported_with_what_is_undone() {
    // All settings are read, the id is checked to be unique, the foot is paused, and settings are written. The last
    // one is read back. Then all are stored.
    for (more, names, lasting, expected) in [
        (3, 3, Lasting::UntilReset, Undone::NotStored),
        (4, 3, Lasting::UntilReset, Undone::NotStored),
        (5, 1, Lasting::Stored, Undone::Unknown),
    ] {
        // Number of frames after which the line breaks.
        let left = Rc::new(Cell::new(Named::settings().count() + more));
        let (sent_left, received_left) = (left.clone(), left);
        let sent = move |sending: &Sending| {
            let left = sent_left.get().checked_sub(1)?;
            sent_left.set(left);
            Some(sending.clone())
        };
        let link = Changed::new(&shared("feet=1"), sent, move || received_left.get().min(1));
        let mut client = Client::new(link, NodeId::new(17)).expect("a foot");
        let half_widths =
            ["ax", "ay", "az"].map(|axis| format!("half_width.acceleration_m_s2.{axis}"));
        let wanted: Vec<_> =
            half_widths[..names].iter().map(|name| (name.as_str(), "0.5")).collect();
        let error = write(&mut client, &wanted, lasting).expect_err("it vanished");
        let SettingsError::NotTaken { undone, .. } = &error else {
            panic!("{error}");
        };
        assert_eq!(*undone, expected, "{error}");
        assert!(error.to_string().contains("node 17 does not answer"), "{error}");
    }
}

#[test]
fn id_of_another_board_is_rejected_by_all_commands() {
    let link = demo("feet=4");
    let mut client = Client::new(link, NodeId::new(0x12)).expect("a foot");
    let error = settings::restore(&mut client).expect_err("the front left one is there");
    assert_eq!(error.to_string(), "node 18 would become node 17, which is already on the bus");
    for setting in [("node_id", "19"), ("foot", "3")] {
        let before = get(&mut client, setting.0);
        let error = write(&mut client, &[setting], Lasting::Stored).expect_err("taken");
        assert_eq!(
            error.to_string(),
            "node 18 would become node 19, which is already on the bus; all settings are as they were"
        );
        assert_eq!(get(&mut client, setting.0), before);
    }
    assert_eq!(client.state().expect("a state"), NmtState::Operational);
}

/// Reset command for the kind of line of `sending`.
fn reset_like(sending: &Sending) -> Sending {
    match sending {
        Sending::Frame(_) => {
            let frame = CanFrame::new(0, &[NmtCommand::ResetNode as u8, 17]);
            Sending::Frame(frame.expect("a frame"))
        }
        Sending::Bytes { port, .. } => Sending::Bytes {
            port: port.clone(),
            bytes: encode(0, &Message::Nmt(NmtRequest(NmtCommand::ResetNode))).as_bytes().to_vec(),
        },
    }
}

/// Returns whether this is a reset command.
fn is_reset(sending: &Sending) -> bool {
    match sending {
        Sending::Frame(frame) => {
            frame.id() == 0 && frame.data() == [NmtCommand::ResetNode as u8, 17]
        }
        Sending::Bytes { bytes, .. } => decoded(bytes)
            .is_some_and(|message| message == Message::Nmt(NmtRequest(NmtCommand::ResetNode))),
    }
}

/// Returns whether this is a request to store all settings.
fn is_store(sending: &Sending) -> bool {
    let [low, high] = index::STORE.to_le_bytes();
    match sending {
        Sending::Frame(frame) => {
            frame.id() == 0x611 && frame.data().get(1..4) == Some(&[low, high, 1])
        }
        Sending::Bytes { bytes, .. } => match decoded(bytes) {
            Some(Message::ConfigSet(set)) => set.address == Address::new(index::STORE, 1),
            _ => false,
        },
    }
}

fn decoded(bytes: &[u8]) -> Option<Message> {
    let mut decoder = Decoder::new();
    let frame = bytes.iter().find_map(|byte| decoder.push(*byte))?;
    Some(frame.ok()?.message)
}

/// Client of a foot on a line that changes the data sent.
fn meddled(line: &str, sent: impl FnMut(&Sending) -> Option<Sending> + 'static) -> Client {
    let link = shared(&format!("feet=1,line={line}"));
    Client::new(Changed::new(&link, sent, || 1), None).expect("one foot")
}

#[test]
fn lost_reset_command_is_repeated() {
    for line in LINES {
        let mut resets = 0;
        let mut client = meddled(line, move |sending| {
            resets += u32::from(is_reset(sending));
            (!is_reset(sending) || resets > 1).then(|| sending.clone())
        });
        let wanted = [("decision.threshold", "0.625")];
        write(&mut client, &wanted, Lasting::UntilReset).expect("taken");
        client.restart(None).expect("it is back");
        assert_eq!(get(&mut client, "decision.threshold"), "0.5", "{line}");
    }
}

#[test]
fn missing_reset_is_reported_as_an_error() {
    for line in LINES {
        let mut client = meddled(line, |sending| (!is_reset(sending)).then(|| sending.clone()));
        let error = client.restart(None).expect_err("it goes on as it was");
        let said = error.to_string();
        assert!(said.ends_with("it was commanded to reset 3 times, and has not"), "{said}");
    }
}

#[test]
fn restart_before_a_store_is_reported_as_an_error() {
    for line in LINES {
        let mut stores = 0;
        let mut client = meddled(line, move |sending| {
            stores += u32::from(is_store(sending));
            // Lost because the foot is reset first.
            let is_lost = is_store(sending) && stores == 1;
            Some(if is_lost { reset_like(sending) } else { sending.clone() })
        });
        let wanted = [("decision.threshold", "0.625")];
        let error = write(&mut client, &wanted, Lasting::Stored).expect_err("it has started");
        let SettingsError::NotTaken { cause, undone } = &error else {
            panic!("{line}: {error}");
        };
        assert!(matches!(cause, RequestError::StartedAgain { .. }), "{line}: {error}");
        assert_eq!(*undone, Undone::NoneStored, "{line}: {error}");
        assert_eq!(get(&mut client, "decision.threshold"), "0.5", "{line}");
        assert_eq!(client.state().expect("a state"), NmtState::Operational);
    }
}

/// Client of two new boards with the same id: each frame arrives twice.
fn twice(keys: &str) -> Client {
    let both = Changed::new(&shared(keys), |sending| Some(sending.clone()), || 2);
    Client::new(both, None).expect("one id")
}

#[test]
fn two_boards_with_the_same_id_are_not_configured() {
    let mut client = twice("feet=1");
    let error = settings::set_position(&mut client, Foot::RearRight).expect_err("which one?");
    assert!(
        matches!(error, SettingsError::Request(RequestError::SameId { count: 2, .. })),
        "{error}"
    );
    assert_eq!(get(&mut client, "foot"), "1");
}

#[test]
fn late_response_to_a_write_is_not_read_as_a_value() {
    for source in ["feet=1", "line=uart"] {
        let mut client = twice(source);
        client.command(NmtCommand::EnterPreOperational).expect("a line");
        let address = Address::new(index::DECISION, 1);
        for threshold in [0.625, 0.75] {
            let value = Value::F32(threshold);
            client.write(address, value).expect("taken");
            let read = client.read(address, DataType::Real32);
            assert_eq!(read.expect("a number"), value, "{source}");
        }
    }
}

/// Robot whose sensor fails its self-test.
struct Failing {
    robot: Robot,
    line: DemoLine,
    clock: LineClock,
}

impl Link for Failing {
    fn receive(&mut self, _: Duration) -> Result<Option<Arrived>, LinkError> {
        let arrival = match self.line {
            DemoLine::Can => self.robot.next_frame().map(|(at, frame)| {
                let interface = "can0".into();
                (at, Arrival::Frame { interface, frame })
            }),
            DemoLine::Uart => {
                let bytes = self.robot.take_serial(0);
                let port = "FL".into();
                let arrived = (self.robot.now(), Arrival::Bytes { port, bytes });
                Some(arrived).filter(|(_, arrival)| !matches!(arrival, Arrival::Bytes { bytes, .. } if bytes.is_empty()))
            }
        };
        if arrival.is_none() {
            self.robot.tick();
            self.clock.advance_to(self.robot.elapsed_us());
        }
        Ok(arrival)
    }

    fn clock(&self) -> LineClock {
        self.clock.clone()
    }

    fn send(&mut self, sending: &Sending) -> Result<(), LinkError> {
        match sending {
            Sending::Frame(frame) => self.robot.send(*frame),
            Sending::Bytes { bytes, .. } => self.robot.send_serial(0, bytes),
        }
        Ok(())
    }
}

#[test]
fn self_test_reports_failed_axes_and_restores_settings() {
    for (name, line) in LINES.into_iter().zip([DemoLine::Can, DemoLine::Uart]) {
        let mut good = client(name);
        assert_eq!(self_test::run(&mut good).expect("a verdict"), SelfTestResult::Passed, "{name}");
        let mut robot = Robot::new(1, 1, line);
        robot.fail_self_test(0, 0b01_0010);
        let clock = LineClock::in_steps();
        let failing = Failing { robot, line, clock };
        let mut bad = Client::new(Box::new(failing), None).expect("a foot");
        let verdict = self_test::run(&mut bad).expect("a verdict");
        let axes = (name == "can").then(|| vec![Axis::Ay, Axis::Wy]);
        assert_eq!(verdict, SelfTestResult::Failed(axes), "{name}");
        for client in [&mut good, &mut bad] {
            assert_eq!(get(client, "self_test_at_start"), "0");
            assert_eq!(client.state().expect("a state"), NmtState::Operational);
            client.restart(None).expect("it is back");
            assert_eq!(get(client, "self_test_at_start"), "0");
        }
    }
}

#[test]
fn settings_text_parses_back_to_the_same_settings() {
    let mut client = client("can");
    let own = settings::read(&mut client).expect("answers");
    let text = settings::to_text(&own, "settings");
    let back = settings::from_text(&text, client.node()).expect("settings");
    assert_eq!(back, own);
    // The identifiers of PDOs depend on the foot.
    let other = settings::from_text(&text, NodeId::new(0x14)).expect("settings");
    assert!(settings::differences(&own, &other).is_empty());
    for (wrong, message) in [
        ("windw = 5", "line 1: no object has the name \"windw\""),
        ("\nwindow = 0", "line 2: window is \"0\", but "),
        ("window", "line 1: \"window\" is not a setting, such as window = 50ms"),
        ("window = 50ms\nwindow = 50ms", "line 2: window appears twice"),
        ("stage = 1", "line 1: stage is not a setting and cannot be written"),
    ] {
        let error = settings::from_text(wrong, None).expect_err(wrong).to_string();
        assert!(error.starts_with(message), "{error}");
    }
    assert!(matches!(own.get(&Address::new(index::FOOT, 0)), Some(Value::U8(1))));
}

#[test]
fn foot_without_heartbeats_is_configured() {
    let mut client = client("can");
    for time in ["0", "200"] {
        let wanted = [("producer_heartbeat_time", time)];
        let written = write(&mut client, &wanted, Lasting::Stored);
        written.unwrap_or_else(|error| panic!("{time}: {error}"));
        assert_eq!(get(&mut client, "producer_heartbeat_time"), time);
    }
}

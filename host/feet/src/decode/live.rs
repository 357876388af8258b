//! Live decoding of frames of a CAN bus and bytes of serial lines.
//!
//! [`LiveDecoder`] keeps the sequence numbers of each line and combines the frames of a sample. A contact is
//! returned once it is final, which is when its foot has sent the next one, a millisecond later. The output of a foot on a
//! serial line is returned once its first health message has named it, or once it has sent none for 0.2 s on its clock.

use std::collections::{BTreeMap, VecDeque};
use std::mem;
use std::sync::Arc;

use estimator_core::Timestamp;
use wire::foot::cob_id;
use wire::node::NmtState;
use wire::pdo::{Health, Load};
use wire::uart::{ConfigResponse, Decoder, HealthMessage, LogMessage, Message, RawMessage};
use wire::{CanFrame, Emergency, Faults, NodeId, Pdo};

use crate::decode::can::{CanDecoder, Reception};
use crate::decode::uart::{self, HeldBack, UartDecoder};
use crate::decode::{ContactRow, KnownFeet, Report};
use crate::link::Arrival;

/// Decoder of all lines of a robot: arrivals go in, messages of its feet come out.
pub struct LiveDecoder {
    can: CanDecoder,
    serial: BTreeMap<Arc<str>, SerialInput>,
    /// Names of the lines, shared by all their messages.
    lines: BTreeMap<String, Arc<str>>,
    /// Messages that are final and not yet returned.
    messages: VecDeque<FootMessage>,
    /// Faults recently raised by each node, with the time of the newest.
    raised: BTreeMap<FootKey, (Timestamp, Faults)>,
}

/// A message received from a foot.
#[derive(Clone, Debug, PartialEq)]
pub struct FootMessage {
    /// Time of reception on the receiver's clock.
    pub at: Timestamp,
    /// The foot that sent it.
    pub foot: FootKey,
    /// Content of the message.
    pub body: MessageBody,
}

/// Source of a message.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct FootKey {
    /// Line of reception: a CAN interface or a serial port.
    pub line: Arc<str>,
    /// Node id; on a serial line known from the first health message on.
    pub node: Option<u8>,
}

/// Content of a message sent by a foot or to it.
#[derive(Clone, Debug, PartialEq)]
pub enum MessageBody {
    /// Contact, with all values sent for the same sample.
    Contact(Box<ContactRow>),
    /// Raw sample of the sensor; serial line only.
    Raw(RawMessage),
    /// State of the board; serial line only.
    Board(Box<HealthMessage>),
    /// Flags, errors and drops; CAN only.
    Health(Health),
    /// A fault was raised or cleared; CAN only.
    Emergency(Emergency),
    /// The foot has started with these faults, whose frames precede the boot-up.
    BootUp(Faults),
    /// State of the node; CAN only.
    Heartbeat(NmtState),
    /// A line of text; serial line only.
    Log(LogMessage),
    /// Load sent by the robot to the foot, N; CAN only.
    Load(f32),
    /// Response to a request; serial line only.
    Answer(ConfigResponse),
    /// Response to a request over CAN: the bytes of an SDO.
    Sdo([u8; 8]),
}

/// Timeout of a contact that waits for further frames if its foot sends no other contact, µs.
const CONTACT_TIMEOUT_US: u64 = 20_000;

/// Longest time from the newest fault of a foot to its boot-up, µs.
const AT_START_US: u64 = 20_000;

impl LiveDecoder {
    /// Creates a decoder; `feet` defines the nodes of a CAN bus that are feet, and their names.
    #[must_use]
    pub fn new(feet: KnownFeet) -> Self {
        Self {
            can: CanDecoder::new(feet, Reception::Live),
            serial: BTreeMap::new(),
            lines: BTreeMap::new(),
            messages: VecDeque::new(),
            raised: BTreeMap::new(),
        }
    }

    /// Adds a node that is a foot.
    pub fn add(&mut self, node: NodeId) {
        self.can.known.add(node);
    }

    /// Processes data received at `at`. Returns its text if it is unreadable.
    pub fn take(&mut self, arrival: Arrival, at: Timestamp) -> Option<String> {
        match arrival {
            Arrival::Frame { interface, frame } => self.frame(&interface, &frame, at),
            Arrival::Bytes { port, bytes } => self.bytes(&port, &bytes, at),
            Arrival::Estimate(row) => self.row(row, at),
            Arrival::Unreadable(text) => return Some(text),
            Arrival::Remark(_) => {}
        }
        None
    }

    /// Processes a frame that `interface` received at `at`. A contact waits for its further frames; any other message is
    /// returned at once.
    pub fn frame(&mut self, interface: &str, frame: &CanFrame, at: Timestamp) {
        let line = self.line(interface);
        self.can.take(interface, frame, Some(at));
        // Emergencies are returned as messages, so the report need not keep them.
        self.can.report.emergencies.clear();
        if let Some((node, body)) = body_of(frame)
            && self.can.known.contains(node)
        {
            let node = Some(node.get());
            let foot = FootKey { line, node };
            let body = self.with_faults_at_start(body, &foot, at);
            self.messages.push_back(FootMessage { at, foot, body });
        }
        self.idle(at);
    }

    /// Adds to a boot-up the faults received just before it.
    fn with_faults_at_start(
        &mut self,
        body: MessageBody,
        foot: &FootKey,
        at: Timestamp,
    ) -> MessageBody {
        match &body {
            MessageBody::Emergency(Emergency { code: 1.., fault: Some(fault), .. }) => {
                let before = self.raised_since(foot, at);
                let now = (at, before.with(*fault));
                self.raised.insert(foot.clone(), now);
                body
            }
            MessageBody::BootUp(_) => MessageBody::BootUp(self.raised_since(foot, at)),
            _ => body,
        }
    }

    /// Faults raised by a foot just before `at`.
    fn raised_since(&self, foot: &FootKey, at: Timestamp) -> Faults {
        let since_us = |raised: Timestamp| at.as_micros().saturating_sub(raised.as_micros());
        match self.raised.get(foot) {
            Some((raised, faults)) if since_us(*raised) <= AT_START_US => *faults,
            _ => Faults::NONE,
        }
    }

    /// Processes bytes received on the serial line `port` at `at`.
    pub fn bytes(&mut self, port: &str, bytes: &[u8], at: Timestamp) {
        let line = self.line(port);
        let serial = self.serial.entry(Arc::clone(&line));
        let serial = serial.or_insert_with(|| SerialInput {
            decoder: Decoder::new(),
            rows: UartDecoder::new(&self.can.known, &line),
            held: HeldBack::default(),
            newest: at,
            has_begun: false,
        });
        serial.newest = at;
        for byte in bytes {
            let Some(result) = serial.decoder.push(*byte) else { continue };
            let is_first = !mem::replace(&mut serial.has_begun, true);
            let frame = match result {
                // Reception begins between any two bytes, so it mostly has only the end of the first frame.
                Err(problem) if is_first && !uart::is_whole(&problem) => continue,
                Err(problem) => {
                    serial.rows.report.count_problem(uart::name(problem));
                    continue;
                }
                Ok(frame) => frame,
            };
            let body = match (serial.rows.take(&frame), frame.message) {
                (Some(mut row), _) => {
                    row.received = Some(at);
                    row.interface = Some(Arc::clone(&line));
                    serial.rows.report.count_row(&row);
                    MessageBody::Contact(Box::new(row))
                }
                (None, Message::Raw(raw)) => MessageBody::Raw(raw),
                (None, Message::Health(health)) => MessageBody::Board(Box::new(health)),
                (None, Message::Log(log)) => MessageBody::Log(log),
                (None, Message::ConfigResponse(answer)) => MessageBody::Answer(answer),
                (None, _) => continue,
            };
            let sampled = match &body {
                MessageBody::Contact(row) => Some(row.timestamp),
                MessageBody::Raw(raw) => Some(raw.timestamp),
                _ => None,
            };
            let foot = FootKey { line: Arc::clone(&line), node: serial.rows.node.map(NodeId::get) };
            let message = FootMessage { at, foot, body };
            if matches!(message.body, MessageBody::Answer(_)) {
                // A response is never held back, because the client waits for it.
                self.messages.push_back(message);
            } else {
                serial.held.push(message, sampled);
            }
            let known = serial.held.take_if(&serial.rows);
            self.messages.extend(serial.released(known));
            // If the clock of the foot is unknown, the wait is measured on the clock of this machine.
            let oldest = serial.held.oldest_without_clock().map_or(at, |oldest| oldest.at);
            let logs = serial.held.take_after(at.as_micros().saturating_sub(oldest.as_micros()));
            self.messages.extend(serial.released(logs));
        }
    }

    /// Adds the row of an estimate computed elsewhere, received at `at`.
    pub fn row(&mut self, row: Box<ContactRow>, at: Timestamp) {
        let line = self.line(row.interface.as_deref().unwrap_or_default());
        let node = row.node.map(NodeId::get);
        let foot = FootKey { line, node };
        let body = MessageBody::Contact(row);
        self.messages.push_back(FootMessage { at, foot, body });
    }

    /// Advances the time to `now` without reception, and releases the contacts whose timeout has expired.
    pub fn idle(&mut self, now: Timestamp) {
        for serial in self.serial.values_mut() {
            let silent_us = now.as_micros().saturating_sub(serial.newest.as_micros());
            let held = serial.held.take_after(silent_us);
            self.messages.extend(serial.released(held));
        }
        let overdue = now.as_micros().saturating_sub(CONTACT_TIMEOUT_US);
        self.release_contacts(Timestamp::from_micros(overdue));
    }

    /// Ends reception: every pending contact is released.
    pub fn finish(&mut self) {
        for serial in self.serial.values_mut() {
            let held = serial.held.take();
            self.messages.extend(serial.released(held));
        }
        self.can.finish();
        self.release_contacts(Timestamp::from_micros(u64::MAX));
    }

    /// Returns the next message, if any.
    pub fn next_message(&mut self) -> Option<FootMessage> {
        self.messages.pop_front()
    }

    /// Nodes that are not known feet but send frames that may be contacts: the first of each CAN bus, with its line.
    pub fn unknown_feet(&self) -> impl Iterator<Item = (&str, u8)> {
        self.can.unknown_feet.iter().map(|(line, node)| (line.as_str(), *node))
    }

    /// Name of a foot, if any.
    #[must_use]
    pub fn name(&self, foot: &FootKey) -> Option<Arc<str>> {
        let of_line = || self.serial.get(&foot.line).and_then(|serial| serial.rows.name());
        let node = foot.node.and_then(NodeId::new);
        of_line().or_else(|| node.and_then(|node| self.can.known.name(node)))
    }

    /// Returns whether a line has received bytes of a serial port.
    #[must_use]
    pub fn is_serial(&self, line: &str) -> bool {
        self.serial.contains_key(line)
    }

    /// Reports of received, missing and invalid frames: one for CAN as a whole, without a name, and one for
    /// each serial line with its name.
    #[must_use]
    pub fn reports(&self) -> Vec<(Option<&str>, &Report)> {
        let can = (!self.can.report.frames.is_empty()).then_some((None, &self.can.report));
        let serial = self.serial.iter();
        let serial = serial.map(|(line, serial)| (Some(line.as_ref()), &serial.rows.report));
        can.into_iter().chain(serial).collect()
    }

    /// Name of a line, shared by all its messages.
    fn line(&mut self, name: &str) -> Arc<str> {
        if let Some(line) = self.lines.get(name) {
            return Arc::clone(line);
        }
        let line: Arc<str> = name.into();
        self.lines.insert(name.to_owned(), Arc::clone(&line));
        line
    }

    /// Releases the contacts on CAN that are final: their foot has sent the next one, or they were received before
    /// `overdue`.
    fn release_contacts(&mut self, overdue: Timestamp) {
        let rows: Vec<ContactRow> = self.can.final_rows(overdue).collect();
        for row in rows {
            let at = row.received.unwrap_or_default();
            self.row(Box::new(row), at);
        }
    }
}

impl Default for LiveDecoder {
    /// A decoder for feet with default ids.
    fn default() -> Self {
        Self::new(KnownFeet::default())
    }
}

/// Decoder of a serial line.
struct SerialInput {
    decoder: Decoder,
    rows: UartDecoder,
    /// Messages of a foot that has not been named yet.
    held: HeldBack<FootMessage>,
    /// Time of the newest bytes on the receiver's clock.
    newest: Timestamp,
    /// Whether the end of a frame was received.
    has_begun: bool,
}

impl SerialInput {
    /// Completes messages that are no longer held back with the foot that sent them.
    fn released(&self, messages: VecDeque<FootMessage>) -> impl Iterator<Item = FootMessage> + '_ {
        messages.into_iter().map(|mut message| {
            message.foot.node = self.rows.node.map(NodeId::get);
            if let MessageBody::Contact(row) = &mut message.body {
                self.rows.identify(row);
            }
            message
        })
    }
}

/// Decodes a frame that is not part of a row: returns the node, whether a foot or not, and the content.
#[must_use]
pub fn body_of(frame: &CanFrame) -> Option<(NodeId, MessageBody)> {
    let id = frame.id();
    let (function, node) = cob_id::split(id);
    let node = node?;
    let body = match function {
        cob_id::EMERGENCY => MessageBody::Emergency(Emergency::decode(frame.data8()?)),
        cob_id::HEARTBEAT => match frame.data() {
            [0] => MessageBody::BootUp(Faults::NONE),
            [code] => MessageBody::Heartbeat(state(*code)?),
            _ => return None,
        },
        cob_id::SDO_RESPONSE => MessageBody::Sdo(*frame.data8()?),
        Load::BASE => MessageBody::Load(Load::decode(frame.data())?.0),
        _ => match Pdo::from_cob_id(id)? {
            (Pdo::Health, _) => MessageBody::Health(Health::decode(frame.data8()?)),
            _ => return None,
        },
    };
    Some((node, body))
}

/// Decodes the state in a heartbeat; the highest bit belongs to node guarding.
fn state(code: u8) -> Option<NmtState> {
    use NmtState::{Initialising, Operational, PreOperational, Stopped};
    let mut states = [Initialising, Stopped, Operational, PreOperational].into_iter();
    states.find(|state| *state as u8 == code & 0x7F)
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::ContactEstimate;
    use wire::pdo::{Acceleration, Contact};
    use wire::{Fault, uart as line};

    fn at(micros: u64) -> Timestamp {
        Timestamp::from_micros(1_000_000 + micros)
    }

    fn estimate(micros: u64) -> ContactEstimate {
        ContactEstimate { timestamp: Timestamp::from_micros(micros), ..ContactEstimate::default() }
    }

    fn contact(node: u16, micros: u64) -> CanFrame {
        let bytes = Contact::new(&estimate(micros), (micros / 1000) as u8, Faults::NONE).encode();
        CanFrame::new(0x180 + node, &bytes).expect("a frame")
    }

    fn all(decoder: &mut LiveDecoder) -> Vec<FootMessage> {
        std::iter::from_fn(|| decoder.next_message()).collect()
    }

    /// Returns the row and foot of the only contact received.
    fn only_contact(messages: &[FootMessage]) -> (&FootKey, &ContactRow) {
        match messages {
            [FootMessage { foot, body: MessageBody::Contact(row), .. }] => (foot, row),
            _ => panic!("{messages:?}"),
        }
    }

    #[test]
    fn reception_may_begin_in_the_middle_of_a_frame() {
        let problems = |begun: &[&[u8]]| {
            let mut decoder = LiveDecoder::default();
            for bytes in begun {
                decoder.bytes("ttyACM0", bytes, at(1));
            }
            decoder.reports()[0].1.problems.values().sum::<u64>()
        };
        let message = Message::Contact(line::ContactMessage::new(&estimate(5000), Faults::NONE));
        let encoded = line::encode(3, &message);
        let whole = encoded.as_bytes();
        for cut in 1..whole.len() {
            assert_eq!(problems(&[&whole[cut..], whole]), 0, "{cut}");
        }
        // Damage after the first frame is a problem.
        assert_eq!(problems(&[whole, &whole[5..], whole]), 1);
    }

    #[test]
    fn contact_is_returned_once_its_foot_sends_the_next() {
        let mut decoder = LiveDecoder::default();
        let acceleration = Acceleration::new(&estimate(1000), Faults::NONE).encode();
        decoder.frame("can0", &contact(0x11, 1000), at(1000));
        decoder.frame("can0", &contact(0x12, 1000), at(1100));
        let frame = CanFrame::new(0x480 + 0x11, &acceleration).expect("a frame");
        decoder.frame("can0", &frame, at(1200));
        assert_eq!(all(&mut decoder), []);
        decoder.frame("can0", &contact(0x11, 2000), at(2000));
        let messages = all(&mut decoder);
        let (foot, row) = only_contact(&messages);
        assert_eq!((foot.node, &*foot.line), (Some(0x11), "can0"));
        assert_eq!(row.foot.as_deref(), Some("FL"));
        assert!(row.acceleration.is_some());
    }

    #[test]
    fn silent_foot_does_not_block_other_feet() {
        let mut decoder = LiveDecoder::default();
        decoder.frame("can0", &contact(0x11, 1000), at(1000));
        for ms in 2..40 {
            decoder.frame("can0", &contact(0x12, ms * 1000), at(ms * 1000));
        }
        let nodes: Vec<_> = all(&mut decoder).iter().map(|h| h.foot.node).collect();
        assert_eq!(nodes.len(), 38, "one of 0x11, and all of 0x12 but the newest");
        assert_eq!(nodes[0], Some(0x11));
        decoder.idle(at(100_000));
        assert_eq!(all(&mut decoder).len(), 1, "the newest of 0x12");
    }

    #[test]
    fn faults_states_and_loads_of_a_foot_are_returned() {
        let mut decoder = LiveDecoder::default();
        let emergency = Emergency::raised(Fault::SensorFrozen, 7, Faults::NONE);
        let frames = [
            (0x091, &emergency.encode()[..]),
            (0x711, &[0][..]),
            (0x711, &[5][..]),
            (0x211, &12.5_f32.to_le_bytes()[..]),
            // A frame of no foot.
            (0x7F0, &[5][..]),
        ];
        for (id, data) in frames {
            let frame = CanFrame::new(id, data).expect("a frame");
            decoder.frame("can0", &frame, at(0));
        }
        let bodies: Vec<_> = all(&mut decoder).into_iter().map(|message| message.body).collect();
        assert_eq!(
            bodies,
            [
                MessageBody::Emergency(emergency),
                MessageBody::BootUp(Faults::NONE.with(Fault::SensorFrozen)),
                MessageBody::Heartbeat(NmtState::Operational),
                MessageBody::Load(12.5),
            ]
        );
    }

    #[test]
    fn old_fault_is_not_part_of_a_boot_up() {
        let mut decoder = LiveDecoder::default();
        let emergency = Emergency::raised(Fault::SensorFrozen, 7, Faults::NONE);
        let mut receive = |micros, id, data: &[u8]| {
            let frame = CanFrame::new(id, data).expect("a frame");
            decoder.frame("can0", &frame, at(micros));
        };
        receive(0, 0x091, &emergency.encode());
        receive(30_000, 0x711, &[0]);
        let last = all(&mut decoder).pop().map(|message| message.body);
        assert_eq!(last, Some(MessageBody::BootUp(Faults::NONE)));
    }

    #[test]
    fn serial_frames_may_arrive_in_pieces() {
        let message = Message::Contact(line::ContactMessage::new(&estimate(5000), Faults::NONE));
        let encoded = line::encode(3, &message);
        let mut decoder = LiveDecoder::default();
        for byte in encoded.as_bytes() {
            decoder.bytes("ttyACM0", &[*byte], at(1));
        }
        assert_eq!(all(&mut decoder), [], "the foot has no name yet");
        decoder.idle(at(199_000));
        assert_eq!(all(&mut decoder), []);
        decoder.idle(at(300_000));
        let messages = all(&mut decoder);
        let (foot, row) = only_contact(&messages);
        assert_eq!((&*foot.line, foot.node), ("ttyACM0", None));
        assert_eq!(row.timestamp.as_micros(), 5000);
    }

    fn contact_message(micros: u64) -> Message {
        Message::Contact(line::ContactMessage::new(&estimate(micros), Faults::NONE))
    }

    fn health_message() -> Message {
        Message::Health(HealthMessage {
            timestamp: Timestamp::from_micros(6000),
            stage: wire::Stage::Running,
            state: NmtState::Operational,
            id: NodeId::new(0x12),
            faults: Faults::NONE,
            unknown_faults: 0,
            temperature: wire::pdo::Quantity::default(),
            counters: wire::Counters::default(),
        })
    }

    #[test]
    fn first_contacts_of_a_serial_foot_wait_for_its_name() {
        let contact = contact_message(5000);
        let mut decoder = LiveDecoder::default();
        decoder.bytes("ttyACM0", line::encode(3, &contact).as_bytes(), at(1));
        assert_eq!(all(&mut decoder), []);
        decoder.bytes("ttyACM0", line::encode(4, &health_message()).as_bytes(), at(2));
        let messages = all(&mut decoder);
        let (foot, row) = only_contact(&messages[..1]);
        assert_eq!((foot.node, row.foot.as_deref()), (Some(0x12), Some("FR")));
        assert_eq!(row.node, NodeId::new(0x12));
        assert!(matches!(messages[1].body, MessageBody::Board(_)));
        decoder.bytes("ttyACM0", line::encode(5, &contact).as_bytes(), at(3));
        assert_eq!(all(&mut decoder).len(), 1, "its name is known");
    }

    #[test]
    fn stall_of_this_machine_takes_no_name_from_a_serial_foot() {
        let mut decoder = LiveDecoder::default();
        for ms in 0..100 {
            let bytes = line::encode(ms as u16, &contact_message(ms * 1000));
            decoder.bytes("ttyACM0", bytes.as_bytes(), at(ms * 50_000));
        }
        assert_eq!(all(&mut decoder), [], "100 ms of the foot in 5 s");
        let health = line::encode(100, &health_message());
        decoder.bytes("ttyACM0", health.as_bytes(), at(5_000_000));
        let messages = all(&mut decoder);
        assert_eq!(messages.len(), 101);
        assert!(messages.iter().all(|message| message.foot.node == Some(0x12)));
    }

    #[test]
    fn foot_that_only_logs_is_heard_and_named_later() {
        let mut decoder = LiveDecoder::default();
        let log = Message::Log(LogMessage::new(3, "the sensor does not answer"));
        let mut sent = 0;
        while all(&mut decoder).is_empty() {
            assert!(sent < 30, "held back for {sent} messages");
            decoder.bytes(
                "ttyACM0",
                line::encode(sent, &log).as_bytes(),
                at(u64::from(sent) * 10_000),
            );
            sent += 1;
        }
        let contact = line::encode(sent, &contact_message(5000));
        decoder.bytes("ttyACM0", contact.as_bytes(), at(300_000));
        assert_eq!(all(&mut decoder), [], "its contacts still wait for its name");
    }

    #[test]
    fn serial_foot_without_health_messages_is_not_held_back() {
        // A foot whose clock runs, and a foot whose clock stands.
        for (step_us, held) in [(1000, 201), (0, 4096)] {
            let mut decoder = LiveDecoder::default();
            let mut sent = 0;
            while all(&mut decoder).is_empty() {
                let bytes = line::encode(sent as u16, &contact_message(sent * step_us));
                decoder.bytes("ttyACM0", bytes.as_bytes(), at(sent));
                sent += 1;
            }
            assert_eq!(sent, held + 1, "{step_us} µs");
        }
    }
}

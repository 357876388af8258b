//! What feet send, as it comes: frames of a CAN bus and bytes of serial lines go in, what they say
//! comes out.
//!
//! [`Listener`] knows how the lines are numbered and which frames belong together; a contact comes out
//! once nothing can complete it any more, which is when its foot has sent the next one, a millisecond
//! later.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use estimator_core::Timestamp;
use wire::foot::cob_id;
use wire::node::State;
use wire::pdo::{Health, Load};
use wire::uart::{ConfigResponse, Decoder, HealthMessage, LogMessage, Message, RawSample};
use wire::{CanFrame, Emergency, Faults, NodeId, Pdo};

use crate::can::{Log, Reception};
use crate::uart::{self, Stream};
use crate::{Feet, Report, Row};

/// How long a contact waits for what belongs to it where its foot sends no other, µs.
const LONGEST_WAIT_US: u64 = 20_000;

/// How long before its boot-up the first faults of a foot come at most, µs.
const AT_START_US: u64 = 20_000;

/// Bits of an identifier that are a node's id.
const NODE_ID_BITS: u16 = 0x7F;

/// The foot that something is from.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct FootKey {
    /// The line that it was received on: a CAN interface or a serial port.
    pub line: Arc<str>,
    /// Its node id; on a serial line from its first health message on.
    pub node: Option<u8>,
}

/// Something that a foot said.
#[derive(Clone, Debug, PartialEq)]
pub struct Heard {
    /// When it was received, on the clock of the receiver.
    pub at: Timestamp,
    /// Which foot said it.
    pub foot: FootKey,
    /// What it said.
    pub said: Said,
}

/// What a foot said, or what was said to it.
#[derive(Clone, Debug, PartialEq)]
pub enum Said {
    /// The contact, with all that was sent of the same sample.
    Contact(Box<Row>),
    /// What the sensor measured; on a serial line.
    Raw(RawSample),
    /// How the board is; on a serial line.
    Board(Box<HealthMessage>),
    /// Flags, errors and drops; on CAN.
    Health(Health),
    /// A fault was raised or cleared; on CAN.
    Emergency(Emergency),
    /// It has started, with these faults: their frames go before that of the boot-up.
    BootUp(Faults),
    /// It is in this state; on CAN.
    Heartbeat(State),
    /// A line of text; on a serial line.
    Log(LogMessage),
    /// The robot told it its load, in N; on CAN.
    Load(f32),
    /// It answers a request over the serial line.
    Answer(ConfigResponse),
    /// It answers a request over CAN: the bytes of an SDO.
    Sdo([u8; 8]),
}

/// What feet said so far, and what is still to be handed on.
pub struct Listener {
    feet: Feet,
    can: Log,
    serial: BTreeMap<Arc<str>, Serial>,
    lines: BTreeMap<String, Arc<str>>,
    heard: VecDeque<Heard>,
    /// Faults that a node of a bus has raised in the newest moment.
    raised: BTreeMap<FootKey, (Timestamp, Faults)>,
}

/// A serial line.
struct Serial {
    decoder: Decoder,
    stream: Stream,
}

impl Listener {
    /// Before the first frame; `feet` says which nodes of a CAN bus are feet, and what they are called.
    #[must_use]
    pub fn new(feet: Feet) -> Self {
        Self {
            can: Log::new(feet.clone(), Reception::Live),
            feet,
            serial: BTreeMap::new(),
            lines: BTreeMap::new(),
            heard: VecDeque::new(),
            raised: BTreeMap::new(),
        }
    }

    /// From now on this node is a foot, too.
    pub fn add(&mut self, node: NodeId) {
        self.feet.add(node);
        self.can.add(node);
    }

    /// Takes in a frame that `interface` received at `at`.
    pub fn frame(&mut self, interface: &str, frame: &CanFrame, at: Timestamp) {
        let line = self.line(interface);
        self.can.take(interface, frame, Some(at));
        // What the report would keep of all faults is handed on here.
        self.can.report.emergencies.clear();
        if let Some((node, said)) = said(frame)
            && self.feet.contains(node)
        {
            let node = Some(node.get());
            let foot = FootKey { line, node };
            let said = self.with_faults_at_start(said, &foot, at);
            self.heard.push_back(Heard { at, foot, said });
        }
        let overdue = at.as_micros().saturating_sub(LONGEST_WAIT_US);
        self.settle(Timestamp::from_micros(overdue));
    }

    /// What was said; a boot-up with the faults that came just before it.
    fn with_faults_at_start(&mut self, said: Said, foot: &FootKey, at: Timestamp) -> Said {
        match &said {
            Said::Emergency(Emergency {
                code: 1..,
                fault: Some(fault),
                ..
            }) => {
                let before = self.raised_since(foot, at);
                let now = (at, before.with(*fault));
                self.raised.insert(foot.clone(), now);
                said
            }
            Said::BootUp(_) => Said::BootUp(self.raised_since(foot, at)),
            _ => said,
        }
    }

    /// The faults that a foot has raised in the moment before `at`.
    fn raised_since(&self, foot: &FootKey, at: Timestamp) -> Faults {
        let newest = self
            .raised
            .get(foot)
            .filter(|(raised, _)| at.as_micros().saturating_sub(raised.as_micros()) <= AT_START_US);
        newest.map_or(Faults::NONE, |(_, faults)| *faults)
    }

    /// Takes in bytes that came over the serial line `port` at `at`.
    pub fn bytes(&mut self, port: &str, bytes: &[u8], at: Timestamp) {
        let line = self.line(port);
        let serial = self.serial.entry(line).or_insert_with_key(|_| Serial {
            decoder: Decoder::new(),
            stream: Stream::new(self.feet.clone()),
        });
        let line = self.lines.get(port).cloned().unwrap_or_default();
        for byte in bytes {
            let said = match serial.decoder.push(*byte) {
                None => continue,
                Some(Err(problem)) => {
                    serial.stream.report.count_problem(uart::name(problem));
                    continue;
                }
                Some(Ok(frame)) => {
                    let row = serial.stream.take(&frame);
                    match (row, frame.message) {
                        (Some(mut row), _) => {
                            row.received = Some(at);
                            row.interface = Some(Arc::clone(&line));
                            serial.stream.report.count_row(&row);
                            Said::Contact(Box::new(row))
                        }
                        (None, Message::Raw(raw)) => Said::Raw(raw),
                        (None, Message::Health(health)) => Said::Board(Box::new(health)),
                        (None, Message::Log(log)) => Said::Log(log),
                        (None, Message::ConfigResponse(answer)) => Said::Answer(answer),
                        (None, _) => continue,
                    }
                }
            };
            let foot = FootKey {
                line: Arc::clone(&line),
                node: serial.stream.node.map(NodeId::get),
            };
            self.heard.push_back(Heard { at, foot, said });
        }
    }

    /// Takes in the row of an estimate that was made elsewhere, at `at`.
    pub fn row(&mut self, row: Box<Row>, at: Timestamp) {
        let line = self.line(row.interface.as_deref().unwrap_or_default());
        let node = row.node.map(NodeId::get);
        let foot = FootKey { line, node };
        let said = Said::Contact(row);
        self.heard.push_back(Heard { at, foot, said });
    }

    /// Nothing has come until `now`: a contact that waits too long for more is handed on.
    pub fn idle(&mut self, now: Timestamp) {
        let overdue = now.as_micros().saturating_sub(LONGEST_WAIT_US);
        self.settle(Timestamp::from_micros(overdue));
    }

    /// Nothing will come any more: every contact is handed on.
    pub fn finish(&mut self) {
        self.can.finish();
        self.settle(Timestamp::from_micros(u64::MAX));
    }

    /// The next thing that was said, if there is one.
    pub fn next_heard(&mut self) -> Option<Heard> {
        self.heard.pop_front()
    }

    /// A node on a CAN bus that is not a known foot, but sends what may be contacts.
    #[must_use]
    pub const fn unknown_foot(&self) -> Option<u8> {
        self.can.unknown_foot
    }

    /// What a foot is called, where it has a name.
    #[must_use]
    pub fn name(&self, foot: &FootKey) -> Option<Arc<str>> {
        foot.node
            .and_then(NodeId::new)
            .and_then(|node| self.feet.name(node))
    }

    /// What came over each line, what is missing and what could not be understood: of CAN as a whole,
    /// of each serial line by its name.
    #[must_use]
    pub fn reports(&self) -> Vec<(Option<&str>, &Report)> {
        let can = (!self.can.report.frames.is_empty()).then_some((None, &self.can.report));
        let serial = self.serial.iter();
        let serial = serial.map(|(line, serial)| (Some(line.as_ref()), &serial.stream.report));
        can.into_iter().chain(serial).collect()
    }

    /// The name of a line, shared by all that is heard on it.
    fn line(&mut self, name: &str) -> Arc<str> {
        if let Some(line) = self.lines.get(name) {
            return Arc::clone(line);
        }
        let line: Arc<str> = name.into();
        self.lines.insert(name.to_owned(), Arc::clone(&line));
        line
    }

    fn settle(&mut self, overdue: Timestamp) {
        let rows: Vec<Row> = self.can.settle_closed(overdue).collect();
        for row in rows {
            let line = row.interface.clone();
            let foot = FootKey {
                line: line.unwrap_or_else(|| "".into()),
                node: row.node.map(NodeId::get),
            };
            self.heard.push_back(Heard {
                at: row.received.unwrap_or_default(),
                foot,
                said: Said::Contact(Box::new(row)),
            });
        }
    }
}

impl Default for Listener {
    /// For the feet that have the ids which they have from the start.
    fn default() -> Self {
        Self::new(Feet::default())
    }
}

/// What a frame says beside the rows: of which node, a foot or not, and what.
#[must_use]
pub fn said(frame: &CanFrame) -> Option<(NodeId, Said)> {
    let id = frame.id();
    let node = NodeId::new((id & NODE_ID_BITS) as u8)?;
    let said = match id & !NODE_ID_BITS {
        cob_id::EMERGENCY => Said::Emergency(Emergency::decode(frame.data8()?)),
        cob_id::HEARTBEAT => match frame.data() {
            [0] => Said::BootUp(Faults::NONE),
            [code] => Said::Heartbeat(state(*code)?),
            _ => return None,
        },
        cob_id::SDO_RESPONSE => Said::Sdo(*frame.data8()?),
        Load::BASE => Said::Load(Load::decode(frame.data())?.0),
        _ => match Pdo::from_cob_id(id)? {
            (Pdo::Health, _) => Said::Health(Health::decode(frame.data8()?)),
            _ => return None,
        },
    };
    Some((node, said))
}

/// The state of a heartbeat; the highest bit belongs to node guarding.
fn state(code: u8) -> Option<State> {
    [
        State::Initialising,
        State::Stopped,
        State::Operational,
        State::PreOperational,
    ]
    .into_iter()
    .find(|state| *state as u8 == code & 0x7F)
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
        ContactEstimate {
            timestamp: Timestamp::from_micros(micros),
            ..ContactEstimate::default()
        }
    }

    fn contact(node: u16, micros: u64) -> CanFrame {
        let bytes = Contact::new(&estimate(micros), (micros / 1000) as u8, Faults::NONE).encode();
        CanFrame::new(0x180 + node, &bytes).expect("a frame")
    }

    fn all(listener: &mut Listener) -> Vec<Heard> {
        std::iter::from_fn(|| listener.next_heard()).collect()
    }

    /// The row of the one contact that was heard, and its foot.
    fn only_contact(heard: &[Heard]) -> (&FootKey, &Row) {
        match heard {
            [
                Heard {
                    foot,
                    said: Said::Contact(row),
                    ..
                },
            ] => (foot, row),
            _ => panic!("{heard:?}"),
        }
    }

    #[test]
    fn a_contact_comes_out_with_what_belongs_to_it_when_its_foot_sends_the_next() {
        let mut listener = Listener::default();
        let acceleration = Acceleration::new(&estimate(1000), Faults::NONE).encode();
        listener.frame("can0", &contact(0x11, 1000), at(1000));
        listener.frame("can0", &contact(0x12, 1000), at(1100));
        let frame = CanFrame::new(0x480 + 0x11, &acceleration).expect("a frame");
        listener.frame("can0", &frame, at(1200));
        assert_eq!(all(&mut listener), []);
        listener.frame("can0", &contact(0x11, 2000), at(2000));
        let heard = all(&mut listener);
        let (foot, row) = only_contact(&heard);
        assert_eq!((foot.node, &*foot.line), (Some(0x11), "can0"));
        assert_eq!(row.foot.as_deref(), Some("FL"));
        assert!(row.acceleration.is_some());
    }

    #[test]
    fn a_foot_that_falls_silent_holds_up_nobody_for_long() {
        let mut listener = Listener::default();
        listener.frame("can0", &contact(0x11, 1000), at(1000));
        for ms in 2..40 {
            listener.frame("can0", &contact(0x12, ms * 1000), at(ms * 1000));
        }
        let nodes: Vec<_> = all(&mut listener).iter().map(|h| h.foot.node).collect();
        assert_eq!(
            nodes.len(),
            38,
            "one of 0x11, and all of 0x12 but the newest"
        );
        assert_eq!(nodes[0], Some(0x11));
        listener.idle(at(100_000));
        assert_eq!(all(&mut listener).len(), 1, "the newest of 0x12");
    }

    #[test]
    fn faults_states_and_loads_are_heard_of_feet_alone() {
        let mut listener = Listener::default();
        let emergency = Emergency::raised(Fault::SensorFrozen, 7, Faults::NONE);
        let frames = [
            (0x091, &emergency.encode()[..]),
            (0x711, &[0][..]),
            (0x711, &[5][..]),
            (0x211, &12.5_f32.to_le_bytes()[..]),
            (0x7F0 & 0x7FF, &[5][..]),
        ];
        for (id, data) in frames {
            let frame = CanFrame::new(id, data).expect("a frame");
            listener.frame("can0", &frame, at(0));
        }
        let said: Vec<_> = all(&mut listener).into_iter().map(|h| h.said).collect();
        assert_eq!(
            said,
            [
                Said::Emergency(emergency),
                Said::BootUp(Faults::NONE.with(Fault::SensorFrozen)),
                Said::Heartbeat(State::Operational),
                Said::Load(12.5),
            ]
        );
    }

    #[test]
    fn a_fault_that_came_long_before_a_boot_up_is_not_of_that_start() {
        let mut listener = Listener::default();
        let emergency = Emergency::raised(Fault::SensorFrozen, 7, Faults::NONE);
        let mut receive = |micros, id, data: &[u8]| {
            let frame = CanFrame::new(id, data).expect("a frame");
            listener.frame("can0", &frame, at(micros));
        };
        receive(0, 0x091, &emergency.encode());
        receive(30_000, 0x711, &[0]);
        let last = all(&mut listener).pop().map(|heard| heard.said);
        assert_eq!(last, Some(Said::BootUp(Faults::NONE)));
    }

    #[test]
    fn bytes_of_serial_lines_may_come_in_any_pieces() {
        let message = Message::Contact(line::ContactMessage::new(&estimate(5000), Faults::NONE));
        let encoded = line::encode(3, &message);
        let mut listener = Listener::default();
        for byte in encoded.as_bytes() {
            listener.bytes("ttyACM0", &[*byte], at(1));
        }
        let heard = all(&mut listener);
        let (foot, row) = only_contact(&heard);
        assert_eq!((&*foot.line, foot.node), ("ttyACM0", None));
        assert_eq!(row.timestamp.as_micros(), 5000);
    }
}

//! Requests, one after the other, and their answers: over CAN as SDOs, over the serial line as its own
//! messages. Everything else that arrives meanwhile is passed over.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use decode::live::{FootKey, Heard, Listener, Said};
use thiserror::Error;
use wire::dictionary::{self, SIGNATURE_RESTORE, SIGNATURE_STORE, index};
use wire::foot::cob_id;
use wire::node::{Command, State};
use wire::uart::{Answer, ConfigGet, ConfigResponse, ConfigSet, Message, NmtRequest, encode};
use wire::{AbortCode, Address, CanFrame, DataType, NodeId, Value};

use crate::link::{Arrival, Link, LinkError, Sending};

/// How long a foot may take to answer: it does so in the tick that takes the request in.
const ANSWER: Duration = Duration::from_millis(500);

/// The same of a store, which may erase a page.
const STORE: Duration = Duration::from_secs(3);

/// How often something is asked that was not answered: frames are lost.
const TRIES: u32 = 3;

/// How long to listen for what is waited for at once.
const LISTEN: Duration = Duration::from_millis(5);

/// How long to listen for feet on a bus: each sends a contact a millisecond, and a heartbeat in any
/// state twice a second.
pub const SCAN: Duration = Duration::from_millis(1200);

/// Why a request came to nothing.
#[derive(Debug, Error)]
pub enum RequestError {
    /// The foot has refused it.
    #[error("{what} was refused: {} (0x{:08X}): {}", reason.name(), reason.code(), decode::remedy::Trouble::Refusal(*reason).remedy())]
    Refused {
        /// What.
        what: String,
        /// Why.
        reason: AbortCode,
    },
    /// The foot has refused it for a reason that is not known here.
    #[error("{what} was refused with the abort code 0x{code:08X}")]
    RefusedUnknown {
        /// What.
        what: String,
        /// The code.
        code: u32,
    },
    /// Nothing has answered.
    #[error("{foot} does not answer: {what}")]
    NoAnswer {
        /// Who was asked.
        foot: String,
        /// What for.
        what: String,
    },
    /// Something else than the object's type came.
    #[error("{what} came as {length} bytes, which is no {}: another version of the foot's program?", data_type.name())]
    Type {
        /// What.
        what: String,
        /// How long it was.
        length: usize,
        /// What it should be.
        data_type: DataType,
    },
    /// No foot is heard.
    #[error("no foot is heard on this line")]
    NoFoot,
    /// Several are, and nothing says which is meant.
    #[error("there are several feet, {0}: name one with --node")]
    Several(String),
    /// The line does not work.
    #[error(transparent)]
    Link(#[from] LinkError),
}

/// The foot that is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    /// The node of this id, by SDO.
    Can(NodeId),
    /// The one at the other end of the serial line.
    Serial,
}

/// A foot that is asked and set.
pub struct Client {
    link: Box<dyn Link>,
    listener: Listener,
    way: Way,
    sequence: u16,
}

/// What came for a request.
enum Came {
    Bytes(Vec<u8>),
    Done,
    Refused(AbortCode),
    Unknown(u32),
}

impl Client {
    /// The foot at the other end of a line: on a bus the node that is given, or the only one there is.
    ///
    /// # Errors
    /// There is none, or several and none is given.
    pub fn new(mut link: Box<dyn Link>, node: Option<NodeId>) -> Result<Self, RequestError> {
        let mut listener = Listener::default();
        let way = match node {
            Some(node) => Way::Can(node),
            None => {
                let heard = feet(link.as_mut(), &mut listener, SCAN)?;
                let nodes: BTreeSet<_> = heard.iter().filter_map(|key| key.node).collect();
                let is_serial = heard.iter().any(|key| key.node.is_none());
                match (is_serial, nodes.len(), nodes.first()) {
                    (true, ..) => Way::Serial,
                    (false, 1, Some(node)) => NodeId::new(*node).map_or(Way::Serial, Way::Can),
                    (false, 0, _) => return Err(RequestError::NoFoot),
                    (false, ..) => {
                        let names: Vec<_> = nodes.iter().map(ToString::to_string).collect();
                        return Err(RequestError::Several(names.join(", ")));
                    }
                }
            }
        };
        Ok(Self {
            link,
            listener,
            way,
            sequence: 0,
        })
    }

    /// The foot's node id, where it is asked over CAN.
    #[must_use]
    pub const fn node(&self) -> Option<NodeId> {
        match self.way {
            Way::Can(node) => Some(node),
            Way::Serial => None,
        }
    }

    fn foot(&self) -> String {
        match self.way {
            Way::Can(node) => format!("node {}", node.get()),
            Way::Serial => "the foot".to_owned(),
        }
    }

    /// Reads the bytes of an object.
    ///
    /// # Errors
    /// It is refused, or nothing answers.
    pub fn read_bytes(&mut self, address: Address) -> Result<Vec<u8>, RequestError> {
        let what = || format!("reading {}", named(address));
        match self.request(address, None, ANSWER, &what)? {
            Came::Bytes(bytes) => Ok(bytes),
            Came::Done => Ok(Vec::new()),
            Came::Refused(reason) => Err(RequestError::Refused {
                what: what(),
                reason,
            }),
            Came::Unknown(code) => Err(RequestError::RefusedUnknown { what: what(), code }),
        }
    }

    /// Reads a number.
    ///
    /// # Errors
    /// It is refused, nothing answers, or it has another type.
    pub fn read(&mut self, address: Address, data_type: DataType) -> Result<Value, RequestError> {
        let bytes = self.read_bytes(address)?;
        Value::from_bytes(data_type, &bytes).ok_or_else(|| RequestError::Type {
            what: named(address),
            length: bytes.len(),
            data_type,
        })
    }

    /// Reads a text.
    ///
    /// # Errors
    /// It is refused, or nothing answers.
    pub fn read_text(&mut self, address: Address) -> Result<String, RequestError> {
        let bytes = self.read_bytes(address)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// Writes an object.
    ///
    /// # Errors
    /// It is refused, or nothing answers.
    pub fn write(&mut self, address: Address, value: Value) -> Result<(), RequestError> {
        self.write_within(address, value, ANSWER)
    }

    /// Stores all settings, so that they outlast power-off.
    ///
    /// # Errors
    /// It is refused, or nothing answers.
    pub fn store(&mut self) -> Result<(), RequestError> {
        let all = Address::new(index::STORE, 1);
        self.write_within(all, Value::U32(SIGNATURE_STORE), STORE)
    }

    /// Forgets the stored settings: from the next reset on the foot has its defaults.
    ///
    /// # Errors
    /// It is refused, or nothing answers.
    pub fn restore(&mut self) -> Result<(), RequestError> {
        let all = Address::new(index::RESTORE, 1);
        self.write_within(all, Value::U32(SIGNATURE_RESTORE), STORE)
    }

    /// Commands the foot: to stream, to stop, to reset. That is not answered.
    ///
    /// # Errors
    /// The line does not work.
    pub fn command(&mut self, command: Command) -> Result<(), RequestError> {
        match self.way {
            Way::Can(node) => {
                if let Some(frame) = CanFrame::new(0, &[command as u8, node.get()]) {
                    self.link.send(&Sending::Frame(frame))?;
                }
            }
            Way::Serial => self.send_message(&Message::Nmt(NmtRequest(command)))?,
        }
        Ok(())
    }

    /// The state that the foot reports next: in a heartbeat or a health message.
    ///
    /// # Errors
    /// It reports none.
    pub fn state(&mut self) -> Result<State, RequestError> {
        let id = self.node().map(NodeId::get);
        let state = self.listen(SCAN, |heard| match &heard.said {
            Said::Heartbeat(state) if heard.foot.node == id => Some(*state),
            Said::Board(board) if id.is_none() => Some(board.state),
            _ => None,
        })?;
        state.ok_or_else(|| RequestError::NoAnswer {
            foot: self.foot(),
            what: "its state, in a heartbeat or health message,".to_owned(),
        })
    }

    fn write_within(
        &mut self,
        address: Address,
        value: Value,
        answer: Duration,
    ) -> Result<(), RequestError> {
        let what = || format!("writing {}", named(address));
        match self.request(address, Some(value), answer, &what)? {
            Came::Done | Came::Bytes(_) => Ok(()),
            Came::Refused(reason) => Err(RequestError::Refused {
                what: what(),
                reason,
            }),
            Came::Unknown(code) => Err(RequestError::RefusedUnknown { what: what(), code }),
        }
    }

    /// Reads, or writes `value`. What is not answered is asked again: all requests may be repeated.
    fn request(
        &mut self,
        address: Address,
        value: Option<Value>,
        answer: Duration,
        what: &dyn Fn() -> String,
    ) -> Result<Came, RequestError> {
        for _ in 0..TRIES {
            let came = match self.way {
                Way::Can(node) => self.request_sdo(node, address, value, answer)?,
                Way::Serial => self.request_serial(address, value, answer)?,
            };
            if let Some(came) = came {
                return Ok(came);
            }
        }
        Err(RequestError::NoAnswer {
            foot: self.foot(),
            what: format!("{}, asked {TRIES} times", what()),
        })
    }

    fn request_serial(
        &mut self,
        address: Address,
        value: Option<Value>,
        answer: Duration,
    ) -> Result<Option<Came>, RequestError> {
        let message = match value {
            None => Message::ConfigGet(ConfigGet { address }),
            Some(value) => Message::ConfigSet(ConfigSet {
                address,
                value: value.into(),
            }),
        };
        self.send_message(&message)?;
        self.listen(answer, |heard| match &heard.said {
            Said::Answer(ConfigResponse {
                address: of,
                answer,
            }) if *of == address => Some(match answer {
                Answer::Value(bytes) => Came::Bytes(bytes.as_bytes().to_vec()),
                Answer::Done => Came::Done,
                Answer::Refused(reason) => Came::Refused(*reason),
            }),
            _ => None,
        })
    }

    fn send_message(&mut self, message: &Message) -> Result<(), RequestError> {
        self.sequence = self.sequence.wrapping_add(1);
        let bytes = encode(self.sequence, message).as_bytes().to_vec();
        Ok(self.link.send(&Sending::Bytes { port: None, bytes })?)
    }

    fn request_sdo(
        &mut self,
        node: NodeId,
        address: Address,
        value: Option<Value>,
        answer: Duration,
    ) -> Result<Option<Came>, RequestError> {
        let [low, high] = address.index.to_le_bytes();
        let (command, data) = match value {
            None => (0x40, [0; 4]),
            // Expedited, with the number of bytes that are not used.
            Some(value) => {
                let size = value.data_type().size().unwrap_or(4);
                (0x23 | ((4 - size) as u8) << 2, value.to_raw().to_le_bytes())
            }
        };
        let [a, b, c, d] = data;
        let request = [command, low, high, address.subindex, a, b, c, d];
        let Some(response) = self.exchange(node, request, answer, |r| {
            r[1..4] == [low, high, address.subindex]
        })?
        else {
            return Ok(None);
        };
        let [head, _, _, _, data @ ..] = response;
        Ok(Some(match head >> 5 {
            4 => {
                let code = u32::from_le_bytes(data);
                AbortCode::from_code(code).map_or(Came::Unknown(code), Came::Refused)
            }
            3 => Came::Done,
            // An upload: expedited, or in segments.
            2 if head & 2 != 0 => {
                let length = 4 - usize::from(head >> 2 & 3);
                Came::Bytes(data.get(..length).unwrap_or_default().to_vec())
            }
            _ => match self.segments(node, answer)? {
                Some(bytes) => Came::Bytes(bytes),
                None => return Ok(None),
            },
        }))
    }

    /// The segments of an upload.
    fn segments(
        &mut self,
        node: NodeId,
        answer: Duration,
    ) -> Result<Option<Vec<u8>>, RequestError> {
        let mut bytes = Vec::new();
        let mut toggle = 0;
        loop {
            let request = [0x60 | toggle, 0, 0, 0, 0, 0, 0, 0];
            let is_next =
                |response: &[u8; 8]| response[0] >> 5 == 0 && response[0] & 0x10 == toggle;
            let Some([head, data @ ..]) = self.exchange(node, request, answer, is_next)? else {
                return Ok(None);
            };
            let length = 7 - usize::from(head >> 1 & 7);
            bytes.extend_from_slice(data.get(..length).unwrap_or_default());
            if head & 1 != 0 {
                return Ok(Some(bytes));
            }
            toggle ^= 0x10;
        }
    }

    fn exchange(
        &mut self,
        node: NodeId,
        request: [u8; 8],
        answer: Duration,
        is_answer: impl Fn(&[u8; 8]) -> bool,
    ) -> Result<Option<[u8; 8]>, RequestError> {
        if let Some(frame) = CanFrame::new(node.cob_id(cob_id::SDO_REQUEST), &request) {
            self.link.send(&Sending::Frame(frame))?;
        }
        let id = Some(node.get());
        self.listen(answer, |heard| match &heard.said {
            Said::Sdo(bytes) if heard.foot.node == id && is_answer(bytes) => Some(*bytes),
            _ => None,
        })
    }

    /// Listens for what `find` finds, `longest` at most.
    fn listen<T>(
        &mut self,
        longest: Duration,
        mut find: impl FnMut(&Heard) -> Option<T>,
    ) -> Result<Option<T>, RequestError> {
        let end = Instant::now() + longest;
        while Instant::now() < end {
            take(self.link.as_mut(), &mut self.listener)?;
            while let Some(heard) = self.listener.next_heard() {
                if let Some(found) = find(&heard) {
                    return Ok(Some(found));
                }
            }
        }
        Ok(None)
    }
}

/// Hands what arrives to a listener.
fn take(link: &mut dyn Link, listener: &mut Listener) -> Result<(), LinkError> {
    if let Some((at, arrival)) = link.receive(LISTEN)? {
        match arrival {
            Arrival::Frame { interface, frame } => listener.frame(&interface, &frame, at),
            Arrival::Bytes { port, bytes } => listener.bytes(&port, &bytes, at),
            Arrival::Estimate(_) | Arrival::Unreadable(_) => {}
        }
    }
    Ok(())
}

/// The feet that are heard on a line within some time, by line and id. On a serial line there is one,
/// of which the id does not matter.
///
/// # Errors
/// The line does not work.
pub fn feet(
    link: &mut dyn Link,
    listener: &mut Listener,
    time: Duration,
) -> Result<BTreeSet<FootKey>, LinkError> {
    let mut feet = BTreeSet::new();
    let end = Instant::now() + time;
    while Instant::now() < end {
        take(link, listener)?;
        while let Some(mut heard) = listener.next_heard() {
            let is_serial = match &heard.said {
                Said::Raw(_) | Said::Board(_) | Said::Log(_) | Said::Answer(_) => true,
                // A contact of a serial line has all its flags.
                Said::Contact(row) => row.axes.is_some() && row.flags.is_some(),
                _ => false,
            };
            if is_serial {
                heard.foot.node = None;
                feet.insert(heard.foot);
                return Ok(feet);
            }
            // The robot's own report of a load is no sign of a foot.
            if !matches!(heard.said, Said::Load(_)) {
                feet.insert(heard.foot);
            }
        }
    }
    Ok(feet)
}

/// An object in words: its name and its address.
fn named(address: Address) -> String {
    let Address { index, subindex } = address;
    let name = super::name::Named::at(address).map(|named| format!("{} ", named.name()));
    format!("{}(0x{index:04X}:{subindex})", name.unwrap_or_default())
}

/// The type of an object that is in the dictionary.
#[must_use]
pub fn type_of(address: Address) -> Option<DataType> {
    match dictionary::find(address) {
        Ok(dictionary::Place::Entry(entry, _)) => Some(entry.data_type()),
        Ok(dictionary::Place::Highest(_)) => Some(DataType::Unsigned8),
        Err(_) => None,
    }
}

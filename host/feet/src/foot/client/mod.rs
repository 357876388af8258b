//! Requests to a foot, one at a time: SDOs over CAN, configuration messages over the serial line. Other
//! messages that arrive meanwhile are ignored.

mod bootloader;
mod download;
mod error;
mod requests;

use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

use crate::decode::live::{Heard, Listener, Said};
use wire::dictionary::{SIGNATURE_RESTORE, SIGNATURE_STORE, index};
use wire::node::{Command, State};
use wire::uart::{Message, NmtRequest};
use wire::{AbortCode, Address, CanFrame, DataType, Emergency, NodeId, Value};

use super::name::Named;
use super::scan::{self, SCAN};
use crate::link::{LISTEN, LineClock, Link, Sending};
pub use error::RequestError;

/// Response timeout; a foot responds in the tick that receives the request.
const ANSWER: Duration = Duration::from_millis(500);

/// Response timeout of a store, which may erase a page.
const STORE: Duration = Duration::from_secs(3);

/// Time after which a foot takes one more store, with a reserve.
const STORE_INTERVAL: Duration = Duration::from_millis(1_100);

/// Maximum number of attempts to store: an emulated foot may be slower than this machine's clock.
const STORE_TRIES: u32 = 8;

/// Maximum number of attempts per request, because frames may be lost.
pub(super) const TRIES: u32 = 3;

/// Tolerance for messages out of order on a serial line, µs; if the clock goes back by more, the foot has
/// restarted.
const DISORDER_US: u64 = 20_000;

/// Maximum number of emergencies kept.
const MOST_EMERGENCIES: usize = 16;

/// Client of one foot.
pub struct Client {
    link: Box<dyn Link>,
    listener: Listener,
    /// Node that is addressed by SDO; `None` for the foot at the other end of a serial line.
    node: Option<NodeId>,
    sequence: u16,
    /// Newest emergencies of the foot, which arrive between responses.
    emergencies: VecDeque<Emergency>,
    /// Newest time on the foot's clock, µs; serial line only.
    clock_us: Option<u64>,
    /// Number of restarts of the foot since it was first heard.
    pub(super) starts: u32,
    /// Nodes that have started, and the number of them that were taken.
    booted: Vec<NodeId>,
    taken: usize,
}

impl Client {
    /// Creates the client of a foot: on a bus, the given node, or the only foot.
    ///
    /// # Errors
    /// There is no foot, or there are several and no node is given.
    pub fn new(mut link: Box<dyn Link>, node: Option<NodeId>) -> Result<Self, RequestError> {
        let mut listener = Listener::default();
        let node = match node {
            Some(node) => {
                listener.add(node);
                Some(node)
            }
            None => {
                let heard = scan::feet(link.as_mut(), &mut listener, SCAN)?;
                let nodes: BTreeSet<_> = heard.iter().filter_map(|key| key.node).collect();
                let is_serial = heard.iter().any(|key| key.node.is_none());
                match (is_serial, nodes.len(), nodes.first()) {
                    (true, ..) => None,
                    (false, 1, Some(node)) => NodeId::new(*node),
                    // A foot on a serial line may wait in its bootloader for a program.
                    (false, 0, _) => {
                        let node = bootloader::node(link.as_mut(), &mut listener)?;
                        Some(node.ok_or(RequestError::NoFoot)?)
                    }
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
            node,
            sequence: 0,
            emergencies: VecDeque::new(),
            clock_us: None,
            starts: 0,
            booted: Vec::new(),
            taken: 0,
        })
    }

    /// Node id of the foot, if it is connected over CAN.
    #[must_use]
    pub const fn node(&self) -> Option<NodeId> {
        self.node
    }

    /// Clock of the line, on which timeouts are measured.
    #[must_use]
    pub fn clock(&self) -> LineClock {
        self.link.clock()
    }

    /// Changes the node id of the foot, if it is connected over CAN.
    pub(super) fn follow(&mut self, node: NodeId) {
        if self.node.is_some() {
            self.node = Some(node);
            self.hear(node);
        }
    }

    /// Adds a node to those whose messages are decoded.
    pub(super) fn hear(&mut self, node: NodeId) {
        self.listener.add(node);
    }

    /// Error of a request without a response.
    pub(super) fn no_answer(&self, what: impl Into<String>) -> RequestError {
        RequestError::NoAnswer { foot: self.foot(), what: what.into() }
    }

    pub(super) fn foot(&self) -> String {
        match self.node {
            Some(node) => format!("node {}", node.get()),
            None => "the foot".to_owned(),
        }
    }

    /// Reads a number.
    ///
    /// # Errors
    /// The request is refused, there is no response, or the object has another type.
    pub fn read(&mut self, address: Address, data_type: DataType) -> Result<Value, RequestError> {
        let bytes = self.request(address, None, ANSWER)?;
        Value::from_bytes(data_type, &bytes).ok_or_else(|| RequestError::Type {
            what: named(address),
            length: bytes.len(),
            data_type,
        })
    }

    /// Reads a number with the type that the dictionary gives it, or else UNSIGNED32; returns its bits.
    ///
    /// # Errors
    /// The request is refused, there is no response, or the object has another type.
    pub fn read_number(&mut self, index: u16, subindex: u8) -> Result<u32, RequestError> {
        let address = Address::new(index, subindex);
        let named = Named::at(address);
        let data_type = named.map_or(DataType::Unsigned32, |named| named.entry.data_type());
        Ok(self.read(address, data_type)?.to_raw())
    }

    /// Reads the serial number of the foot (object 0x1018:4).
    ///
    /// # Errors
    /// The request is refused, or there is no response.
    pub fn serial_number(&mut self) -> Result<u32, RequestError> {
        self.read_number(SERIAL_NUMBER.index, SERIAL_NUMBER.subindex)
    }

    /// Reads a text.
    ///
    /// # Errors
    /// The request is refused, or there is no response.
    pub fn read_text(&mut self, address: Address) -> Result<String, RequestError> {
        let bytes = self.request(address, None, ANSWER)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// Writes an object.
    ///
    /// # Errors
    /// The request is refused, or there is no response.
    pub fn write(&mut self, address: Address, value: Value) -> Result<(), RequestError> {
        self.write_within(address, value, ANSWER)
    }

    /// Stores all settings in flash. The caller checks that the foot still had the settings that were written.
    ///
    /// # Errors
    /// The request is refused, or there is no response.
    pub(super) fn store(&mut self) -> Result<(), RequestError> {
        self.write_flash(Address::new(index::STORE, 1), SIGNATURE_STORE)
    }

    /// Erases the stored settings; the defaults apply from the next reset on.
    ///
    /// # Errors
    /// The request is refused, or there is no response.
    pub fn restore(&mut self) -> Result<(), RequestError> {
        self.write_flash(Address::new(index::RESTORE, 1), SIGNATURE_RESTORE)
    }

    /// Writes a signature, again where the foot has stored too often just before.
    fn write_flash(&mut self, address: Address, signature: u32) -> Result<(), RequestError> {
        let mut tries = STORE_TRIES;
        loop {
            tries -= 1;
            match self.write_within(address, Value::U32(signature), STORE) {
                Err(error) if tries > 0 && error.is_refusal(AbortCode::TooSoon) => {
                    self.wait(STORE_INTERVAL)?;
                }
                result => return result,
            }
        }
    }

    /// Sends a command, which has no response.
    ///
    /// # Errors
    /// The line does not work.
    pub fn command(&mut self, command: Command) -> Result<(), RequestError> {
        match self.node {
            Some(node) => {
                if let Some(frame) = CanFrame::new(0, &[command as u8, node.get()]) {
                    self.link.send(&Sending::Frame(frame))?;
                }
            }
            None => self.send_message(&Message::Nmt(NmtRequest(command)))?,
        }
        Ok(())
    }

    /// Returns the foot to this state. The command to stream is repeated until the foot does: commands have no
    /// response, and frames may be lost.
    ///
    /// # Errors
    /// The foot does not stream.
    pub fn bring_to(&mut self, state: State) -> Result<(), RequestError> {
        let command = match state {
            State::Operational => Command::StartRemoteNode,
            State::Stopped => Command::StopRemoteNode,
            State::Initialising | State::PreOperational => Command::EnterPreOperational,
        };
        if state != State::Operational {
            return self.command(command);
        }
        let id = self.node().map(NodeId::get);
        for _ in 0..TRIES {
            self.command(command)?;
            let streams = self.listen(SCAN, |heard| {
                let streams = match &heard.said {
                    // On a serial line, a foot streams in the pre-operational state as well.
                    Said::Board(board) => id.is_none() && board.state == State::Operational,
                    Said::Contact(_) => id.is_some() && heard.foot.node == id,
                    Said::Heartbeat(state) => heard.foot.node == id && *state == State::Operational,
                    _ => false,
                };
                streams.then_some(())
            })?;
            if streams.is_some() {
                return Ok(());
            }
        }
        Err(self.no_answer("the command to start"))
    }

    /// Returns the state that the foot reports next, in a heartbeat or a health message. A foot whose heartbeats
    /// are disabled is operational if it sends contacts.
    ///
    /// # Errors
    /// The foot reports no state.
    pub fn state(&mut self) -> Result<State, RequestError> {
        let id = self.node().map(NodeId::get);
        let mut streams = false;
        let state = self.listen(SCAN, |heard| match &heard.said {
            Said::Heartbeat(state) if heard.foot.node == id => Some(*state),
            Said::Board(board) if id.is_none() => Some(board.state),
            Said::Contact(_) if id.is_some() && heard.foot.node == id => {
                streams = true;
                None
            }
            _ => None,
        })?;
        let state = state.or(streams.then_some(State::Operational));
        state.ok_or_else(|| self.no_answer("its state, in a heartbeat or health message,"))
    }

    /// Writes an object, and waits this long for the response.
    ///
    /// # Errors
    /// The request is refused, or there is no response.
    pub(super) fn write_within(
        &mut self,
        address: Address,
        value: Value,
        answer: Duration,
    ) -> Result<(), RequestError> {
        self.request(address, Some(value), answer).map(|_| ())
    }

    /// Checks that exactly one board responds.
    ///
    /// # Errors
    /// There is no response, or several boards have the same id.
    pub fn is_alone(&mut self) -> Result<(), RequestError> {
        let Some(node) = self.node else {
            return self.serial_number().map(|_| ());
        };
        let request @ [_, head @ .., _, _, _, _] = scan::upload(SERIAL_NUMBER);
        let mut count = 0;
        // All responses within the timeout are counted.
        self.exchange(node, request, ANSWER, |response| {
            count += usize::from(response[1..4] == head);
            false
        })?;
        match count {
            // A frame was lost: repeat as a normal request.
            0 => self.serial_number().map(|_| ()),
            1 => Ok(()),
            count => Err(RequestError::SameId { foot: self.foot(), count }),
        }
    }

    /// Checks that no other board on the bus has the new id of this one; on a serial line, nothing is checked.
    ///
    /// # Errors
    /// Another board has the id.
    pub(super) fn is_free(&mut self, node: NodeId) -> Result<(), RequestError> {
        if self.node().is_none_or(|own| own == node) {
            return Ok(());
        }
        self.hear(node);
        let taken = self.listen(SCAN, |heard| {
            // A robot reports loads to absent feet as well.
            let is_load = matches!(heard.said, Said::Load(_));
            (heard.foot.node == Some(node.get()) && !is_load).then_some(())
        })?;
        if taken.is_none() {
            return Ok(());
        }
        Err(RequestError::Taken { foot: self.foot(), node })
    }

    /// Waits, and receives meanwhile, so that the buffers of the line do not overflow.
    ///
    /// # Errors
    /// The line does not work.
    pub fn wait(&mut self, time: Duration) -> Result<(), RequestError> {
        self.listen(time, |_| None::<()>).map(|_| ())
    }

    /// Listens until `find` returns a value, at most `longest`.
    pub(super) fn listen<T>(
        &mut self,
        longest: Duration,
        mut find: impl FnMut(&Heard) -> Option<T>,
    ) -> Result<Option<T>, RequestError> {
        let clock = self.clock();
        let end = clock.now() + longest;
        while clock.now() < end {
            if let Some((at, arrival)) = self.link.receive(LISTEN)? {
                self.booted.extend(scan::boot_up(&arrival));
                // Unreadable arrivals are ignored.
                arrival.hand_to(&mut self.listener, at);
            }
            while let Some(heard) = self.listener.next_heard() {
                self.keep_emergency(&heard);
                self.keep_clock(&heard);
                if let Some(found) = find(&heard) {
                    return Ok(Some(found));
                }
            }
        }
        Ok(None)
    }

    fn keep_emergency(&mut self, heard: &Heard) {
        if let Said::Emergency(emergency) = &heard.said
            && self.node().map(NodeId::get) == heard.foot.node
        {
            self.emergencies.truncate(MOST_EMERGENCIES - 1);
            self.emergencies.push_front(*emergency);
        }
    }

    /// Counts restarts of the foot: boot-ups over CAN, jumps back of its clock on a serial line.
    fn keep_clock(&mut self, heard: &Heard) {
        if self.node.is_some() {
            let is_own = self.node().map(NodeId::get) == heard.foot.node;
            self.starts += u32::from(is_own && matches!(heard.said, Said::BootUp(_)));
            return;
        }
        let time = match &heard.said {
            Said::Contact(row) => row.timestamp,
            Said::Board(board) => board.timestamp,
            Said::Raw(raw) => raw.timestamp,
            _ => return,
        };
        let now_us = time.as_micros();
        let newest_us = self.clock_us.replace(now_us).unwrap_or(now_us);
        if newest_us > now_us.saturating_add(DISORDER_US) {
            self.starts += 1;
        } else {
            self.clock_us = Some(newest_us.max(now_us));
        }
    }

    /// Returns the ids of the nodes that have started since the last call.
    pub(super) fn take_booted(&mut self) -> Vec<NodeId> {
        let new = self.booted.get(self.taken..).unwrap_or_default().to_vec();
        self.taken = self.booted.len();
        new
    }

    /// Number of starts of the foot since it was first heard.
    pub(super) fn starts_of_foot(&self) -> usize {
        match self.node {
            Some(node) => self.booted.iter().filter(|booted| **booted == node).count(),
            None => self.starts as usize,
        }
    }

    /// Returns the emergencies of the foot since the last call, newest first.
    pub(super) fn take_emergencies(&mut self) -> VecDeque<Emergency> {
        std::mem::take(&mut self.emergencies)
    }
}

/// Object of the serial number.
const SERIAL_NUMBER: Address = Address::new(index::IDENTITY, 4);

/// Formats an object as its name and address.
fn named(address: Address) -> String {
    let Address { index, subindex } = address;
    let name = Named::at(address).map(|named| format!("{} ", named.name()));
    format!("{}(0x{index:04X}:{subindex})", name.unwrap_or_default())
}

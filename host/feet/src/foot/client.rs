//! Requests to a foot, one at a time: SDOs over CAN, configuration messages over the serial line. Other messages that
//! arrive during a request are ignored.
//!
//! [`Client`] has, in this order: objects, commands and states, restarts, the boards that share a bus, and the request
//! with its response. A request without a response is repeated.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use wire::dictionary::{SIGNATURE_RESTORE, SIGNATURE_STORE, index};
use wire::foot::cob_id;
use wire::node::{NmtCommand, NmtState};
use wire::uart::{Answer, ConfigGet, ConfigResponse, ConfigSet, Message, NmtRequest, encode};
use wire::{AbortCode, Address, CanFrame, DataType, Emergency, NodeId, Value};

use super::name::Named;
use super::request::{FootRequest, RequestError, TRIES};
use super::scan::{self, SCAN, upload};
use crate::decode::live::{FootKey, FootMessage, LiveDecoder, MessageBody};
use crate::link::{LISTEN, LineClock, Link, LinkError, Sending, SharedLine};

/// Response timeout; a foot responds in the tick that receives the request.
const ANSWER: Duration = Duration::from_millis(500);

/// Response timeout of a store, which may erase a page.
const STORE: Duration = Duration::from_secs(3);

/// Time after which a foot accepts another store, with a reserve.
const STORE_INTERVAL: Duration = Duration::from_millis(1_100);

/// Maximum number of attempts to store. Several are needed if the clock of an emulated foot is slower than this machine's.
const STORE_TRIES: u32 = 8;

/// Tolerance for messages out of order on a serial line, µs. If the clock is behind by more, the foot has restarted.
const DISORDER_US: u64 = 20_000;

/// Maximum number of emergencies kept.
const MOST_EMERGENCIES: usize = 16;

/// Object of the serial number.
const SERIAL_NUMBER: Address = Address::new(index::IDENTITY, 4);

/// Abort code if a response is missing: SDO protocol timed out.
const TIMED_OUT: u32 = 0x0504_0000;

/// Commands of an SDO server: the upper three bits of its response.
const UPLOADED: u8 = 2;
const DOWNLOADED: u8 = 3;
const ABORTED: u8 = 4;

/// Timeout from a reset to the first response.
const FIRST_ANSWER: Duration = Duration::from_secs(5);

/// Timeout for detecting a start; over CAN, the foot reports it at once.
const START_DETECTION: Duration = Duration::from_secs(2);

/// Polling interval for a start.
const START_POLL: Duration = Duration::from_millis(5);

/// Response to a request: the bytes that were read, none after a write, or an abort code.
type Response = Result<Vec<u8>, u32>;

/// Client of one foot.
pub struct Client {
    link: Box<dyn Link>,
    decoder: LiveDecoder,
    /// Node addressed by SDO; `None` for the foot at the other end of a serial line.
    node: Option<NodeId>,
    sequence: u16,
    /// Newest emergencies of the foot, which arrive between responses.
    emergencies: VecDeque<Emergency>,
    /// Newest time on the foot's clock, µs; serial line only.
    clock_us: Option<u64>,
    /// Number of restarts of each node since its first message; of the foot of a serial line, under no node.
    starts: BTreeMap<Option<u8>, u32>,
    /// Nodes that have started since the last [`Self::take_booted`].
    booted: Vec<NodeId>,
}

impl Client {
    /// Creates the client of a foot: on a bus, the given node, or the only foot.
    ///
    /// # Errors
    /// There is no foot, or there are several and no node is given.
    pub fn new(mut link: Box<dyn Link>, node: Option<NodeId>) -> Result<Self, RequestError> {
        let mut decoder = LiveDecoder::default();
        let node = match node {
            Some(node) => {
                decoder.add(node);
                Some(node)
            }
            None => {
                let found = scan::feet(link.as_mut(), &mut decoder, SCAN)?;
                let nodes: BTreeSet<_> = found.iter().filter_map(|key| key.node).collect();
                let is_serial = found.iter().any(|key| key.node.is_none());
                match (is_serial, nodes.len(), nodes.first()) {
                    (true, ..) => None,
                    (false, 1, Some(node)) => NodeId::new(*node),
                    // A foot on a serial line may wait in its bootloader for a program.
                    (false, 0, _) => {
                        let node = bootloader_node(link.as_mut(), &mut decoder)?;
                        Some(node.ok_or(RequestError::NoFoot)?)
                    }
                    (false, ..) => {
                        return Err(RequestError::SeveralFeet(nodes.into_iter().collect()));
                    }
                }
            }
        };
        Ok(Self {
            link,
            decoder,
            node,
            sequence: 0,
            emergencies: VecDeque::new(),
            clock_us: None,
            starts: BTreeMap::new(),
            booted: Vec::new(),
        })
    }

    /// Creates a client for each foot of a bus, or of the serial lines of simulated feet; with `node`, for this foot alone.
    /// The clients use the line in turn.
    ///
    /// # Errors
    /// There is no foot, or the line does not work.
    pub fn each(mut link: Box<dyn Link>, node: Option<NodeId>) -> Result<Vec<Self>, RequestError> {
        if node.is_some() {
            return Ok(vec![Self::new(link, node)?]);
        }
        let found = scan::feet(link.as_mut(), &mut LiveDecoder::default(), SCAN)?;
        if found.len() < 2 {
            return Ok(vec![Self::new(link, None)?]);
        }
        let line = SharedLine::new(link);
        let client = |key: FootKey| match key.node.and_then(NodeId::new) {
            Some(node) => Self::new(Box::new(line.clone()), Some(node)),
            None => Self::new(Box::new(line.of_port(key.line)), None),
        };
        found.into_iter().map(client).collect()
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

    /// Returns the name of the foot in messages.
    pub(super) fn foot(&self) -> String {
        match self.node {
            Some(node) => format!("node {}", node.get()),
            None => "the foot".to_owned(),
        }
    }

    /// Reads the serial number of the foot (object 0x1018:4).
    ///
    /// # Errors
    /// The request is refused, or there is no response.
    pub fn serial_number(&mut self) -> Result<u32, RequestError> {
        self.read_number(SERIAL_NUMBER.index, SERIAL_NUMBER.subindex)
    }

    /// Reads a number.
    ///
    /// # Errors
    /// The request is refused, there is no response, or the object has another type.
    pub fn read(&mut self, address: Address, data_type: DataType) -> Result<Value, RequestError> {
        let bytes = self.request(address, None, ANSWER)?;
        Value::from_bytes(data_type, &bytes).ok_or_else(|| RequestError::Type {
            address,
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

    /// Stores all settings in flash. The caller checks afterwards that the foot still had the written settings.
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

    /// Writes a signature, and repeats it if the foot refuses because its last store was too recent.
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
    pub fn command(&mut self, command: NmtCommand) -> Result<(), RequestError> {
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

    /// Returns the state that the foot reports next, in a heartbeat or a health message. A foot whose heartbeats
    /// are disabled is operational if it sends contacts.
    ///
    /// # Errors
    /// The foot reports no state.
    pub fn state(&mut self) -> Result<NmtState, RequestError> {
        let id = self.node().map(NodeId::get);
        let mut streams = false;
        let state = self.listen(SCAN, |message| match &message.body {
            MessageBody::Heartbeat(state) if message.foot.node == id => Some(*state),
            MessageBody::Board(board) if id.is_none() => Some(board.state),
            MessageBody::Contact(_) if id.is_some() && message.foot.node == id => {
                streams = true;
                None
            }
            _ => None,
        })?;
        let state = state.or(streams.then_some(NmtState::Operational));
        state.ok_or_else(|| self.no_answer(FootRequest::State))
    }

    /// Returns the foot to this state. The command to stream is repeated until the foot does: commands have no
    /// response, and frames may be lost.
    ///
    /// # Errors
    /// The foot does not stream.
    pub fn bring_to(&mut self, state: NmtState) -> Result<(), RequestError> {
        let command = match state {
            NmtState::Operational => NmtCommand::StartRemoteNode,
            NmtState::Stopped => NmtCommand::StopRemoteNode,
            NmtState::Initialising | NmtState::PreOperational => NmtCommand::EnterPreOperational,
        };
        if state != NmtState::Operational {
            return self.command(command);
        }
        let id = self.node().map(NodeId::get);
        for _ in 0..TRIES {
            self.command(command)?;
            let streams = self.listen(SCAN, |message| {
                let streams = match &message.body {
                    // On a serial line, a foot streams in the pre-operational state as well.
                    MessageBody::Board(board) => {
                        id.is_none() && board.state == NmtState::Operational
                    }
                    MessageBody::Contact(_) => id.is_some() && message.foot.node == id,
                    MessageBody::Heartbeat(state) => {
                        message.foot.node == id && *state == NmtState::Operational
                    }
                    _ => false,
                };
                streams.then_some(())
            })?;
            if streams.is_some() {
                return Ok(());
            }
        }
        Err(self.no_answer(FootRequest::Start))
    }

    /// Resets the foot, waits for its first response, and restores its previous state, because a commanded reset
    /// leaves it in the pre-operational state. `node` is its new id, if that changes.
    ///
    /// # Errors
    /// The foot does not restart, or does not respond within five seconds.
    pub fn restart(&mut self, node: Option<NodeId>) -> Result<(), RequestError> {
        let before = self.state()?;
        self.reset(node)?;
        self.bring_to(before)
    }

    /// Like [`Self::restart`], but the foot streams afterwards in any case, as after power-on.
    ///
    /// # Errors
    /// The errors of [`Self::restart`].
    pub fn restart_streaming(&mut self) -> Result<(), RequestError> {
        self.reset(None)?;
        self.bring_to(NmtState::Operational)
    }

    /// Resets the foot and waits for its first response; it is in the pre-operational state then. Commands have
    /// no response, and frames may be lost, so the command is repeated if the foot has not restarted.
    pub(super) fn reset(&mut self, node: Option<NodeId>) -> Result<(), RequestError> {
        // A foot whose stored id differs from its current id restarts with the stored id, so it is found by its serial
        // number.
        let serial = match node {
            Some(node) => {
                self.decoder.add(node);
                None
            }
            None => self.serial_number().ok(),
        };
        for _ in 0..TRIES {
            self.take_booted();
            self.command(NmtCommand::ResetNode)?;
            let has_started = self.detect_start(node, serial)?;
            if has_started || !self.is_there()? {
                if let Some(node) = node {
                    self.follow(node);
                }
                return self.first_answer();
            }
        }
        Err(self.no_answer(FootRequest::Reset { times: TRIES }))
    }

    /// Waits for a start of the foot: as the given node, or as any node with its serial number.
    fn detect_start(
        &mut self,
        node: Option<NodeId>,
        serial: Option<u32>,
    ) -> Result<bool, RequestError> {
        let before = self.starts();
        let clock = self.clock();
        let end = clock.now() + START_DETECTION;
        while clock.now() < end {
            self.wait(START_POLL)?;
            if self.starts() != before {
                return Ok(true);
            }
            let booted = self.take_booted();
            if node.is_some_and(|node| booted.contains(&node)) {
                return Ok(true);
            }
            for other in booted {
                if let Some(serial) = serial
                    && self.follow_if_serial_matches(other, serial)?
                {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// Returns whether the node has this serial number; if so, the client follows it.
    pub(super) fn follow_if_serial_matches(
        &mut self,
        node: NodeId,
        serial: u32,
    ) -> Result<bool, RequestError> {
        let Some(own) = self.node() else {
            return Ok(false);
        };
        self.follow(node);
        let is_foot = match self.serial_number() {
            Ok(other) => other == serial,
            Err(RequestError::NoAnswer { .. } | RequestError::Refused { .. }) => false,
            Err(error) => return Err(error),
        };
        if !is_foot {
            self.follow(own);
        }
        Ok(is_foot)
    }

    /// Returns whether the foot responds under its current id.
    fn is_there(&mut self) -> Result<bool, RequestError> {
        match self.serial_number() {
            Ok(_) => Ok(true),
            Err(RequestError::NoAnswer { .. }) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Waits for the first response of the foot after a start.
    pub(super) fn first_answer(&mut self) -> Result<(), RequestError> {
        let clock = self.clock();
        let end = clock.now() + FIRST_ANSWER;
        while !self.is_there()? {
            if clock.now() > end {
                return Err(self.no_answer(FootRequest::FirstAnswer { since: FIRST_ANSWER }));
            }
        }
        Ok(())
    }

    /// Checks that exactly one board responds.
    ///
    /// # Errors
    /// There is no response, or several boards have the same id.
    pub fn check_alone(&mut self) -> Result<(), RequestError> {
        let Some(node) = self.node else {
            return self.serial_number().map(|_| ());
        };
        let request @ [_, head @ .., _, _, _, _] = upload(SERIAL_NUMBER);
        let mut count = 0;
        // All responses within the timeout are counted.
        self.exchange(node, request, ANSWER, |response| {
            count += usize::from(response[1..4] == head);
            false
        })?;
        match count {
            // A frame may have been lost, so the request is repeated as a normal one.
            0 => self.serial_number().map(|_| ()),
            1 => Ok(()),
            count => Err(RequestError::SameId { foot: self.foot(), count }),
        }
    }

    /// Checks that no other board on the bus has the new id of this one; on a serial line, nothing is checked.
    ///
    /// # Errors
    /// Another board has the id.
    pub(super) fn check_free(&mut self, node: NodeId) -> Result<(), RequestError> {
        if self.node().is_none_or(|own| own == node) {
            return Ok(());
        }
        self.decoder.add(node);
        let taken = self.listen(SCAN, |message| {
            // A robot reports loads to absent feet as well.
            let is_load = matches!(message.body, MessageBody::Load(_));
            (message.foot.node == Some(node.get()) && !is_load).then_some(())
        })?;
        if taken.is_none() {
            return Ok(());
        }
        Err(RequestError::Taken { foot: self.foot(), node })
    }

    /// Returns the feet with these serial numbers (object 0x1018:4), in their order and each once, among the nodes of a
    /// bus or the one foot of a serial line, which is `None`. Serial numbers stay with the boards when node ids change.
    ///
    /// # Errors
    /// No foot has one of the numbers, or the line does not work.
    pub fn with_serial_numbers(
        &mut self,
        feet: &[Option<NodeId>],
        wanted: &[u32],
    ) -> Result<Vec<Option<NodeId>>, RequestError> {
        let mut serials = Vec::new();
        for foot in feet {
            if let Some(node) = foot {
                self.follow(*node);
            }
            match self.serial_number() {
                Ok(serial) => serials.push((serial, *foot)),
                // The silent foot may have another serial number.
                Err(RequestError::NoAnswer { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        let mut found = Vec::new();
        for number in wanted {
            let foot = serials.iter().find(|(serial, _)| serial == number);
            let (_, foot) = foot.ok_or_else(|| RequestError::NoSerial {
                wanted: *number,
                found: serials.clone(),
            })?;
            if !found.contains(foot) {
                found.push(*foot);
            }
        }
        Ok(found)
    }

    /// Changes the node id of the foot, if it is connected over CAN.
    pub(super) fn follow(&mut self, node: NodeId) {
        if self.node.is_some() {
            self.node = Some(node);
            self.decoder.add(node);
        }
    }

    /// Switches to the bootloader, which is starting and must respond within `longest`. On a bus nothing changes: program
    /// and bootloader are one node.
    ///
    /// # Errors
    /// The bootloader does not respond, or the line does not work.
    pub(super) fn switch_to_bootloader(&mut self, longest: Duration) -> Result<(), RequestError> {
        if self.link.as_serial_line().is_none() {
            return Ok(());
        }
        let clock = self.clock();
        let end = clock.now() + longest;
        loop {
            if let Some(node) = bootloader_node(self.link.as_mut(), &mut self.decoder)? {
                self.node = Some(node);
                return Ok(());
            }
            if clock.now() > end {
                return Err(self.no_answer(FootRequest::Bootloader));
            }
        }
    }

    /// Switches to the program, which is starting.
    pub(super) fn switch_to_program(&mut self) {
        if let Some(line) = self.link.as_serial_line() {
            line.switch_to_program();
            self.node = None;
            self.clock_us = None;
        }
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
        mut find: impl FnMut(&FootMessage) -> Option<T>,
    ) -> Result<Option<T>, RequestError> {
        let clock = self.clock();
        let end = clock.now() + longest;
        while clock.now() < end {
            if let Some((at, arrival)) = self.link.receive(LISTEN)? {
                if let Some(node) = scan::boot_up(&arrival) {
                    self.booted.push(node);
                    *self.starts.entry(Some(node.get())).or_default() += 1;
                }
                // Unreadable arrivals are ignored.
                self.decoder.take(arrival, at);
            }
            while let Some(message) = self.decoder.next_message() {
                self.keep_emergency(&message);
                self.keep_clock(&message);
                if let Some(found) = find(&message) {
                    return Ok(Some(found));
                }
            }
        }
        Ok(None)
    }

    fn keep_emergency(&mut self, message: &FootMessage) {
        if let MessageBody::Emergency(emergency) = &message.body
            && self.node().map(NodeId::get) == message.foot.node
        {
            self.emergencies.truncate(MOST_EMERGENCIES - 1);
            self.emergencies.push_front(*emergency);
        }
    }

    /// Counts jumps back of the foot's clock on a serial line as restarts. A node of a bus reports each with a boot-up.
    fn keep_clock(&mut self, message: &FootMessage) {
        if self.node.is_some() {
            return;
        }
        let time = match &message.body {
            MessageBody::Contact(row) => row.timestamp,
            MessageBody::Board(board) => board.timestamp,
            MessageBody::Raw(raw) => raw.timestamp,
            _ => return,
        };
        let now_us = time.as_micros();
        let newest_us = self.clock_us.replace(now_us).unwrap_or(now_us);
        if newest_us > now_us.saturating_add(DISORDER_US) {
            *self.starts.entry(None).or_default() += 1;
        } else {
            self.clock_us = Some(newest_us.max(now_us));
        }
    }

    /// Returns the number of restarts of the foot since its first message, including restarts while another foot was
    /// followed.
    pub(super) fn starts(&self) -> u32 {
        let node = self.node.map(NodeId::get);
        self.starts.get(&node).copied().unwrap_or(0)
    }

    /// Returns the ids of the nodes that have started since the last call.
    pub(super) fn take_booted(&mut self) -> Vec<NodeId> {
        std::mem::take(&mut self.booted)
    }

    /// Returns the emergencies of the foot since the last call, newest first.
    pub(super) fn take_emergencies(&mut self) -> VecDeque<Emergency> {
        std::mem::take(&mut self.emergencies)
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

    /// Reads an object, or writes `value` to it. A request without a response is repeated, which is safe because all
    /// requests are idempotent. A read ignores late responses to writes, and
    /// a write ignores late responses to reads.
    pub(super) fn request(
        &mut self,
        address: Address,
        value: Option<Value>,
        answer: Duration,
    ) -> Result<Vec<u8>, RequestError> {
        let request = match value {
            None => FootRequest::Read(address),
            Some(_) => FootRequest::Write(address),
        };
        for attempt in 0..TRIES {
            // The node may still be in a transfer that a vanished master has begun, so the transfer is aborted.
            if attempt > 0
                && value.is_none()
                && let Some(node) = self.node
            {
                self.abort(node, address)?;
            }
            let response = match self.node {
                Some(node) => self.request_sdo(node, address, value, answer)?,
                None => self.request_serial(address, value, answer)?,
            };
            if let Some(response) = response {
                return response.map_err(|code| RequestError::refused(request, code));
            }
        }
        Err(self.no_answer(request))
    }

    fn request_serial(
        &mut self,
        address: Address,
        value: Option<Value>,
        answer: Duration,
    ) -> Result<Option<Response>, RequestError> {
        let message = match value {
            None => Message::ConfigGet(ConfigGet { address }),
            Some(value) => Message::ConfigSet(ConfigSet { address, value: value.into() }),
        };
        self.send_message(&message)?;
        self.listen(answer, |message| match &message.body {
            MessageBody::Answer(ConfigResponse { address: of, answer }) if *of == address => {
                match answer {
                    Answer::Value(bytes) if value.is_none() => Some(Ok(bytes.as_bytes().to_vec())),
                    Answer::Done if value.is_some() => Some(Ok(Vec::new())),
                    Answer::Refused(reason) => Some(Err(reason.code())),
                    Answer::Value(_) | Answer::Done => None,
                }
            }
            _ => None,
        })
    }

    pub(super) fn send_message(&mut self, message: &Message) -> Result<(), RequestError> {
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
    ) -> Result<Option<Response>, RequestError> {
        let mut request = upload(address);
        if let Some(value) = value {
            // Expedited, with the number of unused bytes.
            let size = value.data_type().size().unwrap_or(4);
            request[0] = 0x23 | ((4 - size) as u8) << 2;
            request[4..].copy_from_slice(&value.to_raw().to_le_bytes());
        }
        let wanted = value.map_or(UPLOADED, |_| DOWNLOADED);
        let is_answer = |response: &[u8; 8]| {
            response[1..4] == request[1..4] && [wanted, ABORTED].contains(&(response[0] >> 5))
        };
        let response = self.exchange(node, request, answer, is_answer)?;
        let Some([head, _, _, _, data @ ..]) = response else {
            return Ok(None);
        };
        Ok(match head >> 5 {
            ABORTED => Some(Err(u32::from_le_bytes(data))),
            DOWNLOADED => Some(Ok(Vec::new())),
            // Expedited, or in segments.
            UPLOADED if head & 2 != 0 => {
                let length = 4 - usize::from(head >> 2 & 3);
                Some(Ok(data[..length].to_vec()))
            }
            _ => self.segments(node, answer)?.map(Ok),
        })
    }

    /// Reads the segments of an upload.
    fn segments(
        &mut self,
        node: NodeId,
        answer: Duration,
    ) -> Result<Option<Vec<u8>>, RequestError> {
        let mut bytes = Vec::new();
        let mut toggle = 0;
        loop {
            let request = [0x60 | toggle, 0, 0, 0, 0, 0, 0, 0];
            let is_next = |[head, ..]: &[u8; 8]| head >> 5 == 0 && head & 0x10 == toggle;
            let Some([head, data @ ..]) = self.exchange(node, request, answer, is_next)? else {
                return Ok(None);
            };
            let length = 7 - usize::from(head >> 1 & 7);
            bytes.extend_from_slice(&data[..length]);
            if head & 1 != 0 {
                return Ok(Some(bytes));
            }
            toggle ^= 0x10;
        }
    }

    pub(super) fn exchange(
        &mut self,
        node: NodeId,
        request: [u8; 8],
        answer: Duration,
        mut is_answer: impl FnMut(&[u8; 8]) -> bool,
    ) -> Result<Option<[u8; 8]>, RequestError> {
        self.send_sdo(node, request)?;
        let id = Some(node.get());
        self.listen(answer, |message| match &message.body {
            MessageBody::Sdo(bytes) if message.foot.node == id && is_answer(bytes) => Some(*bytes),
            _ => None,
        })
    }

    /// Aborts a transfer whose response is missing.
    pub(super) fn abort(&mut self, node: NodeId, address: Address) -> Result<(), RequestError> {
        let mut request = upload(address);
        request[0] = 0x80;
        request[4..].copy_from_slice(&TIMED_OUT.to_le_bytes());
        self.send_sdo(node, request)
    }

    /// Sends a frame of the SDO client, without waiting for a response.
    pub(super) fn send_sdo(&mut self, node: NodeId, request: [u8; 8]) -> Result<(), RequestError> {
        if let Some(frame) = CanFrame::new(node.cob_id(cob_id::SDO_REQUEST), &request) {
            self.link.send(&Sending::Frame(frame))?;
        }
        Ok(())
    }

    /// Creates the error of a request without a response.
    pub(super) fn no_answer(&self, request: FootRequest) -> RequestError {
        RequestError::NoAnswer { foot: self.foot(), request }
    }
}

/// Returns the id with which a bootloader responds on a serial line; `None` if none responds.
fn bootloader_node(
    link: &mut dyn Link,
    decoder: &mut LiveDecoder,
) -> Result<Option<NodeId>, RequestError> {
    let Some(line) = link.as_serial_line() else {
        return Ok(None);
    };
    match line.switch_to_bootloader() {
        Ok(()) => {}
        Err(LinkError::Adapter { .. }) => return Ok(None),
        Err(error) => return Err(error.into()),
    }
    let feet = scan::feet(link, decoder, SCAN)?;
    let node = feet.iter().find_map(|foot| foot.node);
    if let (None, Some(line)) = (node, link.as_serial_line()) {
        line.switch_to_program();
    }
    Ok(node.and_then(NodeId::new))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Arrival;
    use crate::link::Arrived;
    use estimator_core::Timestamp;

    /// Bus on which these nodes boot up, one after the other. Then the line ends.
    struct BootUps(VecDeque<NodeId>);

    impl Link for BootUps {
        fn receive(&mut self, _: Duration) -> Result<Option<Arrived>, LinkError> {
            let node = self.0.pop_front().ok_or_else(|| LinkError::Ended("can0".to_owned()))?;
            let frame = CanFrame::new(cob_id::HEARTBEAT + u16::from(node.get()), &[0]);
            let frame = frame.expect("it fits");
            Ok(Some((
                Timestamp::from_micros(0),
                Arrival::Frame { interface: "can0".into(), frame },
            )))
        }

        fn send(&mut self, _: &Sending) -> Result<(), LinkError> {
            Ok(())
        }
    }

    #[test]
    fn restarts_are_counted_for_each_node() {
        let [first, second] = [17, 18].map(|node| NodeId::new(node).expect("a node"));
        let bus = BootUps([first, second, second].into());
        let mut client = Client::new(Box::new(bus), Some(first)).expect("a node is given");
        // The bus ends after its last frame, long before this time.
        let ended = client.wait(Duration::from_secs(600));
        assert!(matches!(ended, Err(RequestError::Link(LinkError::Ended(_)))), "{ended:?}");
        assert_eq!(client.starts(), 1);
        client.follow(second);
        assert_eq!(client.starts(), 2);
        client.follow(first);
        assert_eq!(client.starts(), 1);
    }
}

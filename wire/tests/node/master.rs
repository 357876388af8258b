//! A node, and a master that communicates with it: the SDO client is another crate's.

use std::ops::{Deref, DerefMut};

use canopen_rs::sdo::{SdoClient, SdoEvent};
use canopen_rs::{DataType as PeerType, Value as PeerValue};
use estimator_core::{ContactEstimate, Timestamp};
use wire::node::{Due, Finished, NmtCommand, Published};
use wire::{AbortCode, Address, BootCause, CanFrame, DataType, Event, Outcome, Settings, Value};

pub const ID: u8 = 0x11;
pub const NOW: Timestamp = Timestamp::from_micros(5_000_000);

/// A node, with the values of its application.
pub struct Node {
    node: wire::Node,
    pub published: Published,
}

impl Node {
    pub fn new(settings: Settings, serial: u32) -> Self {
        let published = Published { temperature: 25.0, ..Published::default() };
        Self { node: wire::Node::new(settings, serial), published }
    }

    pub fn receive(&mut self, frame: &CanFrame) -> Outcome {
        self.node.receive(frame, NOW, &mut self.published)
    }

    pub fn read(&mut self, address: Address) -> Result<Value, AbortCode> {
        self.node.read(address, &mut self.published)
    }

    pub fn write(&mut self, address: Address, bytes: &[u8]) -> Result<Option<Event>, AbortCode> {
        self.node.write(address, bytes, &mut self.published)
    }

    pub fn tick(&mut self, send: impl FnMut(Due, CanFrame)) {
        self.node.tick(&self.published, send);
    }

    /// Completes the pending event, and returns the response to a master.
    pub fn answer(&mut self, result: Result<(), AbortCode>) -> Option<CanFrame> {
        match self.node.finish(result)? {
            Finished::Can(frame) => Some(frame),
            Finished::Written(address) => panic!("the application wrote {address:?}"),
        }
    }
}

impl Deref for Node {
    type Target = wire::Node;

    fn deref(&self) -> &wire::Node {
        &self.node
    }
}

impl DerefMut for Node {
    fn deref_mut(&mut self) -> &mut wire::Node {
        &mut self.node
    }
}

/// A node in pre-operational state.
pub fn node() -> Node {
    let mut node = Node::new(Settings::default(), 0xC0FFEE);
    node.boot(BootCause::PowerUp);
    node.command(NmtCommand::EnterPreOperational);
    node
}

pub fn send(node: &mut Node, id: u16, data: &[u8]) -> Outcome {
    node.receive(&CanFrame::new(id, data).expect("a frame"))
}

/// Ticks once, and returns the frames that were sent.
pub fn tick(node: &mut Node, estimate: &ContactEstimate) -> Vec<CanFrame> {
    let mut frames = Vec::new();
    node.published.estimate = *estimate;
    node.tick(|_, frame| frames.push(frame));
    frames
}

pub fn peer_type(data_type: DataType) -> PeerType {
    PeerType::from_index(data_type.index()).expect("the peer has the type")
}

pub fn peer_value(value: Value) -> PeerValue {
    match value {
        Value::I16(value) => PeerValue::Integer16(value),
        Value::U8(value) => PeerValue::Unsigned8(value),
        Value::U16(value) => PeerValue::Unsigned16(value),
        Value::U32(value) => PeerValue::Unsigned32(value),
        Value::F32(value) => PeerValue::Real32(value),
        Value::Text(text) => {
            PeerValue::VisibleString(canopen_rs::ByteString::from_str(text).expect("it fits"))
        }
    }
}

pub fn peer_address(address: Address) -> canopen_rs::Address {
    canopen_rs::Address::new(address.index, address.subindex)
}

/// Runs a request of the peer's client against the node until it completes.
pub fn exchange(
    node: &mut Node,
    client: &mut SdoClient,
    request: [u8; 8],
) -> (SdoEvent, Vec<Event>) {
    let (mut request, mut events) = (request, Vec::new());
    loop {
        let outcome = send(node, client.request_cob_id(), &request);
        events.extend(outcome.event);
        let reply = outcome.reply.or_else(|| node.answer(Ok(())));
        let reply = reply.expect("an answer");
        assert_eq!(reply.id(), client.response_cob_id());
        match client.on_response(reply.data8().expect("eight bytes")) {
            SdoEvent::Send(next) => request = next,
            over => return (over, events),
        }
    }
}

pub fn client() -> SdoClient {
    SdoClient::new(canopen_rs::NodeId::new(ID).expect("a node id"))
}

pub fn read(node: &mut Node, address: Address, data_type: DataType) -> Result<PeerValue, u32> {
    let mut client = client();
    let request = client.read(peer_address(address), peer_type(data_type));
    match exchange(node, &mut client, request).0 {
        SdoEvent::Complete(Some(value)) => Ok(value),
        SdoEvent::Aborted(code) => Err(code),
        other => panic!("{other:?}"),
    }
}

pub fn write(node: &mut Node, address: Address, value: Value) -> (Result<(), u32>, Vec<Event>) {
    let mut client = client();
    let request = client.write(peer_address(address), peer_value(value));
    let (over, events) = exchange(node, &mut client, request);
    let result = match over {
        SdoEvent::Complete(None) => Ok(()),
        SdoEvent::Aborted(code) => Err(code),
        other => panic!("{other:?}"),
    };
    (result, events)
}

/// Writes a value that the node accepts.
#[track_caller]
pub fn accepted(node: &mut Node, address: Address, value: Value) {
    assert_eq!(write(node, address, value).0, Ok(()));
}

pub fn refused(node: &mut Node, address: Address, value: Value) -> AbortCode {
    let (result, events) = write(node, address, value);
    assert_eq!(events, [], "a refused write causes an event");
    let code = result.expect_err("refused");
    AbortCode::from_code(code).expect("a known code")
}

/// Emergencies sent in N ticks.
pub fn emergencies(node: &mut Node, ticks: u32) -> Vec<[u8; 8]> {
    (0..ticks)
        .flat_map(|_| tick(node, &ContactEstimate::default()))
        .filter(|frame| frame.id() == 0x80 + u16::from(ID))
        .map(|frame| *frame.data8().expect("eight bytes"))
        .collect()
}

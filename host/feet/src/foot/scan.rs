//! Scan of a line for feet.
//!
//! A foot has the default id of its position unless another is set, and other devices may share the bus, so
//! the product code of every node that sends heartbeats is read.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use crate::decode::live::{FootKey, LiveDecoder, MessageBody, body_of};
use wire::dictionary::{PRODUCT_CODE, index};
use wire::foot::cob_id;
use wire::{Address, CanFrame, NodeId};

use crate::link::{Arrival, LISTEN, Link, LinkError, Sending};

/// Duration of a scan; a foot sends a contact every millisecond, and a heartbeat in any state twice a second.
pub const SCAN: Duration = Duration::from_millis(1200);

/// Response timeout of the request for the product code, and its number of attempts.
const ANSWER: Duration = Duration::from_millis(150);
const TRIES: u32 = 2;

/// Object of the product code.
const PRODUCT: Address = Address::new(index::IDENTITY, 2);

/// Returns the feet that send on a line within `time`, by line and id, and adds them to the decoder. A serial line
/// has one foot, whose id is `None`, and ends the scan early.
///
/// # Errors
/// The line does not work.
pub fn feet(
    link: &mut dyn Link,
    decoder: &mut LiveDecoder,
    time: Duration,
) -> Result<BTreeSet<FootKey>, LinkError> {
    let mut feet = BTreeSet::new();
    let mut others = BTreeMap::new();
    // A serial line has one foot. The feet of a demo's lines take turns, so all have been heard once one is heard
    // again.
    let mut is_heard_again = false;
    let clock = link.clock();
    let end = clock.now() + time;
    while clock.now() < end && !is_heard_again {
        if let Some((at, arrival)) = link.receive(LISTEN)? {
            others.extend(heartbeat(&arrival).map(|(node, line)| (node.get(), (node, line))));
            decoder.take(arrival, at);
        }
        let heard_before = feet.clone();
        while let Some(mut message) = decoder.next_message() {
            let is_serial = match &message.body {
                MessageBody::Raw(_)
                | MessageBody::Board(_)
                | MessageBody::Log(_)
                | MessageBody::Answer(_) => true,
                // Only contacts of a serial line have axes and all flags.
                MessageBody::Contact(row) => row.axes.is_some() && row.flags.is_some(),
                _ => false,
            };
            if is_serial {
                message.foot.node = None;
                is_heard_again |= heard_before.contains(&message.foot);
                feet.insert(message.foot);
                continue;
            }
            let line = &message.foot.line;
            if feet.iter().any(|foot: &FootKey| foot.node.is_none() && foot.line == *line) {
                continue;
            }
            // A load report is sent by the robot, not by a foot.
            if !matches!(message.body, MessageBody::Load(_)) {
                feet.insert(message.foot);
            }
        }
    }
    for (id, (node, line)) in others {
        let id = Some(id);
        match product_code(link, decoder, node)? {
            Some(PRODUCT_CODE) => {
                decoder.add(node);
                feet.insert(FootKey { line, node: id });
            }
            // An abort code is not a product code. A node that refuses the request is another device.
            Some(_) => feet.retain(|foot| foot.node != id),
            // A foot may be too busy to respond.
            None => {}
        }
    }
    Ok(feet)
}

/// Returns the node whose boot-up this is.
pub(super) fn boot_up(arrival: &Arrival) -> Option<NodeId> {
    let Arrival::Frame { frame, .. } = arrival else {
        return None;
    };
    let (node, body) = body_of(frame)?;
    matches!(body, MessageBody::BootUp(_)).then_some(node)
}

/// Returns the node whose heartbeat or boot-up this is, and its line.
fn heartbeat(arrival: &Arrival) -> Option<(NodeId, Arc<str>)> {
    let Arrival::Frame { interface, frame } = arrival else {
        return None;
    };
    let (node, body) = body_of(frame)?;
    let is_heartbeat = matches!(body, MessageBody::BootUp(_) | MessageBody::Heartbeat(_));
    is_heartbeat.then(|| (node, Arc::clone(interface)))
}

/// Reads the product code of a node, or the abort code of its refusal; `None` without a response.
fn product_code(
    link: &mut dyn Link,
    decoder: &mut LiveDecoder,
    node: NodeId,
) -> Result<Option<u32>, LinkError> {
    let request @ [_, head @ .., _, _, _, _] = upload(PRODUCT);
    let Some(request) = CanFrame::new(node.cob_id(cob_id::SDO_REQUEST), &request) else {
        return Ok(None);
    };
    let clock = link.clock();
    for _ in 0..TRIES {
        link.send(&Sending::Frame(request))?;
        let end = clock.now() + ANSWER;
        while clock.now() < end {
            let Some((at, arrival)) = link.receive(LISTEN)? else {
                continue;
            };
            if let Arrival::Frame { frame, .. } = &arrival
                && frame.id() == node.cob_id(cob_id::SDO_RESPONSE)
                && let Some([_, a, b, c, code @ ..]) = frame.data8()
                && [*a, *b, *c] == head
            {
                return Ok(Some(u32::from_le_bytes(*code)));
            }
            decoder.take(arrival, at);
        }
    }
    Ok(None)
}

/// Request to read an object by SDO.
pub(super) const fn upload(Address { index, subindex }: Address) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    [0x40, low, high, subindex, 0, 0, 0, 0]
}

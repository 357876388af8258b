//! Request and response: an SDO over CAN, a message over the serial line.

use std::time::Duration;

use decode::live::Said;
use wire::foot::cob_id;
use wire::uart::{Answer, ConfigGet, ConfigResponse, ConfigSet, Message, encode};
use wire::{Address, CanFrame, NodeId, Value};

use super::{Client, RequestError, TRIES, Way};
use crate::link::Sending;

/// Abort code for a response that has not come: SDO protocol timed out.
const TIMED_OUT: u32 = 0x0504_0000;

/// Response to a request.
pub(super) enum Came {
    Bytes(Vec<u8>),
    Done,
    /// Abort code.
    Refused(u32),
}

impl Client {
    /// Reads, or writes `value`. A request without a response is repeated; all requests are idempotent.
    pub(super) fn request(
        &mut self,
        address: Address,
        value: Option<Value>,
        answer: Duration,
        what: &dyn Fn() -> String,
    ) -> Result<Came, RequestError> {
        for attempt in 0..TRIES {
            // The node may be in the transfer of a master that has vanished.
            if attempt > 0
                && value.is_none()
                && let Way::Can(node) = self.way
            {
                self.abort(node, address)?;
            }
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
                Answer::Refused(reason) => Came::Refused(reason.code()),
            }),
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
    ) -> Result<Option<Came>, RequestError> {
        let [low, high] = address.index.to_le_bytes();
        let (command, data) = match value {
            None => (0x40, [0; 4]),
            // Expedited, with the number of unused bytes.
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
            4 => Came::Refused(u32::from_le_bytes(data)),
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

    pub(super) fn exchange(
        &mut self,
        node: NodeId,
        request: [u8; 8],
        answer: Duration,
        mut is_answer: impl FnMut(&[u8; 8]) -> bool,
    ) -> Result<Option<[u8; 8]>, RequestError> {
        self.send_sdo(node, request)?;
        let id = Some(node.get());
        self.listen(answer, |heard| match &heard.said {
            Said::Sdo(bytes) if heard.foot.node == id && is_answer(bytes) => Some(*bytes),
            _ => None,
        })
    }

    /// Ends a transfer whose response has not come.
    pub(super) fn abort(&mut self, node: NodeId, address: Address) -> Result<(), RequestError> {
        let [low, high] = address.index.to_le_bytes();
        let [a, b, c, d] = TIMED_OUT.to_le_bytes();
        self.send_sdo(node, [0x80, low, high, address.subindex, a, b, c, d])
    }

    /// Sends a frame of the SDO client, without waiting for a response.
    pub(super) fn send_sdo(&mut self, node: NodeId, request: [u8; 8]) -> Result<(), RequestError> {
        if let Some(frame) = CanFrame::new(node.cob_id(cob_id::SDO_REQUEST), &request) {
            self.link.send(&Sending::Frame(frame))?;
        }
        Ok(())
    }
}

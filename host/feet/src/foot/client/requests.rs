//! Request and response: an SDO over CAN, a message over the serial line.

use std::time::Duration;

use crate::decode::live::Said;
use wire::foot::cob_id;
use wire::uart::{Answer, ConfigGet, ConfigResponse, ConfigSet, Message, encode};
use wire::{Address, CanFrame, NodeId, Value};

use super::{Client, RequestError, TRIES, named};
use crate::foot::scan::upload;
use crate::link::Sending;

/// Abort code for a response that has not come: SDO protocol timed out.
const TIMED_OUT: u32 = 0x0504_0000;

/// Commands of an SDO server: the upper three bits of its response.
const UPLOADED: u8 = 2;
const DOWNLOADED: u8 = 3;
const ABORTED: u8 = 4;

/// Response to a request: the bytes that were read, none after a write, or an abort code.
type Response = Result<Vec<u8>, u32>;

impl Client {
    /// Reads, or writes `value`. A request without a response is repeated; all requests are idempotent. A read ignores late
    /// responses to writes, and a write those to reads.
    pub(super) fn request(
        &mut self,
        address: Address,
        value: Option<Value>,
        answer: Duration,
    ) -> Result<Vec<u8>, RequestError> {
        let verb = if value.is_some() { "writing" } else { "reading" };
        let what = || format!("{verb} {}", named(address));
        for attempt in 0..TRIES {
            // The node may be in the transfer of a master that has vanished.
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
                return response.map_err(|code| RequestError::refused(what(), code));
            }
        }
        Err(self.no_answer(format!("{}, asked {TRIES} times", what())))
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
        self.listen(answer, |heard| match &heard.said {
            Said::Answer(ConfigResponse { address: of, answer }) if *of == address => {
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
        self.listen(answer, |heard| match &heard.said {
            Said::Sdo(bytes) if heard.foot.node == id && is_answer(bytes) => Some(*bytes),
            _ => None,
        })
    }

    /// Ends a transfer whose response has not come.
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
}

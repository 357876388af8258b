//! Requests over UART: bytes become messages, messages become responses.
//!
//! [`UartReceiver`] runs with the UART, without a deadline. It finds frames, counts rejected ones and passes requests
//! on. [`answer`] runs in the tick that handles the request. It follows the rules of the object dictionary, as over
//! SDO.

use wire::node::Published;
use wire::uart::{Answer, ConfigGet, ConfigResponse, ConfigSet, Decoder, Message, NmtRequest};
use wire::{AbortCode, Address, Event, Node};

/// Decoder of requests from the bytes of the UART.
#[derive(Clone, Debug, Default)]
pub struct UartReceiver {
    decoder: Decoder,
    reported: u32,
}

impl UartReceiver {
    /// Creates a receiver before its first byte.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes a byte. Returns a request at the request's last byte.
    pub fn push(&mut self, byte: u8) -> Option<UartRequest> {
        let frame = self.decoder.push_request(byte)?.ok()?;
        match frame.message {
            Message::ConfigGet(get) => Some(UartRequest::Get(get)),
            Message::ConfigSet(set) => Some(UartRequest::Set(set)),
            Message::Nmt(request) => Some(UartRequest::Nmt(request)),
            _ => None,
        }
    }

    /// Returns the number of frames rejected since the last call, if any. Call it once for each piece of bytes, so that
    /// a flood of garbage does not cause a flood of reports.
    pub fn refused(&mut self) -> Option<u32> {
        let refused = self.decoder.drops().refused();
        let new = refused.wrapping_sub(self.reported);
        self.reported = refused;
        (new > 0).then_some(new)
    }
}

/// Request over UART: the kinds of a [`Message`] that a foot answers or executes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UartRequest {
    /// Read an object's value.
    Get(ConfigGet),
    /// Change an object's value.
    Set(ConfigSet),
    /// Change the NMT state.
    Nmt(NmtRequest),
}

/// Result of a request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UartReply {
    /// Response to send at once. A store or a restore is answered on completion.
    pub response: Option<ConfigResponse>,
    /// Event for the foot.
    pub event: Option<Event>,
}

/// Executes a request over UART.
pub fn answer(node: &mut Node, request: &UartRequest, published: &mut Published) -> UartReply {
    match request {
        UartRequest::Get(get) => {
            let answer = match node.read(get.address, published) {
                Ok(value) => Answer::Value(value.into()),
                Err(code) => Answer::Refused(code),
            };
            UartReply { response: Some(respond(get.address, answer)), event: None }
        }
        UartRequest::Set(set) => {
            let written = node.write(set.address, set.value.as_bytes(), published);
            let (answer, event) = match written {
                Ok(event) if event.is_some_and(Event::is_answered_later) => (None, event),
                Ok(event) => (Some(Answer::Done), event),
                Err(code) => (Some(Answer::Refused(code)), None),
            };
            UartReply { response: answer.map(|answer| respond(set.address, answer)), event }
        }
        UartRequest::Nmt(NmtRequest(command)) => {
            UartReply { response: None, event: node.command(*command) }
        }
    }
}

/// Response to a request at `address` that was [answered later](Event::is_answered_later).
#[must_use]
pub fn finished(address: Address, result: Result<(), AbortCode>) -> ConfigResponse {
    let answer = match result {
        Ok(()) => Answer::Done,
        Err(code) => Answer::Refused(code),
    };
    respond(address, answer)
}

const fn respond(address: Address, answer: Answer) -> ConfigResponse {
    ConfigResponse { address, answer }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;
    use wire::Value;
    use wire::node::NmtCommand;
    use wire::uart::{ContactMessage, encode};

    const GET: ConfigGet = ConfigGet { address: Address::new(0x2010, 0) };

    fn pushed(receiver: &mut UartReceiver, bytes: &[u8]) -> Vec<UartRequest> {
        bytes.iter().filter_map(|byte| receiver.push(*byte)).collect()
    }

    #[test]
    fn requests_pass_and_messages_of_a_foot_are_rejected() {
        let mut receiver = UartReceiver::new();
        let contact = Message::Contact(ContactMessage::default());
        let bytes = [encode(0, &contact), encode(1, &Message::ConfigGet(GET))];
        let bytes: Vec<u8> = bytes.iter().flat_map(|b| b.as_bytes().to_vec()).collect();
        assert_eq!(pushed(&mut receiver, &bytes), [UartRequest::Get(GET)]);
        assert_eq!(receiver.refused(), Some(1));
        assert_eq!(receiver.refused(), None);
    }

    #[test]
    fn a_damaged_request_is_rejected_and_the_next_one_passes() {
        let mut receiver = UartReceiver::new();
        let mut damaged = encode(0, &Message::ConfigGet(GET)).as_bytes().to_vec();
        damaged[6] ^= 1;
        assert_eq!(pushed(&mut receiver, &damaged), []);
        assert_eq!(receiver.refused(), Some(1));
        let sound = encode(1, &Message::ConfigGet(GET));
        assert_eq!(pushed(&mut receiver, sound.as_bytes()), [UartRequest::Get(GET)]);
    }

    #[test]
    fn each_kind_of_request_passes_unchanged() {
        let set = ConfigSet { address: GET.address, value: Value::U16(7).into() };
        let nmt = NmtRequest(NmtCommand::StartRemoteNode);
        for (message, request) in [
            (Message::ConfigGet(GET), UartRequest::Get(GET)),
            (Message::ConfigSet(set), UartRequest::Set(set)),
            (Message::Nmt(nmt), UartRequest::Nmt(nmt)),
        ] {
            let frame = encode(0, &message);
            let inputs = pushed(&mut UartReceiver::new(), frame.as_bytes());
            assert_eq!(inputs, [request]);
        }
    }
}

//! Messages through the ports: inputs to the foot, and its requests to the board.

use estimator_core::Timestamp;
use wire::foot::cob_id;
use wire::uart::{ConfigGet, ConfigSet, NmtRequest};
use wire::{CanFrame, Settings};

use storage::{Erase, Origin, StoreFailed};

/// Bits of an identifier that hold the node id.
const NODE_ID_BITS: u16 = 0x7F;

/// Input to the foot, handled on its next tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Input {
    /// A CAN frame, and its reception time on the clock of the samples.
    Can(CanFrame, Timestamp),
    /// A request over UART.
    Uart(UartRequest),
    /// Number of UART frames rejected.
    UartRefused(u32),
    /// Number of UART bytes lost.
    UartLost(u32),
    /// Minimum number of received CAN frames lost: a controller reports an overrun once, however
    /// many frames it lost before the report was read.
    CanLost(u32),
    /// Number of UART frames that could not be sent.
    UartDropped(u32),
    /// Number of CAN frames withdrawn because the bus took none.
    CanWithdrawn(u32),
    /// The CAN controller's state has changed.
    Bus(BusState),
    /// The result of [`Request::Store`] or [`Request::Restore`].
    Stored(Result<(), StoreFailed>),
    /// The result of [`Request::ProtectSupply`] or [`Request::ConfirmProgram`].
    Protected(Result<(), StoreFailed>),
}

impl Input {
    /// Returns whether the input is a request with a response. These take longest of all inputs, and have no
    /// deadline.
    #[must_use]
    pub fn needs_answer(&self) -> bool {
        match self {
            Self::Can(frame, _) => frame.id() & !NODE_ID_BITS == cob_id::SDO_REQUEST,
            Self::Uart(request) => !matches!(request, UartRequest::Nmt(_)),
            _ => false,
        }
    }
}

/// Request over UART: the kinds of a [`Message`](wire::uart::Message) that a foot answers or executes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UartRequest {
    /// Read an object's value.
    Get(ConfigGet),
    /// Change an object's value.
    Set(ConfigSet),
    /// Change the NMT state.
    Nmt(NmtRequest),
}

/// Settings that were loaded again.
#[derive(Clone, Debug, PartialEq)]
pub struct Reloaded {
    /// The settings.
    pub settings: Settings,
    /// Origin of the settings.
    pub origin: Origin,
}

/// State of the CAN controller on its bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusState {
    /// Error-active: few errors.
    Active,
    /// Error-passive, with the receive and the transmit error counter.
    Passive(u8, u8),
    /// Bus-off after too many errors, or unable to join a bus that is never idle. The board lets it
    /// recover at once.
    Off,
}

/// A request of the foot to the board.
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap to put it on, and a queue of two is small"
)]
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Store these settings, then [`put`](super::Ports::put) an [`Input::Stored`].
    Store(Settings, Erase),
    /// Delete the stored settings, then [`put`](super::Ports::put) an [`Input::Stored`].
    Restore(Erase),
    /// Set the highest brown-out level and protect the bootloader, then [`put`](super::Ports::put) an [`Input::Protected`].
    ProtectSupply,
    /// Keep the program that runs, if it is new, then [`put`](super::Ports::put) an [`Input::Protected`].
    ConfirmProgram,
    /// Restart into the bootloader once the answers to requests have been sent.
    StopProgram,
    /// Load the stored settings, apply their CAN and UART rates, and pass them to
    /// [`reload`](super::Ports::reload).
    Reload,
    /// Restart the whole board.
    Reset,
}

#[cfg(test)]
mod tests {
    use super::*;
    use wire::node::Command;
    use wire::{Address, Value};

    fn frame(id: u16) -> Input {
        let frame = CanFrame::new(id, &[]).expect("a frame");
        Input::Can(frame, Timestamp::from_micros(0))
    }

    #[test]
    fn only_requests_for_objects_need_an_answer() {
        let address = Address::new(0x2010, 0);
        let value = Value::U8(1).into();
        for answered in [
            frame(0x600),
            frame(0x67F),
            Input::Uart(UartRequest::Get(ConfigGet { address })),
            Input::Uart(UartRequest::Set(ConfigSet { address, value })),
        ] {
            assert!(answered.needs_answer(), "{answered:?}");
        }
        for silent in [
            frame(0x000),
            frame(0x080),
            frame(0x5FF),
            frame(0x680),
            frame(0x7E5),
            Input::Uart(UartRequest::Nmt(NmtRequest(Command::ResetNode))),
            Input::UartLost(1),
            Input::Stored(Ok(())),
        ] {
            assert!(!silent.needs_answer(), "{silent:?}");
        }
    }
}

//! Exchange of a foot with the rest of the program in a tick: [`Received`] goes in, an [`Outbox`] comes out.
//!
//! Both have a fixed size of some kilobytes. They are lent, because a move at each tick would cost more than the rest
//! of the tick.

use estimator_core::Timestamp;
use heapless::Vec;
use storage::{Erase, Origin, StoreFailed};
use wire::foot::cob_id;
use wire::uart::{Encoded, Message};
use wire::{CanFrame, Settings};

use crate::supervision::Worker;
use crate::uart_requests::UartRequest;

/// Maximum number of inputs handled per tick. Further inputs wait for the next tick.
pub const INPUTS_PER_TICK: usize = 8;

/// Exchange with the foot in both directions.
#[derive(Debug, Default)]
pub struct Exchange {
    /// Into the foot.
    pub received: Received,
    /// Out of the foot.
    pub outbox: Outbox,
}

impl Exchange {
    /// Creates an exchange without content.
    #[must_use]
    pub const fn new() -> Self {
        Self { received: Received::new(), outbox: Outbox::new() }
    }
}

/// Inputs and settings that have arrived since the previous tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Received {
    /// Inputs, in the order of their arrival.
    pub inputs: Vec<Input, INPUTS_PER_TICK>,
    /// Answer to [`Request::Reload`].
    pub reloaded: Option<Reloaded>,
}

impl Received {
    /// Creates it without content.
    #[must_use]
    pub const fn new() -> Self {
        Self { inputs: Vec::new(), reloaded: None }
    }

    /// Returns the inputs before the first request with a response, and the inputs from that request on.
    pub(crate) fn split(&self) -> (&[Input], &[Input]) {
        let first = self.inputs.iter().position(Input::needs_answer);
        let first = first.unwrap_or(self.inputs.len());
        self.inputs.split_at_checked(first).unwrap_or_default()
    }
}

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
    /// At least this number of received CAN frames was lost. A controller reports an overrun once, however many frames
    /// it lost before the report was read.
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
    Completed(Result<(), StoreFailed>),
}

impl Input {
    /// Returns whether the input is a request with a response. Such requests take longer than all other inputs, and have
    /// no deadline.
    #[must_use]
    pub fn needs_answer(&self) -> bool {
        match self {
            Self::Can(frame, _) => cob_id::split(frame.id()).0 == cob_id::SDO_REQUEST,
            Self::Uart(request) => !matches!(request, UartRequest::Nmt(_)),
            _ => false,
        }
    }
}

/// State of the CAN controller on its bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusState {
    /// Error-active: few errors.
    Active,
    /// Error-passive, with the receive and the transmit error counter.
    Passive(u8, u8),
    /// Bus-off after too many errors, or unable to join a bus that is never idle. The board lets the controller recover
    /// at once.
    Off,
}

/// Settings that were loaded again.
#[derive(Clone, Debug, PartialEq)]
pub struct Reloaded {
    /// The settings.
    pub settings: Settings,
    /// Origin of the settings.
    pub origin: Origin,
}

/// A request of the foot to the board.
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap to put it on, and a queue of two is small"
)]
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Store these settings; the result is [`Input::Stored`].
    Store(Settings, Erase),
    /// Delete the stored settings; the result is [`Input::Stored`].
    Restore(Erase),
    /// Set the highest brown-out level and protect the bootloader; the result is [`Input::Completed`].
    ProtectSupply,
    /// Confirm the running program, if it is new; the result is [`Input::Completed`].
    ConfirmProgram,
    /// Restart into the bootloader once the answers to requests have been sent.
    StopProgram,
    /// Load the stored settings, and apply their CAN and UART rates; the result is [`Received::reloaded`].
    Reload,
    /// Restart the whole board.
    Reset,
}

/// Maximum number of requests that a foot has waiting: one that is answered, and one to restart or to reload.
pub const REQUESTS: usize = 2;

/// Lane of an item. Notices go first, because they are rare. Estimates follow, so that no request delays them.
/// Responses go before the stream, which goes when nothing else waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// Rare reports of the foot itself: boot-up, heartbeat, faults. Goes first.
    Notice,
    /// The contact, each tick.
    Estimate,
    /// Responses to requests. Their number is unlimited.
    Answer,
    /// Periodic data.
    Stream,
}

impl Lane {
    /// All lanes, in the order in which they are sent.
    pub const ALL: [Self; 4] = [Self::Notice, Self::Estimate, Self::Answer, Self::Stream];
}

/// Numbers of frames that were dropped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// On the CAN bus.
    pub can: u32,
    /// On the serial line.
    pub uart: u32,
}

/// Frames and requests that a foot sends at once. Messages for the serial line are encoded in their place here, because
/// each move of a message would cost as much as its encoding. An item for which there is no room is dropped and counted.
#[derive(Clone, Debug)]
pub struct Outbox {
    can: Vec<(Lane, CanFrame), { Self::CAN }>,
    /// Frames, encoded in place. The first `uart_frames` are in use. The others are kept for the next use, because a new
    /// frame would have to be moved here, and a new array of all frames would be built on the stack.
    uart: Vec<UartFrame, { Self::UART }>,
    uart_frames: usize,
    requests: Vec<Request, REQUESTS>,
    alive: Vec<Worker, { Worker::ALL.len() }>,
    dropped: Dropped,
}

/// A frame for the serial line.
#[derive(Clone, Copy, Debug)]
pub struct UartFrame {
    /// Lane of the frame.
    pub lane: Lane,
    /// Bytes of the frame.
    pub encoded: Encoded,
}

impl UartFrame {
    const EMPTY: Self = Self { lane: Lane::Stream, encoded: Encoded::EMPTY };
}

impl Default for Outbox {
    fn default() -> Self {
        Self::new()
    }
}

impl Outbox {
    /// Creates an empty outbox.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            can: Vec::new(),
            uart: Vec::new(),
            uart_frames: 0,
            requests: Vec::new(),
            alive: Vec::new(),
            dropped: Dropped { can: 0, uart: 0 },
        }
    }

    /// Empties it.
    pub(crate) fn clear(&mut self) {
        self.can.clear();
        self.uart_frames = 0;
        self.requests.clear();
        self.alive.clear();
        self.dropped = Dropped::default();
    }

    /// Maximum number of frames for the CAN bus. It exceeds the room of a lane in the queues of [`Ports`](crate::Ports).
    pub const CAN: usize = 24;
    /// Maximum number of frames for the serial line. It exceeds the room of a lane, too.
    pub const UART: usize = 12;

    /// Frames for the CAN bus with their lanes, in the order in which they were made.
    #[must_use]
    pub fn can(&self) -> &[(Lane, CanFrame)] {
        &self.can
    }

    /// Frames for the serial line, in the order in which they were made.
    #[must_use]
    pub fn uart(&self) -> &[UartFrame] {
        self.uart.get(..self.uart_frames).unwrap_or(&[])
    }

    /// Requests to the board.
    #[must_use]
    pub fn requests(&self) -> &[Request] {
        &self.requests
    }

    /// Parts of the program that the foot knows to be alive.
    #[must_use]
    pub fn alive(&self) -> &[Worker] {
        &self.alive
    }

    /// Items for which there was no room.
    #[must_use]
    pub const fn dropped(&self) -> Dropped {
        self.dropped
    }

    // Neither this function nor the next is inlined, because copies at all places that send would take a kilobyte of
    // flash.
    #[inline(never)]
    pub(crate) fn push_can(&mut self, lane: Lane, frame: CanFrame) {
        self.dropped.can += u32::from(self.can.push((lane, frame)).is_err());
    }

    #[inline(never)]
    pub(crate) fn push_uart(&mut self, lane: Lane, sequence: u16, message: &Message) {
        if self.uart_frames == self.uart.len() {
            // All frames are in use, so one is added. If the array is full, `get_mut` below finds none.
            let _ = self.uart.push(UartFrame::EMPTY);
        }
        let Some(frame) = self.uart.get_mut(self.uart_frames) else {
            self.dropped.uart += 1;
            return;
        };
        frame.lane = lane;
        frame.encoded.write(sequence, message);
        self.uart_frames += 1;
    }

    pub(crate) fn request(&mut self, request: Request) {
        // The foot has at most `REQUESTS` waiting.
        let _ = self.requests.push(request);
    }

    pub(crate) fn report(&mut self, worker: Worker) {
        // Each worker reports once.
        let _ = self.alive.push(worker);
    }
}

#[cfg(test)]
mod tests {
    use wire::node::NmtCommand;
    use wire::uart::{ConfigGet, ConfigSet, NmtRequest};
    use wire::{Address, Value};

    use super::*;

    fn received(id: u16) -> Input {
        let frame = CanFrame::new(id, &[]).expect("a frame");
        Input::Can(frame, Timestamp::from_micros(0))
    }

    #[test]
    fn only_requests_for_objects_need_an_answer() {
        let address = Address::new(0x2010, 0);
        let value = Value::U8(1).into();
        for answered in [
            received(0x600),
            received(0x67F),
            Input::Uart(UartRequest::Get(ConfigGet { address })),
            Input::Uart(UartRequest::Set(ConfigSet { address, value })),
        ] {
            assert!(answered.needs_answer(), "{answered:?}");
        }
        for silent in [
            received(0x000),
            received(0x080),
            received(0x5FF),
            received(0x680),
            received(0x7E5),
            Input::Uart(UartRequest::Nmt(NmtRequest(NmtCommand::ResetNode))),
            Input::UartLost(1),
            Input::Stored(Ok(())),
        ] {
            assert!(!silent.needs_answer(), "{silent:?}");
        }
    }

    #[test]
    fn inputs_after_the_first_request_wait_for_its_answer() {
        let mut arrived = Received::default();
        for id in [0x080, 0x611, 0x000] {
            assert_eq!(arrived.inputs.push(received(id)), Ok(()));
        }
        let (at_once, later) = arrived.split();
        assert_eq!(at_once, [received(0x080)]);
        assert_eq!(later, [received(0x611), received(0x000)]);
    }

    #[test]
    fn a_full_outbox_counts_the_items_that_it_drops() {
        let mut outbox = Outbox::default();
        let frame = CanFrame::new(1, &[]).expect("a frame");
        for _ in 0..Outbox::CAN + 3 {
            outbox.push_can(Lane::Stream, frame);
        }
        let request = Message::Nmt(NmtRequest(NmtCommand::ResetNode));
        for _ in 0..Outbox::UART + 2 {
            outbox.push_uart(Lane::Answer, 0, &request);
        }
        assert_eq!((outbox.can().len(), outbox.uart().len()), (Outbox::CAN, Outbox::UART));
        assert_eq!(outbox.dropped(), Dropped { can: 3, uart: 2 });
    }
}

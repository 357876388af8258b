//! Queues between the sampling loop and everything slower.
//!
//! One `static PORTS: Ports` is the only state shared by the tasks of a board.
//!
//! | what | file |
//! |---|---|
//! | what passes through the queues | `message` |
//! | UART frames that share a transfer | `uart_batch` |

mod message;
mod uart_batch;

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use wire::CanFrame;
use wire::uart::{self, Encoded, Message};

use crate::costs::Costs;
use crate::outlet::{Lane, Outlet, Sink};
use crate::supervision::Liveness;

pub use message::{BusState, Input, Reloaded, Request, UartRequest};
pub use uart_batch::UartBatch;

/// With room for one contact, which the next one replaces: so a contact is never older than a tick when it is sent.
type UartQueue = Outlet<Encoded, 1, 8>;

/// Queues between the sampling loop and everything slower.
#[derive(Debug)]
pub struct Ports {
    can: Outlet<CanFrame, 16, 16>,
    uart: UartQueue,
    inputs: Channel<CriticalSectionRawMutex, Input, 16>,
    requests: Channel<CriticalSectionRawMutex, Request, 2>,
    reloaded: Channel<CriticalSectionRawMutex, Reloaded, 1>,
    /// Tasks that have reported since the watchdog was last fed.
    pub liveness: Liveness,
    /// Costs of the program so far.
    pub costs: Costs,
}

impl Default for Ports {
    fn default() -> Self {
        Self::new()
    }
}

impl Ports {
    /// Creates empty queues.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            can: Outlet::new(),
            uart: Outlet::new(),
            inputs: Channel::new(),
            requests: Channel::new(),
            reloaded: Channel::new(),
            liveness: Liveness::new(),
            costs: Costs::new(),
        }
    }

    /// Waits until there are frames for the CAN bus, or for [`call`](Self::call).
    pub async fn can_ready(&self) {
        self.can.ready().await;
    }

    /// Returns whether no frame is queued for the CAN bus.
    pub fn can_is_empty(&self) -> bool {
        self.can.is_empty()
    }

    /// Connects the CAN bus: `try_send` is offered each frame at once; frames it refuses are queued.
    pub fn connect_can(&self, try_send: Sink<CanFrame>) {
        self.can.connect(try_send);
    }

    /// Offers the queued frames to the bus, until it refuses the next of each lane.
    pub fn send_can(&self) {
        self.can.flush();
    }

    /// Withdraws the process data queued for the CAN bus; returns the number of frames.
    pub fn withdraw_can(&self) -> u32 {
        self.can.clear(Lane::Estimate) + self.can.clear(Lane::Stream)
    }

    /// Takes the next frame for the CAN bus, if there is one.
    pub fn try_next_can(&self) -> Option<CanFrame> {
        self.can.try_next()
    }

    /// Waits until there are frames for the UART, or for [`call`](Self::call).
    pub async fn uart_ready(&self) {
        self.uart.ready().await;
    }

    /// Fills `batch` with frames for the UART, and returns its bytes.
    pub fn take_uart<'a>(&self, batch: &'a mut UartBatch) -> &'a [u8] {
        batch.fill(&self.uart)
    }

    /// Takes the next frame for the UART, if there is one.
    pub fn try_next_uart(&self) -> Option<Encoded> {
        self.uart.try_next()
    }

    /// Wakes the tasks that empty the queues, so that they report their [`Liveness`].
    pub fn call(&self) {
        self.can.call();
        self.uart.call();
    }

    /// Waits for the next request of the foot.
    pub async fn next_request(&self) -> Request {
        self.requests.receive().await
    }

    /// Takes the next request of the foot, if there is one.
    pub fn try_next_request(&self) -> Option<Request> {
        self.requests.try_receive().ok()
    }

    /// Queues an input for the foot's next tick. Waits while the queue is full: excess input is
    /// lost, and counted, at its source.
    pub async fn put(&self, input: Input) {
        self.inputs.send(input).await;
    }

    /// Queues an input for the foot's next tick; `false` if the queue is full.
    pub fn try_put(&self, input: Input) -> bool {
        self.inputs.try_send(input).is_ok()
    }

    /// Answers [`Request::Reload`], in the place of an answer that the foot has not taken yet.
    pub fn reload(&self, reloaded: Reloaded) {
        self.reloaded.clear();
        // There is room now.
        let _ = self.reloaded.try_send(reloaded);
    }

    pub(crate) fn push_can(&self, lane: Lane, frame: CanFrame) -> u32 {
        self.can.push(lane, frame)
    }

    pub(crate) fn push_uart(&self, lane: Lane, sequence: u16, message: &Message) -> u32 {
        self.uart.push(lane, uart::encode(sequence, message))
    }

    pub(crate) fn request(&self, request: Request) -> bool {
        self.requests.try_send(request).is_ok()
    }

    pub(crate) fn take_input(&self) -> Option<Input> {
        // Most ticks have none, and a result with none is moved like one.
        if self.inputs.is_empty() { None } else { self.inputs.try_receive().ok() }
    }

    pub(crate) fn take_reloaded(&self) -> Option<Reloaded> {
        self.reloaded.try_receive().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u16) -> CanFrame {
        CanFrame::new(id, &[]).expect("a frame")
    }

    #[test]
    fn process_data_are_withdrawn_and_other_frames_stay() {
        let ports = Ports::new();
        assert!(ports.can_is_empty());
        for (id, lane) in (1..).zip([Lane::Stream, Lane::Answer, Lane::Estimate, Lane::Notice]) {
            assert_eq!(ports.push_can(lane, frame(id)), 0);
            ports.push_can(lane, frame(id));
        }
        ports.push_can(Lane::Stream, frame(1));
        assert!(!ports.can_is_empty());
        assert_eq!(ports.withdraw_can(), 5);
        let left = core::iter::from_fn(|| ports.try_next_can());
        assert!(left.map(|frame| frame.id()).eq([4, 4, 2, 2]));
        assert!(ports.can_is_empty());
    }

    #[test]
    fn the_bus_gets_new_frames_first_and_queued_ones_on_request() {
        let ports = Ports::new();
        ports.push_can(Lane::Notice, frame(1));
        ports.connect_can(|frame| frame.id() < 3);
        ports.push_can(Lane::Answer, frame(2));
        ports.push_can(Lane::Stream, frame(3));
        ports.send_can();
        assert_eq!(ports.try_next_can(), Some(frame(3)));
        assert!(ports.can_is_empty());
    }

    #[test]
    fn a_call_ends_the_wait_of_both_sending_tasks() {
        use core::pin::pin;
        use core::task::{Context, Waker};
        let ports = Ports::new();
        let are_ready = || {
            let mut context = Context::from_waker(Waker::noop());
            let can = pin!(ports.can_ready()).poll(&mut context).is_ready();
            (can, pin!(ports.uart_ready()).poll(&mut context).is_ready())
        };
        assert_eq!(are_ready(), (false, false));
        ports.call();
        assert_eq!(are_ready(), (true, true));
        assert_eq!(are_ready(), (false, false));
    }
}

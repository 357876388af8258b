//! Queues between the sampling loop and everything slower.
//!
//! One `static PORTS: Ports` is the only state shared by the tasks of a board. Inputs wait for the foot's next tick,
//! which [receives](Ports::receive) them. What the foot [sends](Ports::send) leaves through four [lanes](Lane). A frame
//! for the CAN bus goes into a [mailbox](Mailboxes) at once if one is free. Frames for the UART share
//! [transfers](UartBatch). Requests of the foot wait for the thread level.

use core::cell::RefCell;
use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, Ordering};
use core::task::Poll;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_sync::waitqueue::WakerRegistration;
use heapless::deque::{Deque, DequeView};
use wire::CanFrame;
use wire::uart;

use crate::exchange::{
    Dropped, Input, Lane, Outbox, REQUESTS, Received, Reloaded, Request, UartFrame,
};
use crate::supervision::{CostMeter, Light, Liveness};
use crate::uart_requests::UartReceiver;

/// Queue with room for one contact. The next contact replaces a queued one, so a contact is never older than a tick
/// when it is sent.
type UartQueue = Outlet<UartBytes, 1, 8>;

/// Bytes of a frame for the UART.
pub type UartBytes = heapless::Vec<u8, { uart::MAX_FRAME }>;

/// Queues between the sampling loop and everything slower, around the mailboxes `M` of a CAN controller.
#[derive(Debug)]
pub struct Ports<M = NoMailboxes> {
    mailboxes: M,
    can: Outlet<CanFrame, 16, 16>,
    uart: UartQueue,
    inputs: Channel<CriticalSectionRawMutex, Input, 16>,
    requests: Channel<CriticalSectionRawMutex, Request, REQUESTS>,
    reloaded: Channel<CriticalSectionRawMutex, Reloaded, 1>,
    /// Tasks that have reported since the watchdog was last fed.
    pub liveness: Liveness,
    /// Costs of the program so far.
    pub costs: CostMeter,
    /// State that the LED shows.
    pub light: Light,
    /// Whether a request has come over the UART since the start.
    has_had_request: AtomicBool,
}

/// The mailboxes of a CAN controller.
pub trait Mailboxes {
    /// Puts a frame into a mailbox. Returns `false` if no mailbox takes it. The frame is then queued, and
    /// [`Ports::send_can`] offers it again. The queue is locked during the call, so calls never overlap.
    fn try_send(&self, frame: &CanFrame) -> bool;
}

/// Takes the place of a missing controller. All frames are queued for a host. A [`Foot`](crate::Foot) without CAN queues
/// none.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoMailboxes;

impl Mailboxes for NoMailboxes {
    fn try_send(&self, _: &CanFrame) -> bool {
        false
    }
}

impl Default for Ports {
    fn default() -> Self {
        Self::new()
    }
}

impl Ports {
    /// Creates empty queues without a CAN controller.
    #[must_use]
    pub const fn new() -> Self {
        Self::with_mailboxes(NoMailboxes)
    }
}

impl<M> Ports<M> {
    /// Creates empty queues in front of the mailboxes of a CAN controller.
    #[must_use]
    pub const fn with_mailboxes(mailboxes: M) -> Self {
        Self {
            mailboxes,
            can: Outlet::new(),
            uart: Outlet::new(),
            inputs: Channel::new(),
            requests: Channel::new(),
            reloaded: Channel::new(),
            liveness: Liveness::new(),
            costs: CostMeter::new(),
            light: Light::new(),
            has_had_request: AtomicBool::new(false),
        }
    }
}

impl<M: Mailboxes> Ports<M> {
    /// Waits until there are frames for the CAN bus, or for [`wake_senders`](Self::wake_senders).
    pub async fn can_ready(&self) {
        self.can.ready().await;
    }

    /// Returns whether no frame is queued for the CAN bus.
    pub fn can_is_empty(&self) -> bool {
        self.can.is_empty()
    }

    /// Offers the queued frames to the mailboxes: lane by lane in the order of [`Lane::ALL`], each until the mailboxes
    /// refuse a frame.
    pub fn send_can(&self) {
        self.can.take_all(|_, frame| self.mailboxes.try_send(frame));
    }

    /// Withdraws the process data queued for the CAN bus; returns the number of frames.
    pub fn withdraw_can(&self) -> u32 {
        self.can.clear(Lane::Estimate) + self.can.clear(Lane::Stream)
    }

    /// Takes the next frame for the CAN bus, if there is one.
    pub fn try_next_can(&self) -> Option<CanFrame> {
        self.can.try_next()
    }

    /// Waits until there are frames for the UART, or for [`wake_senders`](Self::wake_senders).
    pub async fn uart_ready(&self) {
        self.uart.ready().await;
    }

    /// Fills `batch` with frames for the UART, and returns its bytes.
    pub fn take_uart<'a>(&self, batch: &'a mut UartBatch) -> &'a [u8] {
        batch.fill(&self.uart)
    }

    /// Takes the next frame for the UART, if there is one.
    pub fn try_next_uart(&self) -> Option<UartBytes> {
        self.uart.try_next()
    }

    /// Wakes the tasks that empty the queues, so that they report their [`Liveness`].
    pub fn wake_senders(&self) {
        self.can.wake();
        self.uart.wake();
    }

    /// Waits for the next request of the foot.
    pub async fn next_request(&self) -> Request {
        self.requests.receive().await
    }

    /// Takes the next request of the foot, if there is one.
    pub fn try_next_request(&self) -> Option<Request> {
        self.requests.try_receive().ok()
    }

    /// Queues an input for the foot's next tick. Waits while the queue is full. Excess input is lost at its source, and
    /// counted there.
    pub async fn put(&self, input: Input) {
        if let Input::Uart(_) = input {
            self.has_had_request.store(true, Ordering::Relaxed);
        }
        self.inputs.send(input).await;
    }

    /// Decodes bytes of the UART. Queues their requests and the number of rejected frames for the foot.
    pub async fn put_uart(&self, receiver: &mut UartReceiver, bytes: &[u8]) {
        for byte in bytes {
            if let Some(request) = receiver.push(*byte) {
                self.put(Input::Uart(request)).await;
            }
        }
        if let Some(refused) = receiver.refused() {
            self.put(Input::UartRefused(refused)).await;
        }
    }

    /// Returns whether a request has come over the UART since the start.
    pub fn has_had_request(&self) -> bool {
        self.has_had_request.load(Ordering::Relaxed)
    }

    /// Queues an input for the foot's next tick. Returns `false` if the queue is full.
    pub fn try_put(&self, input: Input) -> bool {
        self.inputs.try_send(input).is_ok()
    }

    /// Answers [`Request::Reload`]. Replaces an earlier answer that the foot has not taken yet.
    pub fn reload(&self, reloaded: Reloaded) {
        self.reloaded.clear();
        // The queue has room now.
        let _ = self.reloaded.try_send(reloaded);
    }

    /// Takes the inputs of a tick.
    pub fn receive(&self, received: &mut Received) {
        received.inputs.clear();
        // The check comes first, because most ticks have no input and moving an empty result costs as much as moving a
        // full one.
        while !self.inputs.is_empty()
            && !received.inputs.is_full()
            && let Ok(input) = self.inputs.try_receive()
        {
            // The push succeeds, because `inputs` is not full.
            let _ = received.inputs.push(input);
        }
        if received.reloaded.is_some() || !self.reloaded.is_empty() {
            received.reloaded = self.reloaded.try_receive().ok();
        }
    }

    /// Sends what a foot has put into its outbox. A frame for the CAN bus goes into a mailbox at once, or to the end of
    /// its lane. Returns the numbers of frames dropped.
    pub fn send(&self, outbox: &Outbox) -> Dropped {
        let mut dropped = outbox.dropped();
        for (lane, frame) in outbox.can() {
            dropped.can += self.push_can(*lane, *frame);
        }
        for UartFrame { lane, encoded } in outbox.uart() {
            dropped.uart += self.uart.push_with(*lane, |bytes| {
                // The item has room for the longest frame.
                let _ = bytes.extend_from_slice(encoded.as_bytes());
            });
        }
        for request in outbox.requests() {
            // The queue has room for all requests that a foot can have waiting.
            let _ = self.requests.try_send(request.clone());
        }
        for worker in outbox.alive() {
            self.liveness.report(*worker);
        }
        dropped
    }

    fn push_can(&self, lane: Lane, frame: CanFrame) -> u32 {
        self.can.send_or_push(lane, frame, |frame| self.mailboxes.try_send(frame))
    }
}

/// Frames sent to the serial line in one transfer: faults first, then the contact, then others. Together they have at
/// most [`BYTES`](Self::BYTES), unless the first is longer, the contact follows faults, or the line is crowded. The
/// next contact replaces the queued one, so a contact is never more than a tick old when it is sent.
#[derive(Debug, Default)]
pub struct UartBatch {
    bytes: heapless::Vec<u8, { uart::MAX_FRAME }>,
    /// Consecutive batches with a contact in which some lane had frames, but no room to send one.
    crowded: u8,
}

impl UartBatch {
    /// Maximum size of a batch of several frames, bytes. A contact and a raw sample, together 81 bytes, fit.
    ///
    /// A contact that is queued just after the start of a batch must be taken before the next tick begins. Otherwise
    /// its successor replaces it. At 1 Mbaud this size leaves the sender 120 µs of the tick to notice the end of a
    /// batch.
    pub const BYTES: usize = 88;

    /// Number of consecutive batches without room for any frame of a lane after which a batch may be as long as the
    /// longest frame. If that is not enough, the next batch goes without the contact. So a line filled by contacts
    /// still sends responses.
    ///
    /// Such a batch may last longer than a tick, and cost a contact. A line that keeps up never needs one, because each
    /// of its lanes sends a frame in a batch with the contact, or in the next batch without one.
    const CROWDED: u8 = 4;

    fn fill(&mut self, queue: &UartQueue) -> &[u8] {
        let without_contact = self.crowded > Self::CROWDED;
        let most = if self.crowded == Self::CROWDED { uart::MAX_FRAME } else { Self::BYTES };
        self.bytes.clear();
        let (mut with_contact, mut is_crowded) = (false, false);
        let mut sent = None;
        queue.take_all(|lane, frame| {
            let bytes = frame.as_slice();
            if lane == Lane::Estimate {
                if without_contact {
                    return false;
                }
                with_contact = true;
            } else if !self.bytes.is_empty() && self.bytes.len() + bytes.len() > most {
                is_crowded |= with_contact && sent != Some(lane);
                return false;
            }
            sent = Some(lane);
            self.bytes.extend_from_slice(bytes).is_ok()
        });
        self.crowded = if is_crowded { self.crowded + 1 } else { 0 };
        &self.bytes
    }
}

/// Outgoing frames: a bounded queue in which the newest item wins. It has room for `ESTIMATES` estimates, and for
/// `OTHERS` items in each other lane. A full lane drops its oldest item and counts it, so the sender never waits.
#[derive(Debug)]
struct Outlet<T, const ESTIMATES: usize, const OTHERS: usize>(
    Mutex<CriticalSectionRawMutex, RefCell<Lanes<T, ESTIMATES, OTHERS>>>,
);

#[derive(Debug)]
struct Lanes<T, const ESTIMATES: usize, const OTHERS: usize> {
    notices: Deque<T, OTHERS>,
    estimates: Deque<T, ESTIMATES>,
    answers: Deque<T, OTHERS>,
    stream: Deque<T, OTHERS>,
    /// Whether the task that empties the queue must wake up even if the queue is empty.
    called: bool,
    waker: WakerRegistration,
}

impl<T, const ESTIMATES: usize, const OTHERS: usize> Lanes<T, ESTIMATES, OTHERS> {
    fn lane(&mut self, lane: Lane) -> &mut DequeView<T> {
        match lane {
            Lane::Notice => &mut self.notices,
            Lane::Estimate => &mut self.estimates,
            Lane::Answer => &mut self.answers,
            Lane::Stream => &mut self.stream,
        }
    }

    fn push(&mut self, lane: Lane, item: T) -> u32 {
        let queue = self.lane(lane);
        let dropped = queue.is_full() && queue.pop_front().is_some();
        // The lane has room now.
        let _ = queue.push_back(item);
        self.waker.wake();
        u32::from(dropped)
    }

    /// Queues a new item, and lets `fill` write it in its place.
    fn push_with(&mut self, lane: Lane, fill: impl FnOnce(&mut T)) -> u32
    where
        T: Default,
    {
        let dropped = self.push(lane, T::default());
        if let Some(item) = self.lane(lane).back_mut() {
            fill(item);
        }
        dropped
    }

    fn is_empty(&mut self) -> bool {
        Lane::ALL.iter().all(|lane| self.lane(*lane).is_empty())
    }

    fn take_all(&mut self, mut take: impl FnMut(Lane, &T) -> bool) {
        for lane in Lane::ALL {
            let queue = self.lane(lane);
            while queue.front().is_some_and(|item| take(lane, item)) {
                queue.pop_front();
            }
        }
    }
}

impl<T, const ESTIMATES: usize, const OTHERS: usize> Outlet<T, ESTIMATES, OTHERS> {
    /// Creates an empty queue.
    const fn new() -> Self {
        Self(Mutex::new(RefCell::new(Lanes {
            notices: Deque::new(),
            estimates: Deque::new(),
            answers: Deque::new(),
            stream: Deque::new(),
            called: false,
            waker: WakerRegistration::new(),
        })))
    }

    fn with<R>(&self, use_lanes: impl FnOnce(&mut Lanes<T, ESTIMATES, OTHERS>) -> R) -> R {
        self.0.lock(|lanes| use_lanes(&mut lanes.borrow_mut()))
    }

    /// Queues a new item that `fill` writes in its place. Returns the number of items dropped for it. The queue is locked
    /// while `fill` is called.
    fn push_with(&self, lane: Lane, fill: impl FnOnce(&mut T)) -> u32
    where
        T: Default,
    {
        self.with(|lanes| lanes.push_with(lane, fill))
    }

    /// Sends an item at once if its lane is empty and `send` takes it. Otherwise queues it. Returns the number of items
    /// dropped for it. The queue is locked while `send` is called.
    fn send_or_push(&self, lane: Lane, item: T, send: impl FnOnce(&T) -> bool) -> u32 {
        self.with(|lanes| {
            if lanes.lane(lane).is_empty() && send(&item) {
                return 0;
            }
            lanes.push(lane, item)
        })
    }

    /// Offers the queued items to `take`: lane by lane in the order of [`Lane::ALL`], each until `take` refuses an
    /// item.
    fn take_all(&self, take: impl FnMut(Lane, &T) -> bool) {
        self.with(|lanes| lanes.take_all(take));
    }

    /// Takes the next item, if there is one.
    fn try_next(&self) -> Option<T> {
        self.with(|lanes| {
            let mut queues = Lane::ALL.into_iter();
            queues.find_map(|lane| lanes.lane(lane).pop_front())
        })
    }

    /// Returns whether the queue is empty.
    fn is_empty(&self) -> bool {
        self.with(Lanes::is_empty)
    }

    /// Waits for an item, or for [`wake`](Self::wake).
    async fn ready(&self) {
        poll_fn(|context| {
            self.with(|lanes| {
                if core::mem::take(&mut lanes.called) || !lanes.is_empty() {
                    return Poll::Ready(());
                }
                lanes.waker.register(context.waker());
                Poll::Pending
            })
        })
        .await;
    }

    /// Ends the wait in [`ready`](Self::ready), even if the queue is empty.
    fn wake(&self) {
        self.with(|lanes| {
            lanes.called = true;
            lanes.waker.wake();
        });
    }

    /// Empties a lane; returns the number of items dropped.
    fn clear(&self, lane: Lane) -> u32 {
        self.with(|lanes| {
            let queue = lanes.lane(lane);
            let dropped = queue.iter().count();
            queue.clear();
            dropped as u32
        })
    }
}

#[cfg(test)]
mod tests {
    use core::pin::pin;
    use core::sync::atomic::AtomicU16;
    use core::task::{Context, Waker};
    use std::vec::Vec;

    use estimator_core::Timestamp;
    use wire::node::NmtState;
    use wire::pdo::Quantity;
    use wire::uart::{ContactMessage, Decoder, LogMessage, MAX_LOG, Message};
    use wire::{Counters, Faults, Stage};

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
        /// Mailboxes that take frames with an identifier below a limit.
        #[derive(Default)]
        struct Below(AtomicU16);
        impl Mailboxes for Below {
            fn try_send(&self, frame: &CanFrame) -> bool {
                frame.id() < self.0.load(Ordering::Relaxed)
            }
        }
        let ports = Ports::with_mailboxes(Below::default());
        ports.push_can(Lane::Notice, frame(1));
        assert!(!ports.can_is_empty());
        ports.mailboxes.0.store(3, Ordering::Relaxed);
        ports.push_can(Lane::Answer, frame(2));
        ports.push_can(Lane::Stream, frame(3));
        ports.send_can();
        assert_eq!(ports.try_next_can(), Some(frame(3)));
        assert!(ports.can_is_empty());
    }

    #[test]
    fn waking_ends_the_wait_of_both_sending_tasks() {
        let ports = Ports::new();
        let are_ready = || {
            let mut context = Context::from_waker(Waker::noop());
            let can = pin!(ports.can_ready()).poll(&mut context).is_ready();
            (can, pin!(ports.uart_ready()).poll(&mut context).is_ready())
        };
        assert_eq!(are_ready(), (false, false));
        ports.wake_senders();
        assert_eq!(are_ready(), (true, true));
        assert_eq!(are_ready(), (false, false));
    }

    /// Sends one message; returns the number of frames dropped for it.
    fn push_uart(ports: &Ports, lane: Lane, sequence: u16, message: Message) -> u32 {
        let mut outbox = Outbox::default();
        outbox.push_uart(lane, sequence, &message);
        ports.send(&outbox).uart
    }

    fn contact(ports: &Ports, sequence: u16) -> u32 {
        push_uart(ports, Lane::Estimate, sequence, Message::Contact(ContactMessage::default()))
    }

    fn line(ports: &Ports, sequence: u16, length: usize) {
        let text = "x".repeat(length);
        push_uart(ports, Lane::Answer, sequence, Message::Log(LogMessage::new(1, &text)));
    }

    /// Sequence numbers and length of the next batch.
    fn taken(ports: &Ports, batch: &mut UartBatch) -> (Vec<u16>, usize) {
        let mut decoder = Decoder::new();
        let bytes = ports.take_uart(batch);
        let frames = bytes.iter().filter_map(|byte| decoder.push(*byte));
        let frames = frames.map(|frame| frame.expect("a sound frame").sequence);
        (frames.collect(), bytes.len())
    }

    #[test]
    fn the_newest_contact_goes_first_and_replaces_the_previous() {
        let (ports, mut batch) = (Ports::new(), UartBatch::default());
        line(&ports, 1, 20);
        assert_eq!(contact(&ports, 2), 0);
        assert_eq!(contact(&ports, 3), 1);
        assert_eq!(taken(&ports, &mut batch).0, [3, 1]);
        assert_eq!(taken(&ports, &mut batch).0, []);
    }

    #[test]
    fn several_frames_take_less_than_a_tick_and_one_may_exceed_it() {
        let (ports, mut batch) = (Ports::new(), UartBatch::default());
        for sequence in 0..4 {
            line(&ports, sequence, 30);
        }
        line(&ports, 4, MAX_LOG);
        let batches: Vec<_> = (0..4).map(|_| taken(&ports, &mut batch)).collect();
        let frames = batches.iter().flat_map(|(frames, _)| frames);
        assert!(frames.copied().eq(0..5));
        for (frames, bytes) in batches {
            assert!(frames.len() <= 1 || bytes <= UartBatch::BYTES);
        }
    }

    #[test]
    fn a_batch_of_exactly_the_maximum_is_one_transfer() {
        let (ports, mut batch) = (Ports::new(), UartBatch::default());
        line(&ports, 0, 30);
        let (_, first) = taken(&ports, &mut batch);
        let overhead = first - 30;
        for (excess, frames) in [(0, 2), (1, 1)] {
            let (ports, mut batch) = (Ports::new(), UartBatch::default());
            line(&ports, 0, 30);
            line(&ports, 1, UartBatch::BYTES - first - overhead + excess);
            assert_eq!(taken(&ports, &mut batch).0.len(), frames);
        }
    }

    #[test]
    fn a_line_that_fits_the_longest_batch_goes_with_the_contact() {
        let (ports, mut batch) = (Ports::new(), UartBatch::default());
        line(&ports, 1_000, 60);
        let mut rounds = (0..20).map(|round| {
            assert_eq!(contact(&ports, round), 0, "no contact is dropped");
            taken(&ports, &mut batch)
        });
        let (frames, bytes) = rounds.find(|(frames, _)| frames.contains(&1_000)).expect("it goes");
        assert_eq!(frames, [u16::from(UartBatch::CROWDED), 1_000]);
        assert!(bytes > UartBatch::BYTES);
    }

    #[test]
    fn contacts_that_fill_the_line_do_not_block_other_frames() {
        let (ports, mut batch) = (Ports::new(), UartBatch::default());
        line(&ports, 1_000, MAX_LOG);
        let rounds = (0..20).take_while(|round| {
            contact(&ports, *round);
            taken(&ports, &mut batch).0 != [1_000]
        });
        assert_eq!(rounds.count(), usize::from(UartBatch::CROWDED) + 1);
        // The next batch starts with the contact again.
        contact(&ports, 30);
        assert_eq!(taken(&ports, &mut batch).0, [30]);
    }

    /// Simulates a line at 1 Mbaud with all streams: each millisecond a contact and a raw sample, each tenth millisecond
    /// a health message, and now and then a response of `response` bytes. No frame is taken during the work of a tick,
    /// which lasts for `tick_us`. The sender notices the end of a transfer `late_us` after it. Returns the number of
    /// contacts dropped.
    fn dropped_contacts(response: usize, tick_us: u64, late_us: u64) -> u32 {
        const MILLISECOND: u64 = 1_000;
        const BYTE_US: u64 = 10;
        let (ports, mut batch) = (Ports::new(), UartBatch::default());
        let raw = Message::Raw(uart::RawMessage::default());
        let health = Message::Health(uart::HealthMessage {
            timestamp: Timestamp::from_micros(0),
            stage: Stage::Running,
            state: NmtState::Operational,
            id: None,
            faults: Faults::NONE,
            unknown_faults: 0,
            temperature: Quantity(0),
            counters: Counters::default(),
        });
        let (mut dropped, mut idle_at) = (0, 0);
        for tick in 0..400_u64 {
            let start = tick * MILLISECOND;
            dropped += contact(&ports, 0);
            push_uart(&ports, Lane::Stream, 0, raw);
            if tick.is_multiple_of(10) {
                push_uart(&ports, Lane::Stream, 0, health);
            }
            if tick % 100 % 37 == 10 {
                line(&ports, 0, response);
            }
            idle_at = idle_at.max(start + tick_us);
            while idle_at < start + MILLISECOND {
                let bytes = ports.take_uart(&mut batch).len() as u64;
                if bytes == 0 {
                    break;
                }
                idle_at += bytes * BYTE_US + late_us;
            }
        }
        dropped
    }

    #[test]
    fn full_line_keeps_all_contacts_of_a_late_sender() {
        /// Length of the longest line that fits into a batch with a contact. All responses fit.
        const LONGEST: usize = 37;
        // Work of a tick from the median under full load to twice the longest. With 500 µs the line is never idle.
        for tick_us in (140..=500).step_by(10) {
            for response in 1..=LONGEST {
                for late_us in [0, 100] {
                    let dropped = dropped_contacts(response, tick_us, late_us);
                    assert_eq!(dropped, 0, "{response}, {tick_us} µs, late by {late_us} µs");
                }
            }
        }
    }

    type Small = Outlet<u32, 2, 3>;

    fn push(outlet: &Small, lane: Lane, item: u32) -> u32 {
        outlet.push_with(lane, |place| *place = item)
    }

    fn drained(outlet: &Small) -> Vec<u32> {
        core::iter::from_fn(|| outlet.try_next()).collect()
    }

    #[test]
    fn a_full_lane_drops_and_counts_its_oldest_items() {
        let outlet = Small::new();
        let dropped: u32 = (0..10).map(|i| push(&outlet, Lane::Stream, i)).sum();
        assert_eq!(dropped, 7);
        assert_eq!(drained(&outlet), [7, 8, 9]);
    }

    #[test]
    fn answers_go_before_the_stream_and_are_not_dropped_for_it() {
        let outlet = Small::new();
        assert_eq!(push(&outlet, Lane::Stream, 1), 0);
        assert_eq!(push(&outlet, Lane::Answer, 100), 0);
        for i in 2..50 {
            push(&outlet, Lane::Stream, i);
        }
        assert_eq!(drained(&outlet), [100, 47, 48, 49]);
    }

    #[test]
    fn estimates_go_before_any_number_of_answers() {
        let outlet = Small::new();
        for answer in 100..150 {
            push(&outlet, Lane::Answer, answer);
        }
        push(&outlet, Lane::Estimate, 1);
        push(&outlet, Lane::Notice, 7);
        assert_eq!(drained(&outlet), [7, 1, 147, 148, 149]);
    }

    #[test]
    fn an_item_sent_at_once_never_overtakes_its_own_lane() {
        let outlet = Small::new();
        push(&outlet, Lane::Stream, 2);
        let sent = |lane, item| assert_eq!(outlet.send_or_push(lane, item, |_| true), 0);
        sent(Lane::Stream, 3);
        sent(Lane::Answer, 4);
        assert_eq!(drained(&outlet), [2, 3]);
        sent(Lane::Stream, 1);
        assert_eq!(drained(&outlet), []);
    }

    #[test]
    fn an_item_that_is_refused_lets_the_next_lane_pass() {
        let outlet = Small::new();
        push(&outlet, Lane::Estimate, 1);
        push(&outlet, Lane::Answer, 100);
        push(&outlet, Lane::Stream, 101);
        outlet.take_all(|_, item| *item >= 100);
        assert_eq!(drained(&outlet), [1]);
    }

    #[test]
    fn the_wait_ends_with_an_item_or_once_when_woken() {
        let outlet = Small::new();
        let is_ready = || {
            let mut context = Context::from_waker(Waker::noop());
            pin!(outlet.ready()).poll(&mut context).is_ready()
        };
        assert!(!is_ready());
        outlet.wake();
        assert!(is_ready());
        assert!(!is_ready());
        push(&outlet, Lane::Stream, 1);
        assert!(is_ready() && is_ready() && !outlet.is_empty());
    }

    #[test]
    fn a_cleared_lane_is_counted_and_the_others_stay() {
        let outlet = Small::new();
        for i in 0..5 {
            push(&outlet, Lane::Stream, i);
        }
        push(&outlet, Lane::Answer, 100);
        assert_eq!(outlet.clear(Lane::Stream), 3);
        push(&outlet, Lane::Stream, 9);
        assert_eq!(drained(&outlet), [100, 9]);
    }
}

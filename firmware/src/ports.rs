//! Where the sampling loop meets everything slower: queues, and nothing else.
//!
//! One `static PORTS: Ports<CriticalSectionRawMutex>` is all that the tasks of a board share.

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::channel::Channel;
use estimator_core::Timestamp;
use wire::foot::cob_id;
use wire::uart::{self, Payload};
use wire::{AbortCode, CanFrame, Settings};

use crate::commands::Question;
use crate::storage::Origin;
use crate::supervision::Progress;
use crate::telemetry::{Lane, Outlet};

/// Bits of an identifier that are a node's id.
const NODE_ID_BITS: u16 = 0x7F;

/// Something for the foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Input {
    /// A CAN frame, and when it came, on the clock of the samples.
    Can(CanFrame, Timestamp),
    /// A request over UART.
    Uart(Question),
    /// This many UART frames were refused.
    UartRefused(u32),
    /// This many bytes of the UART were lost.
    UartLost(u32),
    /// At least this many received CAN frames were lost: a controller tells once that there was no
    /// room, however many came before somebody looked.
    CanLost(u32),
    /// This many UART frames could not be sent.
    UartDropped(u32),
    /// This many CAN frames were given up because the bus took nothing.
    CanWithdrawn(u32),
    /// What the CAN controller says of the bus.
    Bus(BusState),
    /// What came of [`Request::Store`] or [`Request::Restore`].
    Stored(Result<(), StoreFailed>),
    /// What came of [`Request::ProtectSupply`].
    Protected(Result<(), StoreFailed>),
}

impl Input {
    /// Whether somebody waits for an answer to it: what takes longest of all inputs, and least hurry.
    #[must_use]
    pub fn wants_answer(&self) -> bool {
        match self {
            Self::Can(frame, _) => frame.id() & !NODE_ID_BITS == cob_id::SDO_REQUEST,
            Self::Uart(question) => !matches!(question, Question::Nmt(_)),
            _ => false,
        }
    }
}

/// Why the settings, or the brown-out level, could not be written. What was there before still is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreFailed {
    /// The flash refused, or did not hold what was written.
    Flash,
    /// The supply is too low to write flash.
    SupplyLow,
    /// A page must be erased first, which was not allowed.
    NeedsErase,
}

impl StoreFailed {
    /// What the one who asked is told.
    #[must_use]
    pub const fn abort_code(self) -> AbortCode {
        match self {
            Self::Flash | Self::SupplyLow => AbortCode::Hardware,
            Self::NeedsErase => AbortCode::DeviceState,
        }
    }
}

/// Whether a page of flash may be erased. Meanwhile, for half a second at most, the foot does
/// nothing else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Erase {
    /// It may.
    Allowed,
    /// It may not: the foot is streaming.
    Refused,
}

/// Settings that were loaded again.
#[derive(Clone, Debug, PartialEq)]
pub struct Reloaded {
    /// They.
    pub settings: Settings,
    /// Where they come from.
    pub origin: Origin,
}

/// What a CAN controller thinks of its bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusState {
    /// All is well.
    Active,
    /// Many errors: receive and transmit error counter.
    Passive(u8, u8),
    /// Too many errors, the controller has left the bus, or it cannot join one that is never idle.
    /// It is to be brought back at once.
    Off,
}

/// A CAN controller that sends a frame at once, or says `false`: not now. It is called with the
/// queue for CAN locked, so never twice at the same time.
pub type Bus = fn(&CanFrame) -> bool;

/// Something the foot wants done.
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap to put it on, and a queue of two is small"
)]
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Request {
    /// Keep these settings, then [`Ports::put`] an [`Input::Stored`].
    Store(Settings, Erase),
    /// Forget the kept settings, then [`Ports::put`] an [`Input::Stored`].
    Restore(Erase),
    /// Set the highest brown-out level, then [`Ports::put`] an [`Input::Protected`].
    ProtectSupply,
    /// Load the kept settings, hand them to [`Ports::reload`], and take up their CAN and UART
    /// rates.
    Reload,
    /// Restart the whole board.
    Reset,
}

/// Frames that go to the serial line in one piece: faults first, the contact, then others, not more than
/// [`BYTES`](Self::BYTES) together. A contact is never more than a tick old when its turn comes: the
/// next one takes its place in the queue.
#[derive(Debug)]
pub struct UartBatch {
    bytes: [u8; uart::MAX_FRAME],
    /// Batches in a row with a contact that had no room for all that waited.
    crowded: u8,
}

impl UartBatch {
    /// The most bytes of more than one frame: less than a tick takes at 1 Mbaud, so that no contact
    /// is dropped there, and enough for a contact and a raw sample.
    pub const BYTES: usize = 96;

    /// After so many batches without room for all that waits, one may be as long as the longest frame,
    /// and where that is not enough either, one goes without the contact: a line that contacts alone
    /// fill still answers.
    const CROWDED: u8 = 4;

    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bytes: [0; uart::MAX_FRAME],
            crowded: 0,
        }
    }

    fn fill<M: RawMutex>(&mut self, queue: &UartQueue<M>) -> &[u8] {
        let without_contact = self.crowded > Self::CROWDED;
        let most = match self.crowded == Self::CROWDED {
            true => uart::MAX_FRAME,
            false => Self::BYTES,
        };
        let (mut used, mut with_contact, mut crowded) = (0, false, 0);
        queue.take_all(|lane, frame| {
            let bytes = frame.as_bytes();
            let end = used + bytes.len();
            if lane == Lane::Estimate {
                if without_contact {
                    return false;
                }
                with_contact = true;
            } else if used > 0 && end > most {
                crowded = if with_contact { self.crowded + 1 } else { 0 };
                return false;
            }
            let Some(place) = self.bytes.get_mut(used..end) else {
                return false;
            };
            place.copy_from_slice(bytes);
            used = end;
            true
        });
        self.crowded = crowded;
        self.bytes.get(..used).unwrap_or_default()
    }
}

impl Default for UartBatch {
    fn default() -> Self {
        Self::new()
    }
}

/// With a few lines about faults, and one contact: the next one makes it worthless, so none is older than
/// a tick when its turn comes.
type UartQueue<M> = Outlet<M, uart::Encoded, 4, 1, 8, 8>;

/// The queues between the sampling loop and everything slower.
#[derive(Debug)]
pub struct Ports<M: RawMutex> {
    can: Outlet<M, CanFrame, 16, 16, 16, 16>,
    uart: UartQueue<M>,
    inputs: Channel<M, Input, 16>,
    requests: Channel<M, Request, 2>,
    reloaded: Channel<M, Reloaded, 1>,
    /// Who has got on since the watchdog was last fed.
    pub progress: Progress,
}

impl<M: RawMutex> Default for Ports<M> {
    fn default() -> Self {
        Self::new()
    }
}

impl<M: RawMutex> Ports<M> {
    /// Empty queues.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            can: Outlet::new(CanFrame::EMPTY),
            uart: Outlet::new(uart::Encoded::EMPTY),
            inputs: Channel::new(),
            requests: Channel::new(),
            reloaded: Channel::new(),
            progress: Progress::new(),
        }
    }

    /// Waits until there are frames for the CAN bus, or for [`call`](Self::call).
    pub async fn can_ready(&self) {
        self.can.ready().await;
    }

    /// Whether no frame waits for the CAN bus.
    pub fn can_is_empty(&self) -> bool {
        self.can.is_empty()
    }

    /// Has `bus` send the frames that wait, until it takes none of those that are next.
    pub fn send_can(&self, bus: Bus) {
        self.can.take_all(|_, frame| bus(frame));
    }

    /// Gives up the process data that wait for the CAN bus: how many frames those were.
    pub fn give_up_can(&self) -> u32 {
        self.can.clear(Lane::Estimate) + self.can.clear(Lane::Stream)
    }

    /// The next frame for the CAN bus, if there is one.
    pub fn try_next_can(&self) -> Option<CanFrame> {
        self.can.try_next()
    }

    /// Waits until there are frames for the UART, or for [`call`](Self::call).
    pub async fn uart_ready(&self) {
        self.uart.ready().await;
    }

    /// Fills `batch` with frames for the UART, and gives its bytes.
    pub fn take_uart<'a>(&self, batch: &'a mut UartBatch) -> &'a [u8] {
        batch.fill(&self.uart)
    }

    /// The next frame for the UART, if there is one.
    pub fn try_next_uart(&self) -> Option<uart::Encoded> {
        self.uart.try_next()
    }

    /// Has the tasks that empty the queues look up and report their [`Progress`], where they can.
    pub fn call(&self) {
        self.can.call();
        self.uart.call();
    }

    /// Waits for the next thing that the foot wants done.
    pub async fn next_request(&self) -> Request {
        self.requests.receive().await
    }

    /// The next thing that the foot wants done, if there is one.
    pub fn try_next_request(&self) -> Option<Request> {
        self.requests.try_receive().ok()
    }

    /// Gives the foot something, with its next tick. Waits while it has enough to do: what comes
    /// too fast is lost, and counted, where it comes from.
    pub async fn put(&self, input: Input) {
        self.inputs.send(input).await;
    }

    /// Gives the foot something at once; `false` where it has enough to do.
    pub fn try_put(&self, input: Input) -> bool {
        self.inputs.try_send(input).is_ok()
    }

    /// Answers [`Request::Reload`].
    pub async fn reload(&self, reloaded: Reloaded) {
        self.reloaded.send(reloaded).await;
    }

    pub(crate) fn push_can(&self, lane: Lane, frame: &CanFrame, bus: Bus) -> u32 {
        self.can.push(lane, frame, bus)
    }

    pub(crate) fn push_uart(&self, lane: Lane, sequence: u16, message: &impl Payload) -> u32 {
        self.uart.push_in_place(lane, |frame| {
            uart::encode_into(frame, sequence, message);
        })
    }

    pub(crate) fn request(&self, request: Request) -> bool {
        self.requests.try_send(request).is_ok()
    }

    pub(crate) fn take_input(&self) -> Option<Input> {
        // Mostly there is none, and nothing that is not there is moved about.
        if self.inputs.is_empty() {
            return None;
        }
        self.inputs.try_receive().ok()
    }

    pub(crate) fn take_reloaded(&self) -> Option<Reloaded> {
        if self.reloaded.is_empty() {
            return None;
        }
        self.reloaded.try_receive().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_sync::blocking_mutex::raw::NoopRawMutex;
    use std::vec::Vec;
    use wire::uart::{ContactMessage, Decoder, LogMessage, MAX_LOG};

    type Small = Ports<NoopRawMutex>;

    fn contact(ports: &Small, sequence: u16) -> u32 {
        ports.push_uart(Lane::Estimate, sequence, &ContactMessage::default())
    }

    fn line(ports: &Small, sequence: u16, length: usize) {
        let text = "x".repeat(length);
        ports.push_uart(Lane::Answer, sequence, &LogMessage::new(1, &text));
    }

    /// The sequence numbers of the next batch, and how long it is.
    fn taken(ports: &Small, batch: &mut UartBatch) -> (Vec<u16>, usize) {
        let mut decoder = Decoder::new();
        let bytes = ports.take_uart(batch);
        let frames = bytes.iter().filter_map(|byte| decoder.push(*byte));
        let frames = frames.map(|frame| frame.expect("a sound frame").sequence);
        (frames.collect(), bytes.len())
    }

    #[test]
    fn the_newest_contact_goes_first_and_the_one_before_is_dropped_and_counted() {
        let (ports, mut batch) = (Small::new(), UartBatch::new());
        line(&ports, 1, 20);
        assert_eq!(contact(&ports, 2), 0);
        assert_eq!(contact(&ports, 3), 1);
        assert_eq!(taken(&ports, &mut batch).0, [3, 1]);
        assert_eq!(taken(&ports, &mut batch).0, []);
    }

    #[test]
    fn several_frames_take_less_than_a_tick_and_one_may_be_longer() {
        let (ports, mut batch) = (Small::new(), UartBatch::new());
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
    fn a_line_that_fits_into_the_longest_batch_goes_with_the_contact() {
        let (ports, mut batch) = (Small::new(), UartBatch::new());
        line(&ports, 1_000, 60);
        let mut rounds = (0..20).map(|round| {
            assert_eq!(contact(&ports, round), 0, "no contact is dropped");
            taken(&ports, &mut batch)
        });
        let (frames, bytes) = rounds
            .find(|(frames, _)| frames.contains(&1_000))
            .expect("it goes");
        assert_eq!(frames, [u16::from(UartBatch::CROWDED), 1_000]);
        assert!(bytes > UartBatch::BYTES);
    }

    #[test]
    fn contacts_that_fill_the_line_do_not_keep_everything_else_waiting() {
        let (ports, mut batch) = (Small::new(), UartBatch::new());
        line(&ports, 1_000, MAX_LOG);
        let rounds = (0..20).take_while(|round| {
            contact(&ports, *round);
            taken(&ports, &mut batch).0 != [1_000]
        });
        assert_eq!(rounds.count(), usize::from(UartBatch::CROWDED) + 1);
        // Then it is the contact's turn again.
        contact(&ports, 30);
        assert_eq!(taken(&ports, &mut batch).0, [30]);
    }
}

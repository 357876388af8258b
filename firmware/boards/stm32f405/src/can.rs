//! CAN1, by its registers. The HAL leaves sleep mode with the bit timing of a reset, and so disturbs a bus in use.

use core::array;
use core::future::poll_fn;
use core::mem;
use core::ops::Range;
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use core::task::Poll;

use embassy_stm32::gpio::{AfType, AnyPin, Flex, OutputType, Pull, Speed};
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::{CAN1, can::regs};
use embassy_stm32::{Peri, peripherals, rcc};
use embassy_sync::waitqueue::AtomicWaker;
use embassy_time::{Duration, Timer};
use estimator_core::Timestamp;
use firmware::exchange::BusState;
use firmware::ports::Mailboxes;
use wire::CanFrame;
use wire::foot::cob_id;
use wire::pdo::{Load, Pdo};

use crate::wiring::CanParts;
use crate::{COMMUNICATION_PRIORITY, URGENT_PRIORITY, clocks, timebase};

/// Task that waits for a frame.
static FRAME_CAME: AtomicWaker = AtomicWaker::new();

/// Count of the timer when a frame was received.
static FRAME_CAME_AT: AtomicU32 = AtomicU32::new(0);

/// Task that waits for an empty mailbox.
static MAILBOX_FREED: AtomicWaker = AtomicWaker::new();

/// A frame was received.
#[embassy_stm32::interrupt]
fn CAN1_RX0() {
    FRAME_CAME_AT.store(timebase::count(), Ordering::Relaxed);
    // The interrupt is enabled again when a task waits for the next frame.
    CAN1.ier().modify(|w| w.set_fmpie(0, false));
    FRAME_CAME.wake();
    // See `Barrier`.
    cortex_m::asm::dsb();
}

/// A mailbox has become empty.
#[embassy_stm32::interrupt]
fn CAN1_TX() {
    CAN1.tsr().write(|w| {
        for mailbox in MAILBOXES {
            w.set_rqcp(mailbox, true);
        }
    });
    MAILBOX_FREED.wake();
    // See `Barrier`.
    cortex_m::asm::dsb();
}

/// Wait that outlasts the longest frame, because 160 bits at 125 kbit/s take 1.28 ms.
const FRAME: Duration = Duration::from_millis(2);

/// Whether the controller has joined a bus: see [`bus_state`].
static STARTED: AtomicBool = AtomicBool::new(false);

/// Settings of the controller.
pub struct Control {
    /// Owned, so that they stay connected.
    _pins: [Flex<'static>; 2],
}

/// Sending half.
pub struct Sender(());

/// Receiving half.
pub struct Receiver {
    /// Whether a frame was lost since [`take_overrun`](Self::take_overrun).
    overrun: bool,
}

impl CanParts {
    /// Joins the bus at `bit_rate`.
    pub fn start(self, bit_rate: u32) -> (Control, Sender, Receiver) {
        /// Alternate function of the pins (DS8626, table 9).
        const CAN_FUNCTION: u8 = 9;
        let connect = |pin: Peri<'static, AnyPin>, kind| {
            let mut pin = Flex::new(pin);
            pin.set_as_af_unchecked(CAN_FUNCTION, kind);
            pin
        };
        // Without a transceiver the bus then reads as idle instead of floating.
        let receive = connect(self.receive.into(), AfType::input(Pull::Up));
        let driven = AfType::output(OutputType::PushPull, Speed::VeryHigh);
        let transmit = connect(self.transmit.into(), driven);
        rcc::enable_and_reset::<peripherals::CAN1>();
        interrupt::CAN1_TX.set_priority(COMMUNICATION_PRIORITY);
        // The time of a SYNC must be that of its arrival, also in the middle of a tick.
        interrupt::CAN1_RX0.set_priority(URGENT_PRIORITY);
        // SAFETY: of the data that a lock protects, the handlers access only the register of their enables.
        unsafe {
            interrupt::CAN1_TX.enable();
            interrupt::CAN1_RX0.enable();
        }
        STARTED.store(true, Ordering::Release);
        let control = Control { _pins: [receive, transmit] };
        control.set_bit_rate(bit_rate);
        (control, Sender(()), Receiver { overrun: false })
    }
}

/// Time from the data-ready edge to a contact's mailbox, µs; 0 for none.
static TO_MAILBOX: AtomicU32 = AtomicU32::new(0);

/// Node id that the filters accept, 0 for none.
static LISTENING: AtomicU8 = AtomicU8::new(0);

/// Sets the node id that the filters accept, 0 for none. Later starts of the controller keep it.
pub fn listen_as(node: u8) {
    let changed = LISTENING.swap(node, Ordering::Relaxed) != node;
    if changed && STARTED.load(Ordering::Acquire) {
        set_filters();
    }
}

/// Accepts NMT, SYNC, TIME and LSS, and for the own node id RPDO1 and SDO requests. Frames of other feet and for other
/// nodes cost no instruction and take no place in the FIFO of three.
fn set_filters() {
    /// Returns a filter register in 16-bit list mode that accepts data frames with two identifiers (RM0090, 32.7.4).
    const fn both(first: u16, second: u16) -> u32 {
        (first as u32) << 5 | (second as u32) << 21
    }
    const BANKS: u32 = 0b11;
    critical_section::with(|_| {
        let node = u16::from(LISTENING.load(Ordering::Relaxed));
        // Only LSS reaches a node without an id.
        let own = if node == 0 {
            both(cob_id::LSS_MASTER, cob_id::LSS_MASTER)
        } else {
            both(Load::BASE + node, cob_id::SDO_REQUEST + node)
        };
        let all = [both(0x000, cob_id::SYNC), both(cob_id::TIME, cob_id::LSS_MASTER)];
        CAN1.fmr().modify(|w| w.set_finit(true));
        CAN1.fm1r().write(|w| w.0 = BANKS);
        for (bank, [low, high]) in [all, [own; 2]].into_iter().enumerate() {
            CAN1.fb(bank).fr1().write(|w| w.0 = low);
            CAN1.fb(bank).fr2().write(|w| w.0 = high);
        }
        CAN1.fa1r().write(|w| w.0 = BANKS);
        CAN1.fmr().modify(|w| w.set_finit(false));
    });
}

impl Control {
    /// Leaves the bus and joins it again at `bit_rate`, one of 125, 250, 500 and 1000 kbit/s.
    ///
    /// Does not wait. A bus that is never idle cannot be joined, and [`bus_state`] reports that.
    pub fn set_bit_rate(&self, bit_rate: u32) {
        if !initialise() {
            // A reset of the controller does not wait for the bus (RM0090, CAN_MCR.RESET).
            CAN1.mcr().write(|w| w.set_reset(true));
            if !initialise() {
                return;
            }
        }
        // The interrupt of reception changes the same register, hence the critical section. Errors are polled
        // (`bus_state`), because a broken bus causes thousands a second.
        critical_section::with(|_| CAN1.ier().modify(|w| w.set_fmpie(0, true)));
        set_filters();
        // A bit has twenty quanta and is sampled after the seventeenth: 85 %. At a low supply the 36 MHz give eighteen
        // quanta, sampled after the fifteenth.
        let clock = clocks::apb1_hertz();
        let quanta = if clock == 36_000_000 { 18 } else { 20 };
        let prescaler = clock.checked_div(quanta * bit_rate).unwrap_or(1);
        CAN1.btr().write(|w| {
            w.set_brp((prescaler as u16).wrapping_sub(1));
            // The synchronisation segment has one quantum, and the second segment three.
            w.set_ts(0, quanta as u8 - 4 - 1);
            w.set_ts(1, 3 - 1);
            w.set_sjw(2 - 1);
        });
        CAN1.mcr().modify(|w| {
            // Automatic recovery from bus-off.
            w.set_abom(true);
            w.set_inrq(false);
        });
    }
}

/// Makes the controller leave the bus after the frame in progress. Returns `false` if it does not within 4 ms, several
/// times the longest frame at 125 kbit/s.
pub fn initialise() -> bool {
    /// Each poll takes at least 12 cycles of 160 MHz.
    const POLLS: u32 = 60_000;
    CAN1.mcr().modify(|w| {
        w.set_sleep(false);
        w.set_inrq(true);
    });
    (0..POLLS).any(|_| {
        let status = CAN1.msr().read();
        status.inak() && !status.slak()
    })
}

/// The mailboxes of the controller, once [`CanParts::start`] has returned.
pub struct Can1Mailboxes;

impl Mailboxes for Can1Mailboxes {
    /// Puts a frame into an empty mailbox. The controller sends the lowest identifier first. One mailbox is reserved
    /// for the contact, so that it never waits behind frames of lower rank.
    ///
    /// Returns `false` if no mailbox is free, or if a mailbox holds the same identifier, because the order would not be
    /// kept.
    fn try_send(&self, frame: &CanFrame) -> bool {
        const CONTACT: u16 = Pdo::Contact.base();
        let (function, node) = cob_id::split(frame.id());
        let status = CAN1.tsr().read();
        let mut empty = None;
        let mut room = 0;
        for mailbox in MAILBOXES {
            if status.tme(mailbox) {
                empty = Some(mailbox);
                room += 1;
            } else if CAN1.tx(mailbox).tir().read().stid() == frame.id() {
                return false;
            }
        }
        let needed = if function == CONTACT { 1 } else { 2 };
        let Some(mailbox) = empty.filter(|_| room >= needed) else {
            return false;
        };
        if let (cob_id::HEARTBEAT, Some(node)) = (function, node) {
            // A master may answer the boot-up message of a new id at once.
            listen_as(node.get());
        }
        let mut bytes = [0; 8];
        for (to, from) in bytes.iter_mut().zip(frame.data()) {
            *to = *from;
        }
        let bytes = u64::from_le_bytes(bytes);
        let registers = CAN1.tx(mailbox);
        registers.tdtr().write(|w| w.set_dlc(frame.data().len() as u8));
        registers.tdlr().write_value(regs::Tdlr(bytes as u32));
        registers.tdhr().write_value(regs::Tdhr((bytes >> 32) as u32));
        registers.tir().write(|w| {
            w.set_stid(frame.id());
            w.set_txrq(true);
        });
        if needed == 1 {
            TO_MAILBOX.store(timebase::since_edge(), Ordering::Relaxed);
        }
        true
    }
}

/// Time from the data-ready edge to the contact's mailbox, µs; 0 if there was no contact since
/// [`clear_mailbox_latency`].
pub fn mailbox_latency_us() -> u32 {
    TO_MAILBOX.load(Ordering::Relaxed)
}

/// Clears the time to the mailbox, as at the start of a tick.
pub fn clear_mailbox_latency() {
    TO_MAILBOX.store(0, Ordering::Relaxed);
}

/// Returns whether a mailbox shows a frame that another node has acknowledged. A mailbox shows that until its next
/// frame, or until `CAN1_TX` clears it.
pub fn has_sent() -> bool {
    STARTED.load(Ordering::Acquire) && {
        let status = CAN1.tsr().read();
        MAILBOXES.into_iter().any(|mailbox| status.txok(mailbox))
    }
}

impl Sender {
    /// Withdraws pending frames with these identifiers, at once or after the frame on the bus. Returns their number. If
    /// a mailbox is full again already, it is unknown whether its frame was sent.
    pub async fn withdraw(&mut self, ids: &Range<u16>) -> u32 {
        let requested: [bool; 3] = array::from_fn(|mailbox| request_abort(mailbox, ids));
        if requested != [false; 3] {
            Timer::after(FRAME).await;
        }
        let status = CAN1.tsr().read();
        let aborted = |at| !status.abrq(at) && !status.txok(at);
        let requested = requested.into_iter().enumerate();
        let withdrawn = requested.filter(|(at, requested)| *requested && aborted(*at));
        withdrawn.count() as u32
    }

    /// Waits until a frame has left its mailbox, if any mailbox is full.
    pub async fn freed(&self) {
        // Read once, so that a mailbox that becomes empty from here on still ends the wait.
        let full: [bool; 3] = array::from_fn(|mailbox| waiting_in(mailbox).is_some());
        if full == [false; 3] {
            return;
        }
        let _guard = MailboxEmptyInterruptGuard::new();
        poll_fn(|context| {
            MAILBOX_FREED.register(context.waker());
            let is_freed = |mailbox: usize, was_full| was_full && waiting_in(mailbox).is_none();
            if full.into_iter().enumerate().any(|(at, was_full)| is_freed(at, was_full)) {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
        .await;
    }
}

/// Enables the interrupt of a mailbox that becomes empty. Dropping the guard disables it, also when a future is dropped
/// before its end.
struct MailboxEmptyInterruptGuard;

impl MailboxEmptyInterruptGuard {
    fn new() -> Self {
        set_mailbox_empty_interrupt(Enable::On);
        Self
    }
}

impl Drop for MailboxEmptyInterruptGuard {
    fn drop(&mut self) {
        set_mailbox_empty_interrupt(Enable::Off);
    }
}

/// State of an interrupt.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Enable {
    On,
    Off,
}

/// Enables or disables the interrupt of an empty mailbox, in a critical section because the interrupt of reception
/// changes the same register.
fn set_mailbox_empty_interrupt(enable: Enable) {
    critical_section::with(|_| CAN1.ier().modify(|w| w.set_tmeie(enable == Enable::On)));
}

/// Identifier of the frame that waits in a mailbox.
fn waiting_in(mailbox: usize) -> Option<u16> {
    let content = CAN1.tx(mailbox).tir().read();
    content.txrq().then_some(content.stid())
}

/// Requests the abort of the frame in a mailbox, if it has one of these identifiers. The critical section keeps another
/// frame from taking its place meanwhile.
fn request_abort(mailbox: usize, ids: &Range<u16>) -> bool {
    critical_section::with(|_| {
        let matches = waiting_in(mailbox).is_some_and(|id| ids.contains(&id));
        if matches {
            // Zeros have no effect.
            CAN1.tsr().write(|w| w.set_abrq(mailbox, true));
        }
        matches
    })
}

/// Mailboxes, as a range that lets the compiler prove each index to be in bounds.
const MAILBOXES: Range<usize> = 0..3;

impl Receiver {
    /// Returns the next frame for this foot, with the time of its end. The filters reject remote and extended frames.
    ///
    /// A frame that arrived while the previous one was processed has the time of this call.
    pub async fn receive(&mut self) -> (CanFrame, Timestamp) {
        let mut has_waited = false;
        poll_fn(|context| {
            FRAME_CAME.register(context.waker());
            self.overrun |= was_overrun();
            if let Some(frame) = take_frame() {
                let at = if has_waited {
                    timebase::extend(FRAME_CAME_AT.load(Ordering::Relaxed))
                } else {
                    timebase::now()
                };
                return Poll::Ready((frame, at));
            }
            has_waited = true;
            critical_section::with(|_| CAN1.ier().modify(|w| w.set_fmpie(0, true)));
            Poll::Pending
        })
        .await
    }

    /// Returns whether a received frame was lost since the last call.
    pub fn take_overrun(&mut self) -> bool {
        mem::take(&mut self.overrun)
    }
}

/// Takes the next frame of the FIFO. A DLC above eight, which any node may send, means eight bytes (ISO 11898-1). The
/// controller passes such a DLC on unchanged.
fn take_frame() -> Option<CanFrame> {
    let status = CAN1.rfr(0).read();
    // A frame that is being released does not count.
    if status.fmp() == 0 || status.rfom() {
        return None;
    }
    let registers = CAN1.rx(0);
    let low = u64::from(registers.rdlr().read().0);
    let bytes = (low | u64::from(registers.rdhr().read().0) << 32).to_le_bytes();
    let length = usize::from(registers.rdtr().read().dlc()).min(bytes.len());
    let frame = CanFrame::new(registers.rir().read().stid(), bytes.get(..length)?);
    CAN1.rfr(0).write(|w| w.set_rfom(true));
    frame
}

/// Returns whether a frame arrived while three were waiting. Clears the flag.
fn was_overrun() -> bool {
    let overrun = CAN1.rfr(0).read().fovr();
    if overrun {
        CAN1.rfr(0).write(|w| w.set_fovr(true));
    }
    overrun
}

/// Consecutive calls of [`bus_state`] that found the controller outside the bus.
static OUTSIDE: AtomicU8 = AtomicU8::new(0);

/// Ticks from the start after which a controller that is outside the bus counts as bus-off.
const JOINING_TICKS: u8 = 20;

/// State of the controller on the bus; active if it was not started. Call it once a tick.
///
/// The controller recovers from bus-off automatically, after 128 times 11 recessive bits. [`JOINING_TICKS`] after the
/// start it has joined any bus on which frames end. If it has not, the state is bus-off.
pub fn bus_state() -> BusState {
    if !STARTED.load(Ordering::Acquire) {
        return BusState::Active;
    }
    let outside = if CAN1.msr().read().inak() {
        OUTSIDE.load(Ordering::Relaxed).saturating_add(1)
    } else {
        0
    };
    OUTSIDE.store(outside, Ordering::Relaxed);
    let state = CAN1.esr().read();
    if state.boff() || outside > JOINING_TICKS {
        BusState::Off
    } else if state.epvf() {
        BusState::Passive(state.rec(), state.tec())
    } else {
        BusState::Active
    }
}

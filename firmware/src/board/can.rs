//! CAN1 on PB8 (receive) and PB9 (transmit).

use core::num::{NonZeroU8, NonZeroU16};
use core::ops::Range;

use embassy_stm32::can::filter::{BankConfig, ListEntry16, Mask16};
use embassy_stm32::can::util::NominalBitTiming;
use embassy_stm32::can::{
    Can, CanRx, CanTx, Fifo, Frame, Mailbox, Rx0InterruptHandler, Rx1InterruptHandler,
    SceInterruptHandler, StandardId, TxInterruptHandler,
};
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::{CAN1, GPIOB, gpio::vals::Pupdr};
use embassy_stm32::{Peri, bind_interrupts, peripherals};
use firmware::ports::BusState;
use wire::CanFrame;

use super::COMMUNICATION_PRIORITY;

bind_interrupts!(struct Irqs {
    CAN1_TX => TxInterruptHandler<peripherals::CAN1>;
    CAN1_RX0 => Rx0InterruptHandler<peripherals::CAN1>;
    CAN1_RX1 => Rx1InterruptHandler<peripherals::CAN1>;
    CAN1_SCE => SceInterruptHandler<peripherals::CAN1>;
});

/// The peripherals, until the bit rate is known.
pub struct Parts {
    pub(super) controller: Peri<'static, peripherals::CAN1>,
    pub(super) receive: Peri<'static, peripherals::PB8>,
    pub(super) transmit: Peri<'static, peripherals::PB9>,
}

/// The controller's settings.
pub struct Control(Can<'static>);

/// The sending half.
pub struct Sender(CanTx<'static>);

/// The receiving half.
pub struct Receiver(CanRx<'static>);

impl Parts {
    /// Joins the bus at `bit_rate`.
    pub fn start(self, bit_rate: u32) -> (Control, Sender, Receiver) {
        let mut can = Can::new(self.controller, self.receive, self.transmit, Irqs);
        // Without a transceiver the bus looks idle instead of floating.
        GPIOB.pupdr().modify(|w| w.set_pupdr(8, Pupdr::PULL_UP));
        for irq in [
            interrupt::CAN1_TX,
            interrupt::CAN1_RX0,
            interrupt::CAN1_RX1,
            interrupt::CAN1_SCE,
        ] {
            irq.set_priority(COMMUNICATION_PRIORITY);
        }
        // Errors are looked at (`bus_state`), not told: on a broken bus there are thousands a second.
        CAN1.ier().modify(|w| {
            w.set_lecie(false);
            w.set_ewgie(false);
            w.set_epvie(false);
            w.set_bofie(false);
        });
        listen_to_masters(&mut can);
        let (sender, receiver) = can.split();
        let mut control = Control(can);
        control.set_bit_rate(bit_rate);
        (control, Sender(sender), Receiver(receiver))
    }
}

/// What a foot has to hear, whatever its node id: NMT, SYNC, TIME, LSS, RPDO1 and requests of
/// SDO. What the other feet send does not cost a single instruction.
fn listen_to_masters(can: &mut Can) {
    const fn id(raw: u16) -> StandardId {
        match StandardId::new(raw) {
            Some(id) => id,
            None => StandardId::MAX,
        }
    }
    const FUNCTION: StandardId = id(0x780);
    let exact = [0x000, 0x080, 0x100, 0x7E5].map(|raw| ListEntry16::data_frames_with_id(id(raw)));
    let any_node =
        [0x200, 0x600].map(|raw| *Mask16::frames_with_std_id(id(raw), FUNCTION).data_frames_only());
    can.modify_filters()
        .enable_bank(0, Fifo::Fifo0, BankConfig::List16(exact))
        .enable_bank(1, Fifo::Fifo0, BankConfig::Mask16(any_node));
}

impl Control {
    /// Leaves the bus and joins it again at `bit_rate`, one of 125, 250, 500 and 1000 kbit/s.
    pub fn set_bit_rate(&mut self, bit_rate: u32) {
        // Twenty quanta a bit, sampled after the seventeenth: 85 %.
        const CLOCK: u32 = 40_000_000;
        let timing = NominalBitTiming {
            prescaler: quotient(CLOCK, 20 * bit_rate),
            seg1: const { NonZeroU8::new(16).unwrap() },
            seg2: const { NonZeroU8::new(3).unwrap() },
            sync_jump_width: const { NonZeroU8::new(2).unwrap() },
        };
        self.0.modify_config().set_bit_timing(timing);
        // Awake, and back by itself after bus-off. The HAL's `enable` would do the same and then
        // keep its executor busy until the bus is idle, for ever where it is shorted.
        CAN1.mcr().modify(|w| {
            w.set_abom(true);
            w.set_sleep(false);
        });
    }
}

fn quotient(dividend: u32, divisor: u32) -> NonZeroU16 {
    let quotient = dividend.checked_div(divisor).unwrap_or(1);
    NonZeroU16::new(quotient as u16).unwrap_or(NonZeroU16::MIN)
}

impl Sender {
    /// Puts a frame into an empty mailbox; of those that wait there, the controller sends the
    /// lowest identifier first. False where there is no room, or a frame of the same identifier
    /// waits already: their order would not be kept.
    pub fn try_send(&mut self, frame: &CanFrame) -> bool {
        let Some(frame) = frame.to_driver::<Frame>() else {
            return true;
        };
        // With all of them full the HAL would give up one that waits, whatever its rank.
        mailboxes().any(|mailbox| CAN1.tsr().read().tme(mailbox as usize))
            && self.0.try_write(&frame).is_ok()
    }

    /// Gives up the frames with these identifiers that have not been sent yet, and tells how many.
    pub fn withdraw(&mut self, ids: &Range<u16>) -> u32 {
        let mut withdrawn = 0;
        for mailbox in mailboxes() {
            if waiting_in(mailbox).is_some_and(|id| ids.contains(&id)) {
                self.0.abort(mailbox);
                withdrawn += 1;
            }
        }
        withdrawn
    }

    /// Waits until [`try_send`](Self::try_send) may take `frame`.
    pub async fn room_for(&self, frame: &CanFrame) {
        match mailboxes().find(|mailbox| waiting_in(*mailbox) == Some(frame.id())) {
            Some(mailbox) => self.0.flush(mailbox).await,
            None => self.0.flush_any().await,
        }
    }
}

/// The identifier of the frame that waits there.
fn waiting_in(mailbox: Mailbox) -> Option<u16> {
    let content = CAN1.tx(mailbox as usize).tir().read();
    content.txrq().then_some(content.stid())
}

fn mailboxes() -> impl Iterator<Item = Mailbox> {
    [Mailbox::Mailbox0, Mailbox::Mailbox1, Mailbox::Mailbox2].into_iter()
}

impl Receiver {
    /// The next frame for this foot; remote and extended frames do not pass the filters.
    pub async fn receive(&mut self) -> CanFrame {
        loop {
            // An error is the bus's, not a frame's; `bus_state` tells about it.
            let Ok(envelope) = self.0.read().await else {
                continue;
            };
            if let Some(frame) = CanFrame::from_driver(&envelope.frame) {
                return frame;
            }
        }
    }
}

/// What the controller thinks of the bus. From bus-off it comes back by itself, after 128 times
/// 11 recessive bits.
pub fn bus_state() -> BusState {
    let state = CAN1.esr().read();
    if state.boff() {
        BusState::Off
    } else if state.epvf() {
        BusState::Passive(state.rec(), state.tec())
    } else {
        BusState::Active
    }
}

/// Whether a received frame was lost since this was asked last.
pub fn take_overrun() -> bool {
    let overrun = CAN1.rfr(0).read().fovr();
    if overrun {
        CAN1.rfr(0).write(|w| w.set_fovr(true));
    }
    overrun
}

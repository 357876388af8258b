//! CAN: the controller's own loop-back, then a frame that another node has to acknowledge.

use embassy_stm32::pac::CAN1;
use embassy_stm32::pac::can::vals::Silm;
use embassy_time::{Duration, Timer};
use firmware::ports::Mailboxes;
use wire::CanFrame;

use crate::can::{Can1Mailboxes, Control, initialise};

/// Bit rate of both tests.
pub const BIT_RATE: u32 = 1_000_000;

/// Identifier of the frames. It loses every arbitration, as does the identifier before it, so that no other node waits.
const IDENTIFIER: u16 = 0x7FF;

/// Timeout of a frame: longer than the eleven recessive bits before it and three attempts.
const FRAME: Duration = Duration::from_millis(5);

/// Maximum polls for the end of initialisation: 4 ms.
const POLLS: u32 = 60_000;

/// Destination of the frames that the controller sends.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Mode {
    /// The controller itself; no signal leaves or enters the chip (RM0090, 32.6.3: loop back combined with silent
    /// mode).
    Inside,
    /// The bus.
    Bus,
}

/// Sets the mode in initialisation, and returns whether the controller has left it again.
fn set_mode(mode: Mode) -> bool {
    if !initialise() {
        // The reset does not wait for an idle bus. A shorted bus is never idle (RM0090, CAN_MCR.RESET).
        CAN1.mcr().write(|w| w.set_reset(true));
        if !initialise() {
            return false;
        }
    }
    CAN1.btr().modify(|w| {
        w.set_lbkm(mode == Mode::Inside);
        w.set_silm(match mode {
            Mode::Inside => Silm::SILENT,
            Mode::Bus => Silm::NORMAL,
        });
    });
    CAN1.mcr().modify(|w| w.set_inrq(false));
    (0..POLLS).any(|_| !CAN1.msr().read().inak())
}

/// Sends a frame, and returns whether it was acknowledged.
async fn is_sent() -> bool {
    let sent = CanFrame::new(IDENTIFIER, &[]).is_some_and(|frame| Can1Mailboxes.try_send(&frame));
    Timer::after(FRAME).await;
    let status = CAN1.tsr().read();
    let is_done = (0..3).any(|mailbox| status.rqcp(mailbox) && status.txok(mailbox));
    // Otherwise a frame that still waits for a node would be sent in the next test.
    CAN1.tsr().write(|w| {
        for mailbox in 0..3 {
            w.set_abrq(mailbox, true);
        }
    });
    Timer::after(FRAME).await;
    CAN1.tsr().write(|w| {
        for mailbox in 0..3 {
            w.set_rqcp(mailbox, true);
        }
    });
    sent && is_done
}

/// Fills the mailboxes with long frames.
pub fn fill() {
    for identifier in [IDENTIFIER, IDENTIFIER - 1] {
        if let Some(frame) = CanFrame::new(identifier, &[0x55; 8]) {
            Can1Mailboxes.try_send(&frame);
        }
    }
}

/// Leaves the bus.
pub fn leave() {
    initialise();
}

/// Returns whether the controller, which has been started, acknowledges its own frame.
pub async fn loops_back(_started: &Control) -> bool {
    set_mode(Mode::Inside) && is_sent().await
}

/// Returns whether another node acknowledges a frame, and the transmit error counter.
pub async fn is_acknowledged(control: &Control) -> (bool, u8) {
    control.set_bit_rate(BIT_RATE);
    let is_sent = set_mode(Mode::Bus) && is_sent().await;
    (is_sent, CAN1.esr().read().tec())
}

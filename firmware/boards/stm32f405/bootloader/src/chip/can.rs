//! CAN1 on PB8 and PB9, the same pins on each board.

use stm32_metapac::gpio::vals::{Moder, Pupdr};
use stm32_metapac::{CAN1, GPIOB, RCC};
use wire::CanFrame;
use wire::foot::{NodeId, cob_id};

use super::clock;

const RECEIVE: usize = 8;
const TRANSMIT: usize = 9;

/// Alternate function of both pins (DS8626, table 9).
const CAN_FUNCTION: u8 = 9;

/// Identifier of NMT commands.
const NMT_COMMAND: u16 = 0;

/// Maximum polls for a state that the controller reaches within a frame: 160 bits at 125 kbit/s.
const POLLS: u32 = 20_000;

/// Running controller.
pub struct Can {
    /// Node whose frames are accepted.
    id: Option<NodeId>,
}

impl Can {
    /// Joins the bus at `bit_rate`, bit/s, one of 125, 250, 500 and 1000 thousand; `None` without a crystal, or if the controller does
    /// not respond.
    pub fn start(bit_rate: u32, id: Option<NodeId>) -> Option<Self> {
        if !clock::is_crystal() {
            return None;
        }
        RCC.ahb1enr().modify(|w| w.set_gpioben(true));
        RCC.apb1enr().modify(|w| w.set_can1en(true));
        // A write just after the clock is enabled can be lost (ES0182).
        let _ = RCC.apb1enr().read();
        // Function registers of pins 8 to 15.
        GPIOB.afr(1).modify(|w| {
            w.set_afr(RECEIVE - 8, CAN_FUNCTION);
            w.set_afr(TRANSMIT - 8, CAN_FUNCTION);
        });
        GPIOB.moder().modify(|w| {
            w.set_moder(RECEIVE, Moder::ALTERNATE);
            w.set_moder(TRANSMIT, Moder::ALTERNATE);
        });
        // Without a transceiver the bus then reads as idle instead of floating.
        GPIOB.pupdr().modify(|w| w.set_pupdr(RECEIVE, Pupdr::PULL_UP));
        CAN1.mcr().write(|w| w.set_inrq(true));
        if !(0..POLLS).any(|_| CAN1.msr().read().inak()) {
            return None;
        }
        // A bit has twenty quanta and is sampled after the seventeenth, 85 %, as in the program.
        let prescaler = clock::CAN_HZ.checked_div(20 * bit_rate).unwrap_or(1);
        CAN1.btr().write(|w| {
            w.set_brp((prescaler as u16).saturating_sub(1));
            w.set_ts(0, 16 - 1);
            w.set_ts(1, 3 - 1);
            w.set_sjw(2 - 1);
        });
        set_filter(id);
        // Recovers automatically from bus-off, and sends frames in the order of their requests.
        CAN1.mcr().write(|w| {
            w.set_abom(true);
            w.set_txfp(true);
        });
        // A frame ends a sleep.
        CAN1.ier().write(|w| w.set_fmpie(0, true));
        Some(Self { id })
    }

    /// Accepts the frames for a node. LSS may have assigned another id.
    pub fn accept(&mut self, id: Option<NodeId>) {
        if self.id != id {
            set_filter(id);
            self.id = id;
        }
    }

    /// Takes a received frame.
    pub fn receive(&mut self) -> Option<CanFrame> {
        if CAN1.rfr(0).read().fmp() == 0 {
            return None;
        }
        let registers = CAN1.rx(0);
        let id = registers.rir().read().stid();
        let length = usize::from(registers.rdtr().read().dlc()).min(8);
        let (low, high) = (registers.rdlr().read().0, registers.rdhr().read().0);
        CAN1.rfr(0).write(|w| w.set_rfom(true));
        let bytes = (u64::from(high) << 32 | u64::from(low)).to_le_bytes();
        CanFrame::new(id, bytes.get(..length)?)
    }

    /// Sends a frame as soon as a mailbox is free. Discards it if none becomes free for several frames.
    pub fn send(&mut self, frame: &CanFrame) {
        let mailbox = (0..POLLS).find_map(|_| {
            let status = CAN1.tsr().read();
            (0..3).find(|mailbox| status.tme(*mailbox))
        });
        let Some(mailbox) = mailbox else {
            return;
        };
        let mut bytes = [0; 8];
        for (to, from) in bytes.iter_mut().zip(frame.data()) {
            *to = *from;
        }
        let bytes = u64::from_le_bytes(bytes);
        let registers = CAN1.tx(mailbox);
        registers.tdtr().write(|w| w.set_dlc(frame.data().len() as u8));
        registers.tdlr().write(|w| w.0 = bytes as u32);
        registers.tdhr().write(|w| w.0 = (bytes >> 32) as u32);
        registers.tir().write(|w| {
            w.set_stid(frame.id());
            w.set_txrq(true);
        });
    }

    /// Waits until all frames have been sent, or until the bus takes none.
    pub fn finish(&mut self) {
        let _ = (0..POLLS).any(|_| {
            let status = CAN1.tsr().read();
            (0..3).all(|mailbox| status.tme(mailbox))
        });
    }
}

/// Accepts only data frames for this node. Other frames would fill the FIFO while the flash is erased.
/// Without an id, accepts all, because LSS may assign one.
fn set_filter(id: Option<NodeId>) {
    // One filter register in 16-bit list mode, which holds two identifiers (RM0090, 32.7.4).
    let pair = |a: u16, b: u16| u32::from(a) << 5 | u32::from(b) << 21;
    CAN1.fmr().modify(|w| w.set_finit(true));
    match id {
        Some(id) => {
            CAN1.fm1r().write(|w| w.0 = 1);
            CAN1.fs1r().write(|w| w.0 = 0);
            let request = id.cob_id(cob_id::SDO_REQUEST);
            CAN1.fb(0).fr1().write(|w| w.0 = pair(NMT_COMMAND, cob_id::LSS_MASTER));
            CAN1.fb(0).fr2().write(|w| w.0 = pair(request, request));
        }
        None => {
            CAN1.fm1r().write(|w| w.0 = 0);
            CAN1.fs1r().write(|w| w.0 = 1);
            CAN1.fb(0).fr1().write(|w| w.0 = 0);
            // Identifiers of 11 bits, data frames.
            CAN1.fb(0).fr2().write(|w| w.0 = 0b110);
        }
    }
    CAN1.fa1r().write(|w| w.0 = 1);
    CAN1.fmr().modify(|w| w.set_finit(false));
}

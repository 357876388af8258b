//! The serial line: USART1, 8N1. DMA receives, because an operation of the flash stops the processor for the time of
//! many bytes.

use bootloader::adapter::{Adapter, Request};
use bootloader::image::Board;
use stm32_metapac::dma::regs::{Cr, Ndtr};
use stm32_metapac::gpio::Gpio;
use stm32_metapac::gpio::vals::{Moder, Pupdr};
use stm32_metapac::{DMA2, GPIOA, GPIOB, RCC, USART1};
use wire::CanFrame;
use wire::slcan;

use super::{BOARD, clock};

/// Port and pins that transmit and receive.
const PINS: (Gpio, usize, usize) = match BOARD {
    Board::Reference => (GPIOA, 9, 10),
    Board::Feather => (GPIOB, 6, 7),
};

/// Register of the functions of both pins.
const FUNCTIONS: usize = PINS.1 / 8;

const _: () = assert!(PINS.2 / 8 == FUNCTIONS);

/// Alternate function of these pins (DS8626, table 9).
const USART_FUNCTION: u8 = 7;

/// Stream of DMA2 that receives.
const STREAM: usize = 2;

/// Setting of the stream (RM0090, 10.5.5): channel 4, byte by byte from the peripheral to memory, circular.
const RECEIVING: u32 = 4 << 25 | 1 << 10 | 1 << 8 | 1;

/// Received bytes. DMA does not reach the memory that the linker gives the bootloader. So the ring lies where the stack
/// of the program begins, because that stack does not outlive a reset.
const RING: *mut u8 = core::ptr::with_exposed_provenance_mut(0x2000_0000);

/// Size of the ring, bytes. It has room for a block of the longest download, which has 127 lines.
const RING_BYTES: u16 = 4096;

const _: () = assert!(RING_BYTES as usize > 127 * slcan::LONGEST);

/// Maximum polls until a byte is sent at 9600 Bd: 1 ms of 80 MHz.
const POLLS: u32 = 100_000;

/// The line.
pub struct Serial {
    adapter: Adapter,
    /// Place of the next byte in the ring.
    next: u16,
}

impl Serial {
    /// Starts the line at `baud`. Returns `None` if the clock cannot be divided to that rate.
    pub fn start(baud: u32) -> Option<Self> {
        let divider = (clock::serial_hz() + baud / 2).checked_div(baud);
        let divider = divider.filter(|divider| (16..=0xFFFF).contains(divider))?;
        RCC.ahb1enr().modify(|w| {
            w.set_gpioaen(true);
            w.set_gpioben(true);
            w.set_dma2en(true);
        });
        RCC.apb2enr().modify(|w| w.set_usart1en(true));
        // A write just after a clock is enabled can be lost (ES0182).
        let _ = RCC.apb2enr().read();
        let (port, transmit, receive) = PINS;
        port.afr(FUNCTIONS).modify(|w| {
            w.set_afr(transmit % 8, USART_FUNCTION);
            w.set_afr(receive % 8, USART_FUNCTION);
        });
        port.moder().modify(|w| {
            w.set_moder(transmit, Moder::ALTERNATE);
            w.set_moder(receive, Moder::ALTERNATE);
        });
        // Without a cable the line is then idle instead of noisy.
        port.pupdr().modify(|w| w.set_pupdr(receive, Pupdr::PULL_UP));
        let stream = DMA2.st(STREAM);
        stream.par().write_value(USART1.dr().as_ptr() as u32);
        stream.m0ar().write_value(RING as u32);
        stream.ndtr().write_value(Ndtr(u32::from(RING_BYTES)));
        stream.cr().write_value(Cr(RECEIVING));
        USART1.brr().write(|w| w.0 = divider);
        USART1.cr3().write(|w| w.set_dmar(true));
        USART1.cr1().write(|w| {
            w.set_ue(true);
            w.set_te(true);
            w.set_re(true);
        });
        Some(Self { adapter: Adapter::default(), next: 0 })
    }

    /// Returns the request of the next complete line, if one has been received.
    pub fn receive(&mut self) -> Option<Request> {
        loop {
            let left = DMA2.st(STREAM).ndtr().read().ndt();
            let end = RING_BYTES.wrapping_sub(left) % RING_BYTES;
            if self.next == end {
                return None;
            }
            // SAFETY: inside the ring, which holds no variable, and any bits are a byte.
            let byte = unsafe { RING.add(usize::from(self.next)).read_volatile() };
            self.next = (self.next + 1) % RING_BYTES;
            let word = self.adapter.push(byte);
            if word.is_some() {
                return word;
            }
        }
    }

    /// Sends a frame of the node, while a master listens.
    pub fn send_frame(&self, frame: &CanFrame) {
        if self.adapter.is_open() {
            self.send(&slcan::encode(frame));
        }
    }

    /// Sends bytes.
    pub fn send(&self, bytes: &[u8]) {
        for byte in bytes {
            let _ = (0..POLLS).any(|_| USART1.sr().read().txe());
            USART1.dr().write(|w| w.set_dr(u16::from(*byte)));
        }
    }

    /// Waits until all bytes have been sent.
    pub fn finish(&self) {
        let _ = (0..2 * POLLS).any(|_| USART1.sr().read().tc());
    }
}

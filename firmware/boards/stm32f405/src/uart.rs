//! USART1, 8N1, both ways over DMA.
//!
//! The HAL configures the UART and receives. This module starts the transmissions itself, because the HAL panics on a
//! DMA error while sending. Here such an error loses only the frames of that transfer.

use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, Ordering, compiler_fence};
use core::task::Poll;

use embassy_stm32::gpio::Pull;
use embassy_stm32::interrupt::{self, InterruptExt, typelevel};
use embassy_stm32::mode::Async;
use embassy_stm32::pac::dma::regs::{Cr, Ixr, Ndtr};
use embassy_stm32::pac::usart::regs::Sr;
use embassy_stm32::pac::{self, DMA2};
use embassy_stm32::usart::{self, Config, RingBufferedUartRx, Uart, UartTx};
use embassy_stm32::{bind_interrupts, dma, peripherals};
use embassy_sync::waitqueue::AtomicWaker;
use static_cell::ConstStaticCell;

use crate::wiring::UartParts;
use crate::{Barrier, COMMUNICATION_PRIORITY, URGENT_PRIORITY};

bind_interrupts!(struct Irqs {
    USART1 => usart::InterruptHandler<peripherals::USART1>, Barrier;
    // The HAL's handler, the second one, panics at an error. So the first handles errors, and lets none happen before the third.
    DMA2_STREAM2 => NotReceived, dma::InterruptHandler<peripherals::DMA2_CH2>, Resumed, Barrier;
    // The HAL requires the second handler. The first leaves it nothing to do.
    DMA2_STREAM7 => Sent, dma::InterruptHandler<peripherals::DMA2_CH7>, Barrier;
});

/// Stream of DMA2 that receives.
const RECEIVE: usize = 2;

/// Stream of DMA2 that sends.
const TRANSMIT: usize = 7;

/// All events of a stream (RM0090, 10.5.3). Those of the receiving stream begin at bit 16 of the lower register, those
/// of the sending stream at bit 22 of the upper.
const RECEIVE_EVENTS: u32 = 0b11_1101 << 16;
const EVENTS: u32 = 0b11_1101 << 22;

/// Setting of the sending stream (RM0090, 10.5.5): channel 4, byte by byte from memory to the peripheral,
/// interrupts at the end and at an error.
const TRANSMITTING: u32 = 4 << 25 | 1 << 10 | 0b01 << 6 | 1 << 4 | 1 << 2 | 1;

/// Flag in `USART_SR` of a complete transmission. Writing a zero clears it.
const TC: u32 = 1 << 6;

/// Returns whether no transfer is in progress. At the thread level this means that no frame waits for one.
pub fn is_idle() -> bool {
    !DMA2.st(TRANSMIT).cr().read().en()
}

/// Task that waits for the end of a transfer.
static DONE: AtomicWaker = AtomicWaker::new();

/// Handler of the end of a transfer. Its bytes are in the transmitter by then.
struct Sent;

impl typelevel::Handler<typelevel::DMA2_STREAM7> for Sent {
    unsafe fn on_interrupt() {
        DMA2.ifcr(TRANSMIT / 4).write_value(Ixr(EVENTS));
        DONE.wake();
    }
}

/// Whether reception is paused until the end of the interrupt.
static PAUSED: AtomicBool = AtomicBool::new(false);

/// Handler of a DMA that stopped with a bus error. It shows the HAL the end of a round instead, because a stream that is
/// disabled before its end reports completion (RM0090, 10.3.14).
///
/// A byte received before [`Resumed`] waits in the receiver, because an error of its transfer would reach the HAL. The
/// receiver holds one byte, so the pause must be shorter than the time of a byte. Hence the interrupt has
/// [`URGENT_PRIORITY`], and no tick prolongs it.
struct NotReceived;

impl typelevel::Handler<typelevel::DMA2_STREAM2> for NotReceived {
    unsafe fn on_interrupt() {
        let requests = pac::USART1.cr3();
        if requests.read().dmar() {
            requests.modify(|w| w.set_dmar(false));
            PAUSED.store(true, Ordering::Relaxed);
        }
        if !DMA2.isr(RECEIVE / 4).read().teif(RECEIVE % 4) {
            return;
        }
        DMA2.ifcr(RECEIVE / 4).write_value(Ixr(RECEIVE_EVENTS));
        prepare();
        let control = DMA2.st(RECEIVE).cr();
        control.modify(|w| w.set_en(true));
        control.modify(|w| w.set_en(false));
    }
}

/// Handler after that of the HAL. It resumes reception.
struct Resumed;

impl typelevel::Handler<typelevel::DMA2_STREAM2> for Resumed {
    unsafe fn on_interrupt() {
        if PAUSED.swap(false, Ordering::Relaxed) {
            pac::USART1.cr3().modify(|w| w.set_dmar(true));
        }
    }
}

/// Bytes received before the receiving task runs: 5 ms at 1 Mbaud.
const RECEIVE_BUFFER: usize = 512;

/// Sending half.
pub struct Sender(UartTx<'static, Async>);

/// Error of a transfer that did not send all bytes. Holds the number of its frames.
pub struct NotSent(pub u32);

/// Receiving half.
pub struct Receiver {
    ring: RingBufferedUartRx<'static>,
    state: Reception,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Reception {
    Running,
    /// Not started yet, or stopped by a reported error.
    Stopped,
}

impl UartParts {
    /// Starts the line at `rate` baud.
    ///
    /// # Errors
    /// The rate does not divide the peripheral's clock.
    pub fn start(self, rate: u32) -> Result<(Sender, Receiver), usart::ConfigError> {
        static BUFFER: ConstStaticCell<[u8; RECEIVE_BUFFER]> =
            ConstStaticCell::new([0; RECEIVE_BUFFER]);
        let mut config = Config::default();
        config.baudrate = rate;
        // Without a cable the line is then idle instead of noisy.
        config.rx_pull = Pull::Up;
        let uart = Uart::new(
            self.controller,
            self.receive,
            self.transmit,
            self.transmit_dma,
            self.receive_dma,
            Irqs,
            config,
        )?;
        for irq in [interrupt::USART1, interrupt::DMA2_STREAM7] {
            irq.set_priority(COMMUNICATION_PRIORITY);
        }
        // The interrupt pauses reception: see `NotReceived`.
        interrupt::DMA2_STREAM2.set_priority(URGENT_PRIORITY);
        let (sender, receiver) = uart.split();
        Ok((
            Sender(sender),
            Receiver {
                ring: receiver.into_ring_buffered(BUFFER.take()),
                state: Reception::Stopped,
            },
        ))
    }
}

impl Sender {
    /// Starts to send bytes from RAM.
    pub fn start<'a>(&'a mut self, bytes: &'a [u8]) -> Transfer<'a> {
        let stream = DMA2.st(TRANSMIT);
        DMA2.ifcr(TRANSMIT / 4).write_value(Ixr(EVENTS));
        pac::USART1.cr3().modify(|w| w.set_dmat(true));
        // The bytes belong to the DMA until the transfer is dropped.
        compiler_fence(Ordering::Release);
        stream.par().write_value(pac::USART1.dr().as_ptr() as u32);
        stream.m0ar().write_value(bytes.as_ptr() as u32);
        stream.ndtr().write_value(Ndtr(bytes.len() as u32));
        // The DMA's writes do not clear the flag of a complete transmission, so `flush` would not wait (RM0090, 30.3.13
        // and 30.6.1). Writing ones leaves the other flags unchanged. Both writes are next to each other, because an
        // earlier byte that ended between them would set the flag again.
        pac::USART1.sr().write_value(Sr(!TC));
        // A stream without bytes to transfer reports no end.
        if !bytes.is_empty() {
            stream.cr().write_value(Cr(TRANSMITTING));
        }
        Transfer(bytes)
    }

    /// Changes the rate of both directions after pending bytes are sent. A rate that the peripheral
    /// does not support is ignored.
    pub async fn set_rate(&mut self, rate: u32) {
        let _ = self.0.flush().await;
        let _ = self.0.set_baudrate(rate);
    }
}

/// A transfer of bytes to the line. A transfer that is dropped before its end stops.
pub struct Transfer<'a>(&'a [u8]);

impl Transfer<'_> {
    /// Waits until the last byte is in the transmitter.
    ///
    /// # Errors
    /// [`NotSent`] with the number of frames in the transfer, if the DMA did not transfer all bytes.
    pub async fn end(self) -> Result<(), NotSent> {
        let stream = DMA2.st(TRANSMIT);
        poll_fn(|context| {
            DONE.register(context.waker());
            // The stream stops at its end or with an error.
            if stream.cr().read().en() { Poll::Pending } else { Poll::Ready(()) }
        })
        .await;
        if stream.ndtr().read().ndt() == 0 {
            return Ok(());
        }
        // Each frame ends with its only zero.
        Err(NotSent(self.0.iter().filter(|byte| **byte == 0).count() as u32))
    }
}

impl Drop for Transfer<'_> {
    fn drop(&mut self) {
        let control = DMA2.st(TRANSMIT).cr();
        if control.read().en() {
            control.modify(|w| w.set_en(false));
            while control.read().en() {}
        }
        // Later writes to the bytes must not be moved before the end.
        compiler_fence(Ordering::Acquire);
    }
}

impl Receiver {
    /// Waits for bytes. Returns `None` if some were lost: to noise, a wrong rate, a DMA error, or a late read. The next
    /// call, some time later, restarts reception.
    pub async fn receive<'a>(&mut self, room: &'a mut [u8]) -> Option<&'a [u8]> {
        if !is_receiving() {
            // The HAL may have stopped reception between two calls.
            if self.state == Reception::Running {
                self.state = Reception::Stopped;
                return None;
            }
            prepare();
            self.ring.start_uart();
            self.state = Reception::Running;
        }
        let Ok(count) = self.ring.read(room).await else {
            self.state = Reception::Stopped;
            return None;
        };
        room.get(..count)
    }
}

/// Returns whether received bytes reach the buffer. The HAL stops reception at an error of the line, and the DMA stops
/// it at a bus error.
fn is_receiving() -> bool {
    pac::USART1.cr3().read().dmar() && DMA2.st(RECEIVE).cr().read().en()
}

/// Prepares reception after an error and at the start.
///
/// Clears the status, because the HAL would treat an earlier overrun as a new error, indefinitely on a line that is
/// never idle. Fills the buffer with zeros, which are ends of frames without content. A stream that is enabled again
/// begins at the buffer's start but with the rest of its round, so the HAL would otherwise return old bytes as new ones.
fn prepare() {
    let stream = DMA2.st(RECEIVE);
    if stream.cr().read().en() {
        return;
    }
    let bytes = stream.m0ar().read() as *mut u8;
    for offset in 0..RECEIVE_BUFFER {
        // SAFETY: the HAL has given the stream its buffer of this length, and the stream is stopped. The HAL reads the
        // buffer byte by byte and volatile, because the DMA writes it meanwhile.
        unsafe { bytes.add(offset).write_volatile(0) };
    }
    stream.ndtr().write_value(Ndtr(RECEIVE_BUFFER as u32));
    // Reading the status and then the data clears errors (RM0090, 30.6.1).
    let _ = pac::USART1.sr().read();
    let _ = pac::USART1.dr().read();
}

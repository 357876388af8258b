//! USART1 on PA9 (transmit) and PA10 (receive), 8N1, both ways over DMA.

use embassy_stm32::gpio::Pull;
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{self, Config, RingBufferedUartRx, Uart, UartTx};
use embassy_stm32::{Peri, bind_interrupts, dma, peripherals};
use static_cell::ConstStaticCell;

use super::COMMUNICATION_PRIORITY;

bind_interrupts!(struct Irqs {
    USART1 => usart::InterruptHandler<peripherals::USART1>;
    DMA2_STREAM2 => dma::InterruptHandler<peripherals::DMA2_CH2>;
    DMA2_STREAM7 => dma::InterruptHandler<peripherals::DMA2_CH7>;
});

/// What may come before the receiving task looks: 5 ms at 1 Mbaud.
const RECEIVE_BUFFER: usize = 512;

/// The peripherals, until the rate is known.
pub struct Parts {
    pub(super) controller: Peri<'static, peripherals::USART1>,
    pub(super) transmit: Peri<'static, peripherals::PA9>,
    pub(super) receive: Peri<'static, peripherals::PA10>,
    pub(super) transmit_dma: Peri<'static, peripherals::DMA2_CH7>,
    pub(super) receive_dma: Peri<'static, peripherals::DMA2_CH2>,
}

/// The sending half.
pub struct Sender(UartTx<'static, Async>);

/// The receiving half.
pub struct Receiver(RingBufferedUartRx<'static>);

impl Parts {
    /// Starts the line at `rate` baud.
    ///
    /// # Errors
    /// The rate does not divide the peripheral's clock.
    pub fn start(self, rate: u32) -> Result<(Sender, Receiver), usart::ConfigError> {
        static BUFFER: ConstStaticCell<[u8; RECEIVE_BUFFER]> =
            ConstStaticCell::new([0; RECEIVE_BUFFER]);
        let mut config = Config::default();
        config.baudrate = rate;
        // Without a cable the line is idle instead of noisy.
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
        for irq in [
            interrupt::USART1,
            interrupt::DMA2_STREAM2,
            interrupt::DMA2_STREAM7,
        ] {
            irq.set_priority(COMMUNICATION_PRIORITY);
        }
        let (sender, receiver) = uart.split();
        Ok((
            Sender(sender),
            Receiver(receiver.into_ring_buffered(BUFFER.take())),
        ))
    }
}

impl Sender {
    /// Sends bytes from RAM; done when the last one is in the transmitter.
    pub async fn send(&mut self, bytes: &[u8]) {
        // The transmitter has no errors to tell.
        let _ = self.0.write(bytes).await;
    }

    /// Changes the rate of both directions, once what was sent is out. One that the peripheral
    /// cannot have leaves it as it is.
    pub async fn set_rate(&mut self, rate: u32) {
        let _ = self.0.flush().await;
        let _ = self.0.set_baudrate(rate);
    }
}

impl Receiver {
    /// Waits for bytes; `None` where some were lost, to noise, to a wrong rate or because nobody
    /// looked in time.
    pub async fn receive<'a>(&mut self, room: &'a mut [u8]) -> Option<&'a [u8]> {
        let count = self.0.read(room).await.ok()?;
        room.get(..count)
    }
}

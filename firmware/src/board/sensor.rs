//! SPI1 to the LSM6DSOX: SCK PA5, MISO PA6, MOSI PA7, CS PA4; its INT1 on PA0.

use embassy_stm32::gpio::{Level, Output, Pull, Speed};
use embassy_stm32::mode::Async;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Config, MODE_3, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::{self, input_capture::CapturePin};
use embassy_stm32::{Peri, bind_interrupts, dma, peripherals};
use embassy_time::{Duration, Timer};
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};

bind_interrupts!(struct Irqs {
    DMA2_STREAM0 => dma::InterruptHandler<peripherals::DMA2_CH0>;
    DMA2_STREAM3 => dma::InterruptHandler<peripherals::DMA2_CH3>;
});

/// Waits on the HAL's timer, at least as long as it says.
pub struct Delay;

impl DelayNs for Delay {
    async fn delay_ns(&mut self, ns: u32) {
        // One tick more: the first one has begun already.
        Timer::after(Duration::from_nanos(u64::from(ns)) + Duration::from_ticks(1)).await;
    }
}

/// What the driver only writes goes from here: registers, one at a time.
const SCRATCH: usize = 8;

/// The sensor on its bus, alone.
pub struct Bus {
    spi: Spi<'static, Async, Master>,
    select: Output<'static>,
}

/// The peripherals.
pub(super) struct Parts {
    pub controller: Peri<'static, peripherals::SPI1>,
    pub clock: Peri<'static, peripherals::PA5>,
    pub to_sensor: Peri<'static, peripherals::PA7>,
    pub from_sensor: Peri<'static, peripherals::PA6>,
    pub select: Peri<'static, peripherals::PA4>,
    pub data_ready: Peri<'static, peripherals::PA0>,
    pub transmit_dma: Peri<'static, peripherals::DMA2_CH3>,
    pub receive_dma: Peri<'static, peripherals::DMA2_CH0>,
}

impl Parts {
    /// Opens the bus and leads the data-ready line to the timer.
    pub fn start(self) -> Bus {
        let mut config = Config::default();
        config.mode = MODE_3;
        config.frequency = Hertz(lsm6dsox::SPI_MAX_HERTZ);
        // Without a sensor everything reads as zero, which no status register says of itself.
        config.miso_pull = Pull::Down;
        let spi = Spi::new(
            self.controller,
            self.clock,
            self.to_sensor,
            self.from_sensor,
            self.transmit_dma,
            self.receive_dma,
            Irqs,
            config,
        );
        // High INT1 at power-up would put the sensor into I3C mode: a pull-down, never an up. The
        // pin stays as it is when its owner goes.
        core::mem::forget(CapturePin::<peripherals::TIM2, timer::Ch1>::new(
            self.data_ready,
            Pull::Down,
        ));
        Bus {
            spi,
            select: Output::new(self.select, Level::High, Speed::VeryHigh),
        }
    }
}

impl ErrorType for Bus {
    type Error = spi::Error;
}

impl SpiDevice for Bus {
    /// Every operation is a transfer in place, so that there is one way through the HAL.
    async fn transaction(
        &mut self,
        operations: &mut [Operation<'_, u8>],
    ) -> Result<(), spi::Error> {
        self.select.set_low();
        let mut result = Ok(());
        for operation in operations {
            let mut scratch = [0; SCRATCH];
            let bytes = match operation {
                Operation::TransferInPlace(bytes) => &mut **bytes,
                Operation::Read(bytes) => {
                    bytes.fill(0);
                    &mut **bytes
                }
                Operation::Write(bytes) if bytes.len() <= SCRATCH => {
                    let (copy, _) = scratch.split_at_mut(bytes.len());
                    copy.copy_from_slice(bytes);
                    copy
                }
                // The driver does neither.
                Operation::Write(_) | Operation::Transfer(..) | Operation::DelayNs(_) => {
                    result = Err(spi::Error::Framing);
                    break;
                }
            };
            result = self.spi.transfer_in_place(bytes).await;
            if result.is_err() {
                break;
            }
        }
        self.select.set_high();
        result
    }
}

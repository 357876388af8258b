//! SPI1 to the LSM6DSOX, and its INT1.
//!
//! The HAL configures SPI1. Transfers are implemented here, because the HAL waits without a limit for their end and
//! panics at a DMA error.

use core::sync::atomic::{Ordering, compiler_fence};

use embassy_stm32::gpio::{Level, Output, Pull, Speed};
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::dma::regs::{Cr, Ixr, Ndtr};
use embassy_stm32::pac::spi::regs::Cr1;
use embassy_stm32::pac::spi::vals::Br;
use embassy_stm32::pac::{DMA2, RCC, SPI1};
use embassy_stm32::peripherals;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, MODE_3, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::input_capture::CapturePin;
use embassy_time::{Duration, Timer};
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use lsm6dsox::{BusSpeed, SetBusSpeed};

use crate::URGENT_PRIORITY;
use crate::timebase::Deadline;
use crate::wiring::{self, SensorParts};

/// Delay by the HAL's timer, at least as long as requested.
pub struct Delay;

/// One tick of the HAL's time, ns.
const NANOS_PER_TICK: u32 = (1_000_000_000 / embassy_time::TICK_HZ) as u32;

impl DelayNs for Delay {
    async fn delay_ns(&mut self, ns: u32) {
        // One more tick, because the first one has already begun.
        let ticks = ns.div_ceil(NANOS_PER_TICK) + 1;
        Timer::after(Duration::from_ticks(u64::from(ticks))).await;
    }
}

/// Length of the buffer for the driver's write-only transfers, which write one register at a time.
const SCRATCH: usize = 8;

/// Streams of DMA2, and the channel of SPI1's requests for both.
const RECEIVE: usize = 0;
const TRANSMIT: usize = 3;
const CHANNEL: u32 = 3;

/// All events of both streams, which share a register (RM0090, 10.5.3): those of stream 0 start at bit 0, those of
/// stream 3 at bit 22.
const EVENTS: u32 = 0b11_1101 | 0b11_1101 << 22;

/// Settings of the streams (RM0090, 10.5.5): channel, highest priority, increment of the
/// memory address; the transmitter's direction; the receiver's interrupts at the end and at an error.
const BOTH: u32 = CHANNEL << 25 | 0b11 << 16 | 1 << 10 | 1;
const TRANSMITTING: u32 = BOTH | 0b01 << 6;
const RECEIVING: u32 = BOTH | 1 << 4 | 1 << 2;

/// Length of the longest burst, which is the burst of a sample, bytes.
const BURST_BYTES: u32 = 17;

/// Timeout of a burst, µs: three times the duration of a sample's burst, plus 10.
const fn burst_micros(speed: BusSpeed) -> u32 {
    10 + 3 * BURST_BYTES * 8 * 1_000_000 / speed.spi_hertz()
}

/// Divider of APB2's 80 MHz: `BR` in `SPI_CR1` (RM0090, 28.5.1).
const fn divider(speed: BusSpeed) -> Br {
    match speed {
        BusSpeed::Full => Br::DIV16,
        BusSpeed::Reduced => Br::DIV32,
        BusSpeed::Lowest => Br::DIV64,
    }
}

/// The sensor, alone on its bus.
pub struct SensorBus {
    /// Owned for its pins.
    _spi: Spi<'static, Blocking, Master>,
    select: Output<'static>,
    /// Controller settings made by the HAL.
    setting: Cr1,
    /// Timeout of a burst, µs.
    burst_micros: u32,
}

impl SensorParts {
    /// Opens the bus and connects the data-ready line to the timer.
    pub fn start(self) -> SensorBus {
        let mut config = Config::default();
        config.mode = MODE_3;
        config.frequency = Hertz(wiring::SENSOR_START.spi_hertz());
        // Without a sensor everything then reads as zero. No status register would report its absence.
        config.miso_pull = Pull::Down;
        let spi = Spi::new_blocking(
            self.controller,
            self.clock,
            self.to_sensor,
            self.from_sensor,
            config,
        );
        SPI1.cr1().modify(|w| w.set_spe(true));
        for stream in [RECEIVE, TRANSMIT] {
            DMA2.st(stream).par().write_value(SPI1.dr().as_ptr() as u32);
        }
        interrupt::DMA2_STREAM0.set_priority(URGENT_PRIORITY);
        // SAFETY: the handler below accesses nothing that a lock protects.
        unsafe { interrupt::DMA2_STREAM0.enable() };
        // INT1 high at power-up would put the sensor into I3C mode: hence a pull-down, never a pull-up. The pin keeps
        // its configuration when its owner is dropped.
        core::mem::forget(CapturePin::<peripherals::TIM2, wiring::DataReadyChannel>::new(
            self.data_ready,
            Pull::Down,
        ));
        SensorBus {
            _spi: spi,
            select: Output::new(self.select, Level::High, Speed::VeryHigh),
            setting: SPI1.cr1().read(),
            burst_micros: burst_micros(wiring::SENSOR_START),
        }
    }
}

impl ErrorType for SensorBus {
    type Error = ErrorKind;
}

impl SpiDevice for SensorBus {
    /// Makes every operation a transfer in place, so that the bus has a single code path.
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
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
                // The driver uses neither.
                Operation::Write(_) | Operation::Transfer(..) | Operation::DelayNs(_) => {
                    result = Err(ErrorKind::Other);
                    break;
                }
            };
            result = burst(bytes, self.burst_micros);
            if result.is_err() {
                break;
            }
        }
        self.select.set_high();
        if result.is_err() {
            self.restart();
        }
        result
    }
}

impl SetBusSpeed for SensorBus {
    fn set_bus_speed(&mut self, speed: BusSpeed) {
        self.setting.set_br(divider(speed));
        self.burst_micros = burst_micros(speed);
        self.restart();
    }
}

impl SensorBus {
    /// Resets the controller to its state after the start, from any state: a byte in progress, an unread byte that
    /// would delay every later response, or a stopped clock.
    fn restart(&mut self) {
        // No other code changes this register after the board has started.
        RCC.apb2rstr().modify(|w| w.set_spi1rst(true));
        RCC.apb2rstr().modify(|w| w.set_spi1rst(false));
        SPI1.cr1().write_value(self.setting);
    }
}

/// Sends bytes over DMA and replaces them with those received. The processor sleeps meanwhile: 27 µs for a sample at 5
/// MHz.
fn burst(bytes: &mut [u8], limit_micros: u32) -> Result<(), ErrorKind> {
    DMA2.ifcr(RECEIVE / 4).write_value(Ixr(EVENTS));
    // The receiver first, because bytes arrive as soon as others are sent.
    SPI1.cr2().modify(|w| w.set_rxdmaen(true));
    compiler_fence(Ordering::Release);
    for (stream, setting) in [(RECEIVE, RECEIVING), (TRANSMIT, TRANSMITTING)] {
        let place = DMA2.st(stream);
        place.m0ar().write_value(bytes.as_mut_ptr() as u32);
        place.ndtr().write_value(Ndtr(bytes.len() as u32));
        place.cr().write_value(Cr(setting));
    }
    let deadline = Deadline::after(limit_micros);
    SPI1.cr2().modify(|w| w.set_txdmaen(true));
    // The stream stops at its end or with an error. Its end is an interrupt, and so an event that ends the sleep.
    while DMA2.st(RECEIVE).cr().read().en() && !deadline.has_passed() {
        cortex_m::asm::wfe();
    }
    compiler_fence(Ordering::Acquire);
    SPI1.cr2().modify(|w| {
        w.set_rxdmaen(false);
        w.set_txdmaen(false);
    });
    if DMA2.st(RECEIVE).ndtr().read().ndt() == 0 {
        return Ok(());
    }
    for stream in [TRANSMIT, RECEIVE] {
        let control = DMA2.st(stream).cr();
        control.write_value(Cr(0));
        // The stream stops after at most the current byte. From here on the bytes belong to the caller.
        while control.read().en() {}
    }
    compiler_fence(Ordering::Acquire);
    Err(ErrorKind::Other)
}

/// End of the burst. Its only effect is to end the sleep.
#[embassy_stm32::interrupt]
fn DMA2_STREAM0() {
    DMA2.ifcr(RECEIVE / 4).write_value(Ixr(EVENTS));
    // See `Barrier`.
    cortex_m::asm::dsb();
}

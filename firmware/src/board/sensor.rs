//! SPI1 to the LSM6DSOX: SCK PA5, MISO PA6, MOSI PA7, CS PA4; its INT1 on PA0.
//!
//! The HAL sets it up; transfers are done here. Each millisecond has two of them, and what the HAL
//! spends on the DMA of one is as much as the estimator takes. A burst goes over DMA, a register
//! sooner without.

use core::future::poll_fn;
use core::sync::atomic::{Ordering, compiler_fence};
use core::task::Poll;

use embassy_stm32::gpio::{Level, Output, Pull, Speed};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::dma::regs::{Cr, Ixr};
use embassy_stm32::pac::dma::vals::{Dir, Pl};
use embassy_stm32::pac::{DMA2, SPI1};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, MODE_3, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::{self, input_capture::CapturePin};
use embassy_stm32::{Peri, peripherals};
use embassy_sync::waitqueue::AtomicWaker;
use embassy_time::{Duration, Timer};
use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::{ErrorKind, ErrorType, Operation, SpiDevice};

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

/// Above everything else, together with the timer of the samples.
const PRIORITY: Priority = Priority::P1;

/// Streams of DMA2, and the channel on which SPI1 asks both of them.
const RECEIVE: usize = 0;
const TRANSMIT: usize = 3;
const CHANNEL: u8 = 3;

/// Up to here the bytes are gone before a DMA would be set up.
const SHORT: usize = 4;

/// Who waits for the end of a burst.
static DONE: AtomicWaker = AtomicWaker::new();

/// The sensor on its bus, alone.
pub struct Bus {
    /// Kept for its pins.
    _spi: Spi<'static, Blocking, Master>,
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
    /// Not used through the HAL, nor by anybody else.
    pub _transmit_dma: Peri<'static, peripherals::DMA2_CH3>,
    /// Likewise.
    pub _receive_dma: Peri<'static, peripherals::DMA2_CH0>,
}

impl Parts {
    /// Opens the bus and leads the data-ready line to the timer.
    pub fn start(self) -> Bus {
        let mut config = Config::default();
        config.mode = MODE_3;
        config.frequency = Hertz(lsm6dsox::SPI_MAX_HERTZ);
        // Without a sensor everything reads as zero, which no status register says of itself.
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
            DMA2.st(stream)
                .par()
                .write_value(SPI1.dr().as_ptr() as u32);
        }
        interrupt::DMA2_STREAM0.set_priority(PRIORITY);
        // SAFETY: the handler below touches nothing that anybody holds a lock on.
        unsafe { interrupt::DMA2_STREAM0.enable() };
        // High INT1 at power-up would put the sensor into I3C mode: a pull-down, never an up. The
        // pin stays as it is when its owner goes.
        core::mem::forget(CapturePin::<peripherals::TIM2, timer::Ch1>::new(
            self.data_ready,
            Pull::Down,
        ));
        Bus {
            _spi: spi,
            select: Output::new(self.select, Level::High, Speed::VeryHigh),
        }
    }
}

impl ErrorType for Bus {
    type Error = ErrorKind;
}

impl SpiDevice for Bus {
    /// Every operation is a transfer in place, so that there is one way over the bus.
    async fn transaction(
        &mut self,
        operations: &mut [Operation<'_, u8>],
    ) -> Result<(), ErrorKind> {
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
                    result = Err(ErrorKind::Other);
                    break;
                }
            };
            result = if bytes.len() <= SHORT {
                exchange(bytes);
                Ok(())
            } else {
                burst(bytes).await
            };
            if result.is_err() {
                break;
            }
        }
        self.select.set_high();
        result
    }
}

/// Sends bytes and receives as many in their place, waiting for each.
fn exchange(bytes: &mut [u8]) {
    for byte in bytes {
        SPI1.dr().write(|w| w.set_dr(u16::from(*byte)));
        while !SPI1.sr().read().rxne() {}
        *byte = SPI1.dr().read().dr() as u8;
    }
}

/// The same over DMA.
async fn burst(bytes: &mut [u8]) -> Result<(), ErrorKind> {
    let _stop = Stop;
    let setting = |direction, interrupts| {
        let mut setting = Cr::default();
        setting.set_chsel(CHANNEL);
        setting.set_dir(direction);
        setting.set_minc(true);
        setting.set_pl(Pl::VERY_HIGH);
        setting.set_tcie(interrupts);
        setting.set_teie(interrupts);
        setting.set_en(true);
        setting
    };
    forget_events();
    // The receiver first: nothing comes before something is sent. The buffer belongs to the DMA
    // until `Stop` has stopped it.
    SPI1.cr2().modify(|w| w.set_rxdmaen(true));
    for (stream, direction) in [
        (RECEIVE, Dir::PERIPHERAL_TO_MEMORY),
        (TRANSMIT, Dir::MEMORY_TO_PERIPHERAL),
    ] {
        let place = DMA2.st(stream);
        place.m0ar().write_value(bytes.as_mut_ptr() as u32);
        place.ndtr().write(|w| w.set_ndt(bytes.len() as u16));
        compiler_fence(Ordering::Release);
        place.cr().write_value(setting(direction, stream == RECEIVE));
    }
    SPI1.cr2().modify(|w| w.set_txdmaen(true));
    poll_fn(|context| {
        DONE.register(context.waker());
        // It stops by itself, at its end or with an error.
        if DMA2.st(RECEIVE).cr().read().en() {
            Poll::Pending
        } else {
            Poll::Ready(())
        }
    })
    .await;
    compiler_fence(Ordering::Acquire);
    if DMA2.st(RECEIVE).ndtr().read().ndt() == 0 {
        Ok(())
    } else {
        Err(ErrorKind::Other)
    }
}

/// Stops both streams, also where nobody waits for their end any more.
struct Stop;

impl Drop for Stop {
    fn drop(&mut self) {
        SPI1.cr2().modify(|w| {
            w.set_rxdmaen(false);
            w.set_txdmaen(false);
        });
        for stream in [TRANSMIT, RECEIVE] {
            let control = DMA2.st(stream).cr();
            if control.read().en() {
                control.modify(|w| w.set_en(false));
                while control.read().en() {}
            }
        }
    }
}

/// Clears what both streams have to tell: they are in the same register.
fn forget_events() {
    let mut events = Ixr::default();
    for stream in [RECEIVE, TRANSMIT] {
        events.set_tcif(stream, true);
        events.set_htif(stream, true);
        events.set_teif(stream, true);
        events.set_dmeif(stream, true);
        events.set_feif(stream, true);
    }
    DMA2.ifcr(RECEIVE / 4).write_value(events);
}

/// The burst has ended.
#[embassy_stm32::interrupt]
fn DMA2_STREAM0() {
    let mut events = Ixr::default();
    events.set_tcif(RECEIVE, true);
    events.set_teif(RECEIVE, true);
    DMA2.ifcr(RECEIVE / 4).write_value(events);
    DONE.wake();
}

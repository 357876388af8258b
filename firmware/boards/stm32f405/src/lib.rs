//! The board: an STM32F405RG with its crystal, an LSM6DSOX, a CAN transceiver, a serial line, a
//! load sensor and an LED.
//!
//! A feature selects one of the boards, whose tables are in [`wiring`]. Everything else is the same on each board. The
//! library `firmware` makes all decisions: [`foot::run`] connects both, and [`bring_up::run`] measures a new board.
//!
//! | priority, from the most urgent | interrupts |
//! |---|---|
//! | 1 | TIM2, the sensor's DMA, the reception of CAN and of the USART's DMA |
//! | 2 | the sampling executor |
//! | 4 | the transmission of CAN and of the USART's DMA, the USART, the HAL's timer |
//! | 5 | the communication executor |
//! | thread | everything else |

#![no_std]

pub mod bring_up;
mod can;
mod clocks;
mod crash;
mod flash;
pub mod foot;
mod load;
mod sensor;
mod stack;
mod timebase;
mod uart;
mod update;
mod watchdog;
mod wiring;

use bootloader::image::{self, Header};
use defmt_rtt as _;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::{self, InterruptExt, Priority, typelevel};
use lsm6dsox::BusSpeed;
use stm32f405_chip::crystal::Frequency;
use stm32f405_chip::supply;
use wire::Diagnosis;
use wire::diagnosis::Reset;
use wire::foot::serial_number;

use crate::wiring::{CanParts, UartParts};

/// Header in front of a program, as a debug probe writes it. The header of an update also has a hash and a signature.
#[used]
#[unsafe(link_section = ".header")]
static HEADER: [u8; image::USED] = Header::probed(wiring::BOARD, env!("FOOTFALL_COMMIT"));

/// Priority of the timer and the sensor's DMA, on which a sample depends, and of reception, which must not lose data.
const URGENT_PRIORITY: Priority = Priority::P1;

/// Priority of the interrupt that runs the sampling executor.
const SAMPLING_EXECUTOR_PRIORITY: Priority = Priority::P2;

/// Priority of the communication peripherals.
const COMMUNICATION_PRIORITY: Priority = Priority::P4;

/// Priority of the interrupt that runs the communication executor.
const COMMUNICATION_EXECUTOR_PRIORITY: Priority = Priority::P5;

/// Last handler of each interrupt: a memory barrier.
///
/// A store just before the return from an exception can lead to the handler of another interrupt unless it is complete
/// (Arm erratum 838869 of the Cortex-M4 \[M\]). An interrupt whose flag is not yet cleared also returns at once. The
/// HAL's own handler of TIM5 has no barrier.
struct Barrier;

impl<I: typelevel::Interrupt> typelevel::Handler<I> for Barrier {
    unsafe fn on_interrupt() {
        cortex_m::asm::dsb();
    }
}

/// Peripherals of the board. All are started except those that depend on settings.
struct Peripherals {
    /// Source of the clock.
    clock: clocks::Source,
    /// Cause of the processor's start.
    reset: Reset,
    /// Consecutive resets by the watchdog during which it was never fed.
    watchdog_resets: u32,
    /// Previous crash, if this start follows one.
    crash: Option<crash::Crash>,
    /// Serial number, unique to this board.
    serial: u32,
    /// Ticks and edges.
    timebase: timebase::Timebase,
    /// Bus of the sensor.
    sensor: sensor::SensorBus,
    /// Load sensor.
    load: load::LoadSensor,
    /// CAN, not yet on the bus.
    can: CanParts,
    /// The serial line, not yet running.
    uart: UartParts,
    /// Flash of the configuration.
    flash: flash::ConfigFlash,
    /// Lit when high.
    led: Output<'static>,
}

/// Diagnosis of the board, without its sensor.
fn diagnosis(clock: clocks::Source, reset: Reset) -> Diagnosis {
    let (is_crystal_used, crystal_khz) = match clock {
        clocks::Source::Crystal(Frequency::Measured(khz)) => (true, khz),
        clocks::Source::Crystal(Frequency::NotMeasured) => (true, 0),
        clocks::Source::Internal(khz) => (false, khz),
    };
    let clock_khz = clocks::processor_khz();
    // The bus has its nominal clock if the processor runs at 160 MHz and APB2 at 80 MHz. At a low supply both run at
    // 72 MHz.
    let ratio = if clock_khz == 160_000 { 80 } else { 72 };
    let mut identifier = [0; 4];
    for (to, word) in identifier.iter_mut().zip(embassy_stm32::uid::uid().as_chunks::<4>().0) {
        *to = u32::from_be_bytes(*word);
    }
    Diagnosis {
        reset,
        clock_khz,
        is_crystal_used,
        crystal_khz: crystal_khz.min(u32::from(u16::MAX)) as u16,
        option_bytes: flash::all_option_bytes(),
        identifier,
        bus_khz: BusSpeed::ALL.map(|speed| (speed.spi_hertz() / 1_000 * ratio / 80) as u16),
        ..Diagnosis::default()
    }
}

/// Starts the board.
fn start() -> Peripherals {
    watchdog::start();
    let crash = crash::take();
    let reset = crash::take_reset();
    let clock = clocks::start();
    let p = embassy_stm32::init(clocks::config(clock));
    clocks::enable_caches(clock);
    if matches!(clock.source, clocks::Source::Crystal(_)) {
        clocks::watch_crystal();
    }
    // The HAL has reset the detector.
    supply::watch();
    interrupt::TIM5.set_priority(COMMUNICATION_PRIORITY);
    let parts = wiring::parts(p);
    Peripherals {
        clock: clock.source,
        reset,
        watchdog_resets: crash::count_watchdog_resets(reset),
        crash,
        serial: serial_number(embassy_stm32::uid::uid()),
        timebase: timebase::Timebase::start(parts.timer, parts.counter),
        sensor: parts.sensor.start(),
        load: load::LoadSensor::start(parts.converter, parts.load),
        can: parts.can,
        uart: parts.uart,
        flash: flash::ConfigFlash::new(parts.flash),
        led: Output::new(parts.led, Level::Low, Speed::Low),
    }
}

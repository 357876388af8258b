//! The board: an STM32F405RG with its crystal, an LSM6DSOX, a CAN transceiver, a serial line, a
//! load sensor and an LED.
//!
//! A feature chooses one of the boards, whose folders have their tables: [`wiring`] is that of the chosen one. All
//! else is the same on each board. All decisions are made by the library.
//!
//! | interrupts, from the most urgent | |
//! |---|---|
//! | 1 | TIM2, the sensor's DMA, the reception of CAN and of the USART's DMA |
//! | 2 | the sampling executor |
//! | 4 | the transmission of CAN and of the USART's DMA, the USART, the HAL's timer |
//! | 5 | the communication executor |
//! | thread | everything else |

#[cfg(any(
    all(feature = "feather", feature = "reference"),
    not(any(feature = "feather", feature = "reference"))
))]
compile_error!("choose one board by a feature: `reference` (default) or `feather`");

#[cfg(feature = "feather")]
#[path = "feather/mod.rs"]
pub mod wiring;
#[cfg(feature = "reference")]
#[path = "reference/mod.rs"]
pub mod wiring;
pub use wiring::BOARD;

pub mod can;
pub mod clocks;
pub mod crash;
pub mod flash;
pub mod load;
pub mod sensor;
pub mod stack;
mod table;
pub mod timebase;
pub mod uart;
pub mod update;
pub mod watchdog;

use bootloader::supply;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::{self, InterruptExt, Priority, typelevel};
use wire::foot::serial_number;

/// Priority of the timer and the sensor's DMA, for which a sample waits, and of reception, for which a line does not wait.
const URGENT_PRIORITY: Priority = Priority::P1;

/// Priority of the interrupt that runs the sampling executor.
pub const SAMPLING_EXECUTOR_PRIORITY: Priority = Priority::P2;

/// Priority of the communication peripherals.
const COMMUNICATION_PRIORITY: Priority = Priority::P4;

/// Priority of the interrupt that runs the communication executor.
pub const COMMUNICATION_EXECUTOR_PRIORITY: Priority = Priority::P5;

/// Last handler of each interrupt. A store just before the return from an exception can lead to the handler of
/// another interrupt unless it is complete (Arm erratum 838869 of the Cortex-M4 \[M\]), and an interrupt whose flag is not
/// yet cleared returns at once. The HAL's own handler of TIM5 has none.
struct Barrier;

impl<I: typelevel::Interrupt> typelevel::Handler<I> for Barrier {
    unsafe fn on_interrupt() {
        cortex_m::asm::dsb();
    }
}

/// Peripherals of the board, started except for those with settings.
pub struct Board {
    /// Source of the clock.
    pub clock: clocks::Source,
    /// Cause of the processor's start.
    pub reset: crash::Reset,
    /// Resets by the watchdog in a row, none of which was followed by a feeding of it.
    pub watchdog_resets: u32,
    /// Previous crash, if this start follows one.
    pub crash: Option<crash::Crash>,
    /// Serial number, unique to this board.
    pub serial: u32,
    /// Ticks and edges.
    pub timebase: timebase::Timebase,
    /// Bus of the sensor.
    pub sensor: sensor::SensorBus,
    /// Load sensor.
    pub load: load::LoadSensor,
    /// CAN, not yet on the bus.
    pub can: can::Parts,
    /// The serial line, not yet running.
    pub uart: uart::Parts,
    /// Flash of the configuration.
    pub flash: flash::ConfigFlash,
    /// Lit when high.
    pub led: Output<'static>,
}

/// Starts the board.
pub fn start() -> Board {
    watchdog::start();
    let crash = crash::take();
    let reset = crash::take_reset();
    let clock = clocks::start();
    let p = embassy_stm32::init(clocks::config(clock));
    clocks::enable_caches();
    if clock == clocks::Source::Crystal {
        clocks::watch_crystal();
    }
    supply::watch();
    interrupt::TIM5.set_priority(COMMUNICATION_PRIORITY);
    let parts = wiring::parts(p);
    Board {
        clock,
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

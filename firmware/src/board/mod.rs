//! The board: an STM32F405RG with its crystal, an LSM6DSOX, a CAN transceiver, a serial line, a
//! load sensor and an LED. Which pin is which is said in each module and in the README.
//!
//! All decisions are the library's.
//!
//! | interrupts, from the most urgent | |
//! |---|---|
//! | 1 | TIM2, the sensor's DMA |
//! | 2 | the sampling executor |
//! | 4 | CAN, USART and its DMA, the HAL's timer |
//! | 5 | the communication executor |
//! | thread | everything else |

pub mod can;
pub mod clocks;
pub mod crash;
pub mod flash;
pub mod load;
pub mod sensor;
pub mod stack;
pub mod supply;
pub mod timebase;
pub mod uart;
pub mod watchdog;

use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};

/// Of the timer and the sensor's DMA, for which a sample waits.
const URGENT_PRIORITY: Priority = Priority::P1;

/// Of the interrupt that stands for the sampling executor.
pub const SAMPLING_EXECUTOR_PRIORITY: Priority = Priority::P2;

/// Of the peripherals of the communication.
const COMMUNICATION_PRIORITY: Priority = Priority::P4;

/// Of the interrupt that stands for the communication executor.
pub const COMMUNICATION_EXECUTOR_PRIORITY: Priority = Priority::P5;

/// Everything on the board, started except for what has settings.
pub struct Board {
    /// Where the clock comes from.
    pub clock: clocks::Source,
    /// Why the processor started.
    pub reset: crash::Reset,
    /// The previous crash, where this start follows one.
    pub crash: Option<crash::Crash>,
    /// The serial number, unique to this board.
    pub serial: u32,
    /// Ticks and edges.
    pub timebase: timebase::Timebase,
    /// The sensor's bus.
    pub sensor: sensor::SensorBus,
    /// The load sensor.
    pub load: load::LoadSensor,
    /// CAN, not yet on the bus.
    pub can: can::Parts,
    /// The serial line, not yet running.
    pub uart: uart::Parts,
    /// Where the configuration is kept.
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
    let sensor = sensor::Parts {
        controller: p.SPI1,
        clock: p.PA5,
        to_sensor: p.PA7,
        from_sensor: p.PA6,
        select: p.PA4,
        data_ready: p.PA0,
        _transmit_dma: p.DMA2_CH3,
        _receive_dma: p.DMA2_CH0,
    };
    Board {
        clock,
        reset,
        crash,
        serial: serial(),
        timebase: timebase::Timebase::start(p.TIM2, p.TIM4),
        sensor: sensor.start(),
        load: load::LoadSensor::start(p.ADC1, p.PC0),
        can: can::Parts {
            controller: p.CAN1,
            receive: p.PB8,
            transmit: p.PB9,
        },
        uart: uart::Parts {
            controller: p.USART1,
            transmit: p.PA9,
            receive: p.PA10,
            transmit_dma: p.DMA2_CH7,
            receive_dma: p.DMA2_CH2,
        },
        flash: flash::ConfigFlash::new(p.FLASH),
        led: Output::new(p.PC6, Level::Low, Speed::Low),
    }
}

/// The 96 bits that the factory gave this chip, folded into 32 (FNV-1a).
fn serial() -> u32 {
    embassy_stm32::uid::uid()
        .into_iter()
        .fold(0x811C_9DC5, |hash: u32, byte| {
            (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
        })
}

//! The foot's program on an Arduino Nano RP2040 Connect: its LSM6DSOX on I²C, frames over USB, a tick of 2.4 ms.
//!
//! The library `firmware` is the portable part, as on the other boards, and describes the path of a sample. This file
//! has the chip and the levels:
//!
//! | level | content |
//! |---|---|
//! | interrupts, priority 0 | timer, I²C, the pin of INT1, and USB, whose frames are timed |
//! | sampling, an executor at priority 1 | [`sample`] |
//! | an executor at priority 3 | the tasks of [`usb`] |
//! | thread | settings, watchdog, LED |
//!
//! CAN, a load input and the second core are not used. The radio module, with its RGB LED, is held in reset.

#![no_std]
#![no_main]

mod crash;
mod flash;
mod loader;
mod resets;
mod sensor;
mod soft_float;
mod stack;
mod timebase;
mod usb;
mod usb_errata;

use core::fmt::Write as _;

use embassy_executor::{Executor, InterruptExecutor, SpawnError, SpawnToken};
use embassy_rp::clocks::ClockConfig;
use embassy_rp::gpio::{Level, Output};
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::pac::watchdog::regs::Load;
use embassy_rp::peripherals::{I2C0, USB};
use embassy_rp::watchdog::{ResetReason, Watchdog};
use embassy_rp::{bind_interrupts, i2c, pac};
use embassy_time::{Duration, Instant};
use firmware::sampling::{self, Sensor, Tick};
use firmware::supervision::StackDepth;
use firmware::{Board, Crystal, Foot, Ports, Start, thread};
use lsm6dsox::Config;
use static_cell::StaticCell;
use storage::{Storage, StoreFailed};
use wire::foot::serial_number;
use wire::node::{BootCause, Crash, Program};
use wire::{Fault, Settings};

use flash::SettingsFlash;
use resets::Restart;
use timebase::{Delay, TICK_US, Timebase};

bind_interrupts!(struct Irqs {
    I2C0_IRQ => i2c::InterruptHandler<I2C0>;
    USBCTRL_IRQ => usb_errata::FrameHandler, embassy_rp::usb::InterruptHandler<USB>;
});

/// State shared between the levels.
static PORTS: Ports = Ports::new();

static SAMPLING: InterruptExecutor = InterruptExecutor::new();
static COMMUNICATION: InterruptExecutor = InterruptExecutor::new();

/// Period of the watchdog: longer than the erase of a sector, 400 ms at most.
const WATCHDOG: Duration = Duration::from_millis(1_000);

/// Clock of the cores, Hz: the highest that the RP2040's data sheet allows at the usual voltage.
const CLOCK_HZ: u32 = 133_000_000;

#[cortex_m_rt::entry]
fn main() -> ! {
    static THREAD: StaticCell<Executor> = StaticCell::new();
    static FOOT: StaticCell<Foot> = StaticCell::new();

    let clocks =
        ClockConfig::system_freq(CLOCK_HZ).unwrap_or_else(|_| ClockConfig::crystal(12_000_000));
    let p = embassy_rp::init(embassy_rp::config::Config::new(clocks));
    let mut watchdog = Watchdog::new(p.WATCHDOG);
    let restart = Restart::take(&mut watchdog);
    watchdog.start(WATCHDOG);
    let crash = crash::take();
    // The radio is unused, and would take most of the current.
    let _radio_reset = Output::new(p.PIN_3, Level::Low);

    let mut flash = SettingsFlash::new(p.FLASH);
    let id = flash.unique_id();
    let Ok(mut storage) = Storage::new(flash, &(0..flash::SETTINGS)) else {
        halt();
    };
    let (settings, origin) = thread::load_settings(&mut storage, restart.timeouts);
    let timed_out = restart.reason == Some(ResetReason::TimedOut);
    let reason = match crash {
        Some(record) => Some(record.into()),
        None => timed_out.then_some(Crash { fault: Fault::WatchdogReset, program_counter: 0 }),
    };
    let start = Start {
        serial: serial_number(id),
        hardware: "Arduino Nano RP2040 Connect",
        cause: match (restart.reason, crash.is_some()) {
            (Some(ResetReason::Forced), false) => BootCause::Commanded,
            _ => BootCause::PowerUp,
        },
        crash: reason,
        origin,
        crystal: Crystal::InUse,
        // The chip's own detector, on after each reset, watches the core's supply instead.
        brown_out_level: None,
        program: Program {
            identification: u32::from_str_radix(env!("FOOTFALL_PROGRAM"), 16).unwrap_or(0),
            ..Program::default()
        },
    };
    let Ok(foot) = Foot::new_in(FOOT.uninit(), settings, start) else { halt() };
    foot.disable_can(TICK_US);
    let range = foot.settings().accelerometer_range();

    interrupt::SWI_IRQ_1.set_priority(Priority::P3);
    let communication = COMMUNICATION.start(interrupt::SWI_IRQ_1);
    once(usb::serve(p.USB, text_of(id)), |task| {
        communication.spawn(task);
    });

    interrupt::SWI_IRQ_0.set_priority(Priority::P1);
    let level = SAMPLING.start(interrupt::SWI_IRQ_0);
    let parts = sensor::Parts { controller: p.I2C0, data: p.PIN_12, clock: p.PIN_13 };
    let sensor = Sensor::new(sensor::SensorBus::new(parts), Config::FRESH_417_HERTZ)
        .with_accelerometer_range(range);
    let ticks = Timebase::new(sensor::data_ready(p.PIN_24));
    once(sample(sensor, ticks, foot), |task| level.spawn(task));

    let led = Output::new(p.PIN_6, Level::Low);
    THREAD.init(Executor::new()).run(|thread| {
        once(serve_requests(storage), |task| thread.spawn(task));
        once(feed_watchdog(), |task| thread.spawn(task));
        once(loader::forget_press(), |task| thread.spawn(task));
        once(blink(led), |task| thread.spawn(task));
    })
}

#[embassy_rp::interrupt]
unsafe fn SWI_IRQ_0() {
    // SAFETY: called by this interrupt.
    unsafe { SAMPLING.on_interrupt() }
}

#[embassy_rp::interrupt]
unsafe fn SWI_IRQ_1() {
    // SAFETY: called by this interrupt.
    unsafe { COMMUNICATION.on_interrupt() }
}

/// Spawns a task that exists once.
fn once<S>(task: Result<SpawnToken<S>, SpawnError>, spawn: impl FnOnce(SpawnToken<S>)) {
    if let Ok(task) = task {
        spawn(task);
    }
}

/// Ends a start that found an inconsistency. The watchdog's reset follows.
fn halt() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}

/// Serial number of the USB device, hexadecimal.
fn text_of(id: [u8; 8]) -> &'static str {
    static TEXT: StaticCell<heapless::String<16>> = StaticCell::new();
    let text = TEXT.init(heapless::String::new());
    // The buffer holds all sixteen digits.
    let _ = write!(text, "{:016X}", u64::from_be_bytes(id));
    text
}

/// The board, as the library uses it.
struct Nano;

impl Board for Nano {
    const FEEDING_MS: u32 = 60;

    fn load_reading(&self) -> Option<u16> {
        None
    }

    fn micros_since_edge(&self, tick: &Tick) -> u32 {
        Instant::now().as_micros().saturating_sub(tick.sampled().as_micros()) as u32
    }

    fn feed_watchdog(&self) {
        // The counter counts down by two (erratum RP2040-E1).
        pac::WATCHDOG.load().write_value(Load(2 * WATCHDOG.as_micros() as u32));
        resets::end_row();
    }

    fn look_at_stack(&self, depth: &mut StackDepth) -> Option<usize> {
        stack::look(depth)
    }

    fn apply_rates(&self, _: &Settings) {}

    fn protect(&self) -> Result<(), StoreFailed> {
        Err(StoreFailed::Flash)
    }

    fn confirm_program(&self) -> Result<(), StoreFailed> {
        // The loader is in the chip's ROM.
        Ok(())
    }

    fn start_bootloader(&self) -> ! {
        loader::run()
    }

    fn reset(&self) -> ! {
        crash::reset()
    }
}

/// Sampling level: tick, edge, burst, estimate and frames.
#[embassy_executor::task]
async fn sample(sensor: Sensor<sensor::SensorBus>, ticks: Timebase, foot: &'static mut Foot) {
    sampling::sample(sensor, Delay, ticks, foot, &Nano, &PORTS).await;
}

/// Thread level: serves requests of the foot that take longer than a tick.
#[embassy_executor::task]
async fn serve_requests(storage: Storage<SettingsFlash>) {
    thread::serve_requests(storage, Delay, &Nano, &PORTS).await;
}

/// Thread level: feeds the watchdog, and measures the depth of the stack.
#[embassy_executor::task]
async fn feed_watchdog() {
    thread::feed_watchdog(Delay, &Nano, &PORTS).await;
}

/// Thread level: shows the stage.
#[embassy_executor::task]
async fn blink(led: Output<'static>) {
    thread::blink(led, Delay, &PORTS).await;
}

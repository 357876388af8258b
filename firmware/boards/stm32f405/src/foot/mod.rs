//! The foot's program on any board, in the order of a sample's path: the board starts, the sampling loop
//! turns data-ready edges into frames, the communication sends frames and receives requests, and
//! the thread level stores settings and feeds the watchdog.
//!
//! Three levels; a lower one never delays a higher one:
//!
//! | level | what runs there |
//! |---|---|
//! | sampling, an executor at interrupt priority 2 | [`sample`](sampling::sample) |
//! | communication, an executor at interrupt priority 5 | the tasks of [`communication`] |
//! | thread | the tasks of [`background`] |

mod background;
mod communication;
mod sampling;
mod start;

use core::sync::atomic::{AtomicBool, AtomicU8};

use bootloader::image::Board;
use bootloader::supply;
use embassy_executor::{Executor, InterruptExecutor};
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::Duration;
use firmware::sampling::Sensor;
use firmware::{Ports, Start};
use lsm6dsox::Config;
use static_cell::StaticCell;
use storage::{MOST_WATCHDOG_RESETS, Origin, Storage};
use wire::Settings;
use wire::node::BootCause;

use crate::clocks::Source;
use crate::crash::Reset;
use crate::flash::ConfigFlash;
use background::{blink, feed_watchdog, serve_requests};
use communication::{receive_can, receive_uart, send_can, send_uart};
use start::{halt, log_boot, make_foot, once, reason_for_start};

/// State shared between the interrupt levels.
static PORTS: Ports = Ports::new();

/// State shown by the LED: the stage's code, and [`FAULT`] while a fault is active.
static LIGHT: AtomicU8 = AtomicU8::new(0);
const FAULT: u8 = 0x80;

/// Whether a request has come over the serial line since the start.
static REQUESTED: AtomicBool = AtomicBool::new(false);

/// New rate of the UART.
static UART_RATE: Signal<CriticalSectionRawMutex, u32> = Signal::new();

static SAMPLING: InterruptExecutor = InterruptExecutor::new();
static COMMUNICATION: InterruptExecutor = InterruptExecutor::new();

/// Flash with the settings.
type Store = Storage<ConfigFlash>;

/// Returns whether the supply suffices at each millisecond of two seconds, which a connector that bounces is not expected to
/// do. The LED flickers as in a start.
fn supply_holds(led: &mut Output<'static>) -> bool {
    let holds = (0..2_000).all(|ms| {
        led.set_level((ms / 50 % 2 == 0).into());
        embassy_time::block_for(Duration::from_millis(1));
        crate::watchdog::feed();
        !supply::is_low()
    });
    led.set_low();
    holds
}

/// Starts the board and runs the foot.
pub fn run() -> ! {
    static THREAD: StaticCell<Executor> = StaticCell::new();

    let board = crate::start();
    let mut led = board.led;
    let Ok(mut storage) = Storage::new(board.flash, &(0..crate::flash::SIZE)) else {
        halt(&mut led, "configuration pages do not fit the flash layout");
    };
    // As delivered, brown-out reset and write protection are off. Not after another reset: an attempt that ends in one is
    // not repeated, and a probe can lift the protection to write another bootloader.
    let is_open = crate::flash::brown_out_level() == 0 || !crate::flash::is_bootloader_protected();
    if board.reset == Reset::Power && is_open && supply_holds(&mut led) {
        let is_protected = storage.flash().protect().is_ok();
        defmt::warn!("option bytes written: {=bool}", is_protected);
    }
    // Nothing is written until a store: the settings in flash stay for inspection.
    let (settings, origin) = match board.watchdog_resets {
        0..MOST_WATCHDOG_RESETS => storage.load(),
        _ => (Settings::default(), Origin::NotRead),
    };
    let start = Start {
        serial: board.serial,
        hardware: match crate::wiring::BOARD {
            Board::Reference => "STM32F405RG + LSM6DSOX",
            Board::Feather => "Feather STM32F405 + LSM6DSOX",
        },
        cause: match (board.reset, board.crash.is_some()) {
            (Reset::Software, false) if !crate::update::take_resume() => BootCause::Commanded,
            _ => BootCause::PowerUp,
        },
        crash: reason_for_start(board.crash, board.reset),
        origin,
        unused_crystal_khz: match board.clock {
            Source::Crystal => None,
            Source::Internal(khz) => Some(khz),
        },
        brown_out_level: crate::flash::brown_out_level(),
        program: crate::update::program(),
    };
    log_boot(&start);
    let Some(foot) = make_foot(settings, start) else {
        halt(&mut led, "the default settings do not fit each other");
    };
    let settings = foot.settings();
    let (can_rate, uart_rate) = (settings.can_bit_rate(), settings.uart_rate());
    let (self_test, range) = (settings.self_test(), settings.accelerometer_range());
    let Ok((uart_out, uart_in)) = board.uart.start(uart_rate) else {
        halt(&mut led, "the UART cannot have its rate");
    };

    interrupt::UART5.set_priority(crate::COMMUNICATION_EXECUTOR_PRIORITY);
    let communication = COMMUNICATION.start(interrupt::UART5);
    // Without a crystal the bus is not joined: the clock is not accurate enough for it.
    let can = (board.clock == Source::Crystal).then(|| {
        let (control, can_out, can_in) = board.can.start(can_rate);
        PORTS.connect_can(crate::can::try_send);
        once(send_can(can_out), |task| communication.spawn(task));
        once(receive_can(can_in), |task| communication.spawn(task));
        control
    });
    once(send_uart(uart_out), |task| communication.spawn(task));
    once(receive_uart(uart_in), |task| communication.spawn(task));

    // After the tasks that send: the first frames do not wait for a start of the buses, and none replaces another.
    interrupt::UART4.set_priority(crate::SAMPLING_EXECUTOR_PRIORITY);
    let level = SAMPLING.start(interrupt::UART4);
    let sensor = Sensor::new(board.sensor, Config::FRESH_KILOHERTZ)
        .with_spi_clock(crate::wiring::SENSOR_SPEED)
        .with_accelerometer_range(range);
    once(sampling::sample(sensor, board.timebase, board.load, foot, self_test), |task| {
        level.spawn(task);
    });

    THREAD.init(Executor::new()).run(|thread| {
        once(serve_requests(storage, can), |task| thread.spawn(task));
        once(feed_watchdog(), |task| thread.spawn(task));
        once(blink(led), |task| thread.spawn(task));
    })
}

// The interrupts that run the executors; their own peripherals are not used. The barriers: see `crate::Barrier`.

#[embassy_stm32::interrupt]
unsafe fn UART4() {
    // SAFETY: called by this interrupt.
    unsafe { SAMPLING.on_interrupt() };
    cortex_m::asm::dsb();
}

#[embassy_stm32::interrupt]
unsafe fn UART5() {
    // SAFETY: called by this interrupt.
    unsafe { COMMUNICATION.on_interrupt() };
    cortex_m::asm::dsb();
}

//! The foot's program on a board with an RP2040 or an RP2350: its LSM6DSOX on I²C, frames over USB.
//!
//! The library `firmware` is the portable part, as on the other boards, and describes the path of a sample. This
//! library has the chips and the levels. A feature selects the board. The board's module, `nano_rp2040` or
//! `feather_rp2350`, is a table of its pins and clocks, and has what only its chip needs. `wiring` is the same on all
//! boards.
//!
//! | level | content |
//! |---|---|
//! | interrupts, priority 0 | timer, I²C, the pin of INT1, and USB, whose frames are timed |
//! | sampling, an executor at priority 1 | [`sample`] |
//! | an executor at priority 3 | the tasks of [`usb`] |
//! | thread | settings, watchdog, LED |
//!
//! CAN, a load input and the second core are not used.

#![no_std]

#[cfg(not(any(feature = "nano-rp2040", feature = "feather-rp2350")))]
compile_error!("select a board: --features nano-rp2040 or feather-rp2350");

mod crash;
#[cfg(feature = "feather-rp2350")]
mod feather_rp2350;
mod flash;
#[cfg(feature = "nano-rp2040")]
mod nano_rp2040;
mod resets;
mod sensor;
mod stack;
mod timebase;
mod usb;
mod usb_watch;
mod wiring;

#[cfg(feature = "feather-rp2350")]
use feather_rp2350 as board;
#[cfg(feature = "nano-rp2040")]
use nano_rp2040 as board;

use core::fmt::Write as _;

use embassy_executor::{Executor, InterruptExecutor, SpawnError, SpawnToken};
use embassy_rp::clocks::clk_sys_freq;
use embassy_rp::gpio::Output;
use embassy_rp::interrupt::{self, InterruptExt, Priority};
use embassy_rp::pac;
use embassy_rp::pac::watchdog::regs::Load;
use embassy_rp::watchdog::{ResetReason, Watchdog};
use embassy_time::{Duration, Instant};
use firmware::sampling::{Sensor, Tick};
use firmware::supervision::StackDepth;
use firmware::{Board, Crystal, Foot, Ports, Start, tasks};
use lsm6dsox::BusSpeed;
use static_cell::StaticCell;
use storage::{Storage, StoreFailed};
use wire::Diagnosis;
use wire::diagnosis::Reset;
use wire::foot::serial_number;
use wire::node::{BootCause, Crash, Program};
use wire::{Fault, Settings};

use board::TICK_US;
use flash::SettingsFlash;
use resets::Restart;
use timebase::{Delay, Timebase};

/// State shared between the levels.
static PORTS: Ports = Ports::new();

static SAMPLING: InterruptExecutor = InterruptExecutor::new();
static COMMUNICATION: InterruptExecutor = InterruptExecutor::new();

/// Period of the watchdog: longer than the erase of a sector, 400 ms at most.
const WATCHDOG: Duration = Duration::from_millis(1_000);

/// Runs the program.
pub fn run() -> ! {
    static THREAD: StaticCell<Executor> = StaticCell::new();
    static FOOT: StaticCell<Foot> = StaticCell::new();

    let p = embassy_rp::init(embassy_rp::config::Config::new(board::clocks()));
    let wiring = board::wiring(p);
    let mut watchdog = Watchdog::new(wiring.watchdog);
    let restart = Restart::take(&mut watchdog);
    watchdog.start(WATCHDOG);
    crash::select_all();
    let crash = crash::take();

    let mut flash = SettingsFlash::new(wiring.flash);
    let identifier = board::identifier(&mut flash);
    let id = board::unique_id(&identifier);
    let Ok(mut storage) = Storage::new(flash, &(0..flash::SETTINGS)) else {
        halt();
    };
    let (settings, origin) = storage.load_at_start(restart.timeouts);
    let timed_out = restart.reason == Some(ResetReason::TimedOut);
    let reason = match crash {
        Some(record) => Some(record.into()),
        None => timed_out.then_some(Crash { fault: Fault::WatchdogReset, program_counter: 0 }),
    };
    let start = Start {
        serial: serial_number(id),
        hardware: board::HARDWARE,
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
        diagnosis: Diagnosis {
            reset: match restart.reason {
                None => Reset::Power,
                Some(ResetReason::Forced) => Reset::Program,
                Some(ResetReason::TimedOut) => Reset::Watchdog,
            },
            clock_khz: clk_sys_freq() / 1_000,
            is_crystal_used: true,
            identifier: words(&identifier),
            bus_khz: BusSpeed::ALL.map(|speed| (sensor::bus_hertz(speed) / 1_000) as u16),
            ..Diagnosis::default()
        },
    };
    let Ok(foot) = Foot::new_in(FOOT.uninit(), settings, start) else { halt() };
    foot.disable_can(TICK_US);
    let range = foot.settings().accelerometer_range();

    interrupt::SWI_IRQ_1.set_priority(Priority::P3);
    let communication = COMMUNICATION.start(interrupt::SWI_IRQ_1);
    once(usb::serve(wiring.usb, text_of(id)), |task| {
        communication.spawn(task);
    });

    interrupt::SWI_IRQ_0.set_priority(Priority::P1);
    let level = SAMPLING.start(interrupt::SWI_IRQ_0);
    let sensor = Sensor::new(sensor::SensorBus::new(wiring.sensor), board::SENSOR)
        .with_accelerometer_range(range);
    let ticks = Timebase::new(wiring.data_ready);
    once(sample(sensor, ticks, foot), |task| level.spawn(task));

    THREAD.init(Executor::new()).run(|thread| {
        once(serve_requests(storage), |task| thread.spawn(task));
        once(feed_watchdog(), |task| thread.spawn(task));
        #[cfg(feature = "nano-rp2040")]
        once(board::loader::forget_press(), |task| thread.spawn(task));
        once(blink(wiring.led), |task| thread.spawn(task));
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

/// Identifier as words, whose digits are in the order of its bytes.
fn words(identifier: &[u8; 16]) -> [u32; 4] {
    let mut words = [0; 4];
    for (word, bytes) in words.iter_mut().zip(identifier.as_chunks::<4>().0) {
        *word = u32::from_be_bytes(*bytes);
    }
    words
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
struct ThisBoard;

impl Board for ThisBoard {
    const FEEDING_MS: u32 = 60;

    fn load_reading(&self) -> Option<u16> {
        None
    }

    fn micros_since_edge(&self, tick: &Tick) -> u32 {
        Instant::now().as_micros().saturating_sub(tick.sampled().as_micros()) as u32
    }

    fn feed_watchdog(&self) {
        let steps = board::WATCHDOG_STEPS * WATCHDOG.as_micros() as u32;
        pac::WATCHDOG.load().write_value(Load(steps));
        resets::end_row();
    }

    fn look_at_stack(&self, depth: &mut StackDepth) -> Option<usize> {
        stack::look(depth)
    }

    fn apply_rates(&self, _: &Settings) {}

    fn protect(&self) -> Result<(), StoreFailed> {
        // Nothing is left to protect: the loader is in the chip's ROM, and the detector of a low supply is on after
        // each reset.
        Ok(())
    }

    fn confirm_program(&self) -> Result<(), StoreFailed> {
        // The loader is in the chip's ROM.
        Ok(())
    }

    fn start_bootloader(&self) -> ! {
        wiring::start_loader()
    }

    fn reset(&self) -> ! {
        crash::reset()
    }
}

/// Sampling level: tick, edge, burst, estimate and frames.
#[embassy_executor::task]
async fn sample(sensor: Sensor<sensor::SensorBus>, ticks: Timebase, foot: &'static mut Foot) {
    tasks::sample(sensor, Delay, ticks, foot, &ThisBoard, &PORTS).await;
}

/// Thread level: serves requests of the foot that take longer than a tick.
#[embassy_executor::task]
async fn serve_requests(storage: Storage<SettingsFlash>) {
    tasks::serve_requests(storage, Delay, &ThisBoard, &PORTS).await;
}

/// Thread level: feeds the watchdog, and measures the depth of the stack.
#[embassy_executor::task]
async fn feed_watchdog() {
    tasks::feed_watchdog(Delay, &ThisBoard, &PORTS).await;
}

/// Thread level: shows the stage.
#[embassy_executor::task]
async fn blink(led: Output<'static>) {
    tasks::blink(led, Delay, &PORTS).await;
}

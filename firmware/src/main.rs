//! The foot's program, in the order of a sample's path: the board starts, the sampling loop
//! turns data-ready edges into frames, the communication sends frames and receives requests, and
//! the thread level stores settings and feeds the watchdog.
//!
//! Three levels; a lower one never delays a higher one:
//!
//! | level | what runs there |
//! |---|---|
//! | sampling, an executor at interrupt priority 2 | [`sample`] |
//! | communication, an executor at interrupt priority 5 | [`send_can`], [`receive_can`], [`send_uart`], [`receive_uart`] |
//! | thread | [`serve_requests`], [`feed_watchdog`], [`blink`] |

#![no_std]
#![no_main]

mod board;

use core::mem::{self, discriminant};
use core::ops::Range;
use core::sync::atomic::{AtomicU8, Ordering};

use defmt_rtt as _;
use embassy_executor::{Executor, InterruptExecutor, SpawnError, SpawnToken};
use embassy_futures::select::{Either, select};
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer, with_timeout};
use firmware::commands::UartReceiver;
use firmware::ports::{BusState, Input, Reloaded, Request, UartBatch};
use firmware::sampling::{self, Sensor};
use firmware::storage::{MOST_WATCHDOG_RESETS, Origin, Storage};
use firmware::supervision::Worker;
use firmware::{Foot, Ports, Start};
use static_cell::StaticCell;
use wire::node::{BootCause, Crash};
use wire::{Fault, Settings, Stage};

use board::clocks::Source;
use board::crash::Reset;
use board::flash::ConfigFlash;

/// State shared between the interrupt levels.
static PORTS: Ports = Ports::new();

/// State shown by the LED: the stage's code, and [`FAULT`] while a fault is active.
static LIGHT: AtomicU8 = AtomicU8::new(0);
const FAULT: u8 = 0x80;

/// New rate of the UART.
static UART_RATE: Signal<CriticalSectionRawMutex, u32> = Signal::new();

static SAMPLING: InterruptExecutor = InterruptExecutor::new();
static COMMUNICATION: InterruptExecutor = InterruptExecutor::new();

/// Time without a frame taken by the bus after which queued frames are too old.
const BUS_DEADLINE: Duration = Duration::from_millis(20);

/// Interval of feeding the watchdog.
const FEEDING: Duration = Duration::from_millis(board::watchdog::FEEDING_MILLIS as u64);

/// Identifiers of process data: a later frame supersedes an earlier one.
const PROCESS_DATA: Range<u16> = 0x180..0x580;

/// Flash with the settings.
type Store = Storage<ConfigFlash>;

#[cortex_m_rt::entry]
fn main() -> ! {
    static THREAD: StaticCell<Executor> = StaticCell::new();

    let board = board::start();
    let mut led = board.led;
    let Ok(mut storage) = Storage::new(board.flash, &(0..board::flash::SIZE)) else {
        halt(&mut led, "the configuration's pages are none");
    };
    // As delivered, brown-out reset is off. Not after another reset: an attempt that ends in one is not repeated.
    if board.reset == Reset::Power && board::flash::brown_out_level() == 0 {
        let level = storage.flash().protect_supply().map_or(0, |()| 3);
        defmt::warn!(
            "brown-out reset was off, level from the next power-up on: {=u8}",
            level
        );
    }
    // Nothing is written until a store: the settings in flash stay for inspection.
    let (settings, origin) = match board.watchdog_resets {
        0..MOST_WATCHDOG_RESETS => storage.load(),
        _ => (Settings::default(), Origin::NotRead),
    };
    let start = Start {
        serial: board.serial,
        cause: match (board.reset, board.crash.is_some()) {
            (Reset::Software, false) => BootCause::Commanded,
            _ => BootCause::PowerUp,
        },
        crash: reason_for_start(board.crash, board.reset),
        origin,
        unused_crystal_khz: match board.clock {
            Source::Crystal => None,
            Source::Internal(khz) => Some(khz),
        },
        brown_out_level: board::flash::brown_out_level(),
    };
    log_boot(&start);
    let Some(foot) = make_foot(settings, start) else {
        halt(&mut led, "the default settings do not fit each other");
    };
    let settings = foot.settings();
    let (can_rate, uart_rate) = (settings.can_bit_rate(), settings.uart_rate());
    let self_test = settings.self_test();
    let Ok((uart_out, uart_in)) = board.uart.start(uart_rate) else {
        halt(&mut led, "the UART cannot have its rate");
    };

    interrupt::UART4.set_priority(board::SAMPLING_EXECUTOR_PRIORITY);
    let sampling = SAMPLING.start(interrupt::UART4);
    let sensor = Sensor::new(board.sensor);
    once(
        sample(sensor, board.timebase, board.load, foot, self_test),
        |task| sampling.spawn(task),
    );

    interrupt::UART5.set_priority(board::COMMUNICATION_EXECUTOR_PRIORITY);
    let communication = COMMUNICATION.start(interrupt::UART5);
    // Without a crystal the bus is not joined: the clock is not accurate enough for it.
    let can = (board.clock == Source::Crystal).then(|| {
        let (control, can_out, can_in) = board.can.start(can_rate);
        PORTS.connect_can(board::can::try_send);
        once(send_can(can_out), |task| communication.spawn(task));
        once(receive_can(can_in), |task| communication.spawn(task));
        control
    });
    once(send_uart(uart_out), |task| communication.spawn(task));
    once(receive_uart(uart_in), |task| communication.spawn(task));

    THREAD.init(Executor::new()).run(|thread| {
        once(serve_requests(storage, can), |task| thread.spawn(task));
        once(feed_watchdog(), |task| thread.spawn(task));
        once(blink(led), |task| thread.spawn(task));
    })
}

// The sampling level.

/// Runs tick, edge, burst, estimate and frames, forever.
#[embassy_executor::task]
async fn sample(
    sensor: Sensor<board::sensor::SensorBus>,
    ticks: board::timebase::Timebase,
    load: board::load::LoadSensor,
    foot: &'static mut Foot,
    self_test: bool,
) {
    let mut bus = BusState::Active;
    let mut id = 0;
    sampling::run(
        sensor,
        board::sensor::Delay,
        ticks,
        self_test,
        |tick, measurement| {
            foot.tick(tick, measurement, Some(load.reading()), &PORTS);
            report_bus_state(&mut bus);
            if mem::replace(&mut id, foot.node_id()) != foot.node_id() {
                board::can::listen_as(foot.node_id());
            }
            let fault = if foot.faults().is_empty() { 0 } else { FAULT };
            LIGHT.store(foot.stage().code() | fault, Ordering::Relaxed);
        },
    )
    .await;
}

/// Reports a change of the bus state to the foot, for its next tick. Bus-off lasts at least 1.4 ms.
fn report_bus_state(known: &mut BusState) {
    let state = board::can::bus_state();
    // A change of the error counters alone is not reported.
    if discriminant(&state) != discriminant(known) && PORTS.try_put(Input::Bus(state)) {
        *known = state;
    }
}

// The communication level.

/// Sends the frames that the bus did not take at once. If it takes none until the deadline, process
/// data are withdrawn, from the mailboxes too: the first frames after a recovery are new.
#[embassy_executor::task]
async fn send_can(mut can: board::can::Sender) {
    loop {
        PORTS.can_ready().await;
        PORTS.liveness.report(Worker::Can);
        PORTS.send_can();
        if !PORTS.can_is_empty() && with_timeout(BUS_DEADLINE, can.freed()).await.is_err() {
            let count = can.withdraw(&PROCESS_DATA).await + PORTS.withdraw_can();
            if count > 0 {
                PORTS.put(Input::CanWithdrawn(count)).await;
            }
        }
    }
}

/// Passes frames from the bus to the foot.
#[embassy_executor::task]
async fn receive_can(mut can: board::can::Receiver) {
    loop {
        let frame = can.receive().await;
        let now = board::timebase::now();
        if can.take_overrun() {
            PORTS.put(Input::CanLost(1)).await;
        }
        PORTS.put(Input::Can(frame, now)).await;
    }
}

/// Sends frames over the serial line, all queued ones in one transfer.
#[embassy_executor::task]
async fn send_uart(mut uart: board::uart::Sender) {
    let mut batch = UartBatch::new();
    loop {
        let rate = match PORTS.take_uart(&mut batch) {
            bytes @ [_, ..] => {
                if uart.send(bytes).await.is_err() {
                    // Each frame ends with its only zero.
                    let frames = bytes.iter().filter(|byte| **byte == 0).count();
                    PORTS.put(Input::UartDropped(frames as u32)).await;
                }
                UART_RATE.try_take()
            }
            [] => match select(PORTS.uart_ready(), UART_RATE.wait()).await {
                Either::First(()) => None,
                Either::Second(rate) => Some(rate),
            },
        };
        if let Some(rate) = rate {
            uart.set_rate(rate).await;
        }
        PORTS.liveness.report(Worker::Uart);
    }
}

/// Passes requests from the serial line to the foot.
#[embassy_executor::task]
async fn receive_uart(mut uart: board::uart::Receiver) {
    /// More bytes than arrive during two ticks of the timer, at 3 Mbaud.
    const CHUNK: usize = 128;
    let mut requests = UartReceiver::new();
    let mut bytes = [0; CHUNK];
    loop {
        let Some(bytes) = uart.receive(&mut bytes).await else {
            PORTS.put(Input::UartLost(1)).await;
            // A line with the wrong rate causes only errors.
            Timer::after_millis(1).await;
            continue;
        };
        for byte in bytes {
            if let Some(request) = requests.push(*byte) {
                PORTS.put(request).await;
            }
        }
        if let Some(refused) = requests.refused() {
            PORTS.put(refused).await;
        }
        // In an unbroken stream the next byte is always ready, and no other task of this or a lower level would run.
        Timer::after_ticks(1).await;
    }
}

// The thread level.

/// Serves requests of the foot that take longer than a tick.
#[embassy_executor::task]
async fn serve_requests(mut storage: Store, mut can: Option<board::can::Control>) {
    loop {
        match PORTS.next_request().await {
            Request::Store(settings, erase) => {
                let stored = storage.store(&settings, erase);
                PORTS.put(Input::Stored(stored)).await;
            }
            Request::Restore(erase) => {
                let forgotten = storage.restore(erase);
                PORTS.put(Input::Stored(forgotten)).await;
            }
            Request::ProtectSupply => {
                let protected = storage.flash().protect_supply();
                PORTS.put(Input::Protected(protected)).await;
            }
            Request::Reload => {
                let (settings, origin) = storage.load();
                if let Some(can) = &mut can {
                    can.set_bit_rate(settings.can_bit_rate());
                }
                UART_RATE.signal(settings.uart_rate());
                PORTS.reload(Reloaded { settings, origin }).await;
            }
            Request::Reset => cortex_m::peripheral::SCB::sys_reset(),
        }
    }
}

/// Feeds the watchdog while all workers are alive, and measures the depth of the stack.
#[embassy_executor::task]
async fn feed_watchdog() {
    let mut stack = board::stack::Depth::default();
    loop {
        PORTS.call();
        Timer::after(FEEDING).await;
        if PORTS.liveness.all_alive() {
            board::watchdog::feed();
            board::crash::forget_watchdog_resets();
        }
        if let Some(used) = stack.look() {
            defmt::info!("stack: {} of {} bytes", used, board::stack::size());
        }
    }
}

/// Shows the stage: duration of the LED on and then off, ms.
#[embassy_executor::task]
async fn blink(mut led: Output<'static>) {
    loop {
        let light = LIGHT.load(Ordering::Relaxed);
        let stage = Stage::from_code(light & !FAULT).unwrap_or(Stage::Starting);
        let (on, off) = match stage {
            Stage::Starting | Stage::SelfTest => (50, 50),
            Stage::HoldStill => (250, 250),
            Stage::Recovering => (50, 150),
            Stage::Running if light & FAULT != 0 => (900, 100),
            Stage::Running => (50, 950),
        };
        led.set_high();
        Timer::after_millis(on).await;
        led.set_low();
        Timer::after_millis(off).await;
    }
}

// Starting.

/// Previous crash, if it caused this start.
fn reason_for_start(crash: Option<board::crash::Crash>, reset: Reset) -> Option<Crash> {
    if let Some(crash) = crash {
        defmt::error!(
            "previous crash at {=u32:#010x}: reason {=u32}, detail {=u32:#x}",
            crash.record.program_counter,
            crash.record.reason as u32,
            crash.detail
        );
        return Some(crash.record.into());
    }
    (reset == Reset::Watchdog).then_some(Crash {
        fault: Fault::WatchdogReset,
        program_counter: 0,
    })
}

fn log_boot(start: &Start) {
    defmt::info!(
        "footfall {=str}, serial {=u32:08x}, {=str} settings, {=str} oscillator",
        env!("CARGO_PKG_VERSION"),
        start.serial,
        match start.origin {
            Origin::Stored => "stored",
            Origin::Blank => "default",
            Origin::Corrupted | Origin::Incompatible | Origin::NotRead => "unreadable",
        },
        if start.unused_crystal_khz.is_some() {
            "internal"
        } else {
            "crystal"
        },
    );
    if let Some(khz) = start.unused_crystal_khz {
        defmt::error!("crystal: {=u32} kHz", khz);
    }
}

/// Creates the foot in its static place, with defaults instead of unusable settings. Separate from `main`, so
/// that the stack it needs is free again.
#[inline(never)]
fn make_foot(mut settings: Settings, mut start: Start) -> Option<&'static mut Foot> {
    static FOOT: StaticCell<Foot> = StaticCell::new();
    let mut config = settings.params().validate();
    if config.is_err() {
        start.origin = Origin::Incompatible;
        settings = Settings::default();
        config = settings.params().validate();
    }
    let config = config.ok()?;
    let foot = FOOT.init_with(|| Foot::with_config(settings, &config, start));
    Some(foot)
}

/// Spawns a task that exists once.
fn once<S>(task: Result<SpawnToken<S>, SpawnError>, spawn: impl FnOnce(SpawnToken<S>)) {
    match task {
        Ok(task) => spawn(task),
        Err(_) => defmt::error!("a task was spawned twice"),
    }
}

/// Ends a start with an inconsistency: LED on, a line in the log, and finally the watchdog's reset.
fn halt(led: &mut Output<'static>, why: &str) -> ! {
    led.set_high();
    defmt::error!("cannot start: {=str}", why);
    loop {
        cortex_m::asm::wfi();
    }
}

// The interrupts that run the executors; their own peripherals are not used. The barriers: see `board::Barrier`.

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

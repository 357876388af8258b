//! The foot's program on any board with this chip. It starts the board, and its tasks connect the peripherals with the
//! library.
//!
//! | level | tasks |
//! |---|---|
//! | sampling, an executor at interrupt priority 2 | [`sample`]: data-ready edges become frames |
//! | communication, an executor at interrupt priority 5 | [`send_can`], [`receive_can`], [`send_uart`], [`receive_uart`] |
//! | thread | [`serve_requests`], [`feed_watchdog`], [`blink`] |

use core::ops::Range;

use bootloader::image;
use embassy_executor::{Executor, InterruptExecutor, SpawnError, SpawnToken};
use embassy_futures::select::{Either, select};
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer, with_timeout};
use firmware::exchange::{BusState, Input};
use firmware::ports::UartBatch;
use firmware::sampling::{Sensor, Tick};
use firmware::supervision::{StackDepth, Worker};
use firmware::uart_requests::UartReceiver;
use firmware::{Board, Crystal, Foot, Ports, Start, tasks};
use lsm6dsox::Config;
use static_cell::StaticCell;
use stm32f405_chip::crystal::Frequency;
use stm32f405_chip::supply;
use storage::{Origin, Storage, StoreFailed};
use wire::diagnosis::Reset;
use wire::node::{BootCause, Crash};
use wire::{Fault, Settings};

use crate::can::{self, Can1Mailboxes};
use crate::clocks::Source;
use crate::crash;
use crate::flash::{self, ConfigFlash};
use crate::load::LoadSensor;
use crate::sensor::{Delay, SensorBus};
use crate::timebase::{self, Timebase};
use crate::{stack, uart, update, watchdog, wiring};

/// State shared between the interrupt levels.
static PORTS: Ports<Can1Mailboxes> = Ports::with_mailboxes(Can1Mailboxes);

/// New rate of the UART.
static UART_RATE: Signal<CriticalSectionRawMutex, u32> = Signal::new();

static SAMPLING: InterruptExecutor = InterruptExecutor::new();
static COMMUNICATION: InterruptExecutor = InterruptExecutor::new();

/// Starts the board and runs the foot.
pub fn run() -> ! {
    static THREAD: StaticCell<Executor> = StaticCell::new();
    static FOOT: StaticCell<Foot> = StaticCell::new();
    static BOARD: StaticCell<Stm32f405> = StaticCell::new();

    let peripherals = crate::start();
    let mut led = peripherals.led;
    let Ok(mut storage) = Storage::new(peripherals.flash, &(0..flash::SIZE)) else {
        halt(&mut led, "configuration pages do not fit the flash layout");
    };
    // As delivered, brown-out reset and write protection are off. The protection is set only after a power-up. So an
    // attempt that ends in another reset is not repeated, and a probe can lift the protection to write another
    // bootloader.
    let is_open = flash::brown_out_level() == 0 || !flash::is_bootloader_protected();
    if peripherals.reset == Reset::Power && is_open && supply_holds(&mut led) {
        let is_protected = flash::protect().is_ok();
        defmt::warn!("option bytes written: {=bool}", is_protected);
    }
    // Nothing is written before a store, so that the settings in flash stay for inspection.
    let (settings, origin) = storage.load_at_start(peripherals.watchdog_resets);
    let start = Start {
        serial: peripherals.serial,
        hardware: match wiring::BOARD {
            image::Board::Reference => "STM32F405RG + LSM6DSOX",
            image::Board::Feather => "Feather STM32F405 + LSM6DSOX",
        },
        cause: match (peripherals.reset, peripherals.crash.is_some()) {
            (Reset::Program, false) if !update::take_resume() => BootCause::Commanded,
            _ => BootCause::PowerUp,
        },
        crash: reason_for_start(peripherals.crash, peripherals.reset),
        origin,
        crystal: match peripherals.clock {
            Source::Crystal(Frequency::Measured(_)) => Crystal::InUse,
            Source::Crystal(Frequency::NotMeasured) => Crystal::NotMeasured,
            Source::Internal(khz) => Crystal::Unused { khz },
        },
        brown_out_level: Some(flash::brown_out_level()),
        program: update::program(),
        diagnosis: crate::diagnosis(peripherals.clock, peripherals.reset),
    };
    log_boot(&start);
    let Ok(foot) = Foot::new_in(FOOT.uninit(), settings, start) else {
        halt(&mut led, "the default settings do not fit each other");
    };
    let settings = foot.settings();
    let range = settings.accelerometer_range();
    let Ok((uart_out, uart_in)) = peripherals.uart.start(settings.uart_rate()) else {
        halt(&mut led, "the UART cannot have its rate");
    };

    interrupt::UART5.set_priority(crate::COMMUNICATION_EXECUTOR_PRIORITY);
    let communication = COMMUNICATION.start(interrupt::UART5);
    // Without a crystal the clock is too inaccurate for CAN. The foot then does not join the bus.
    let can = matches!(peripherals.clock, Source::Crystal(_)).then(|| {
        let (control, can_out, can_in) = peripherals.can.start(settings.can_bit_rate());
        once(send_can(can_out), |task| communication.spawn(task));
        once(receive_can(can_in), |task| communication.spawn(task));
        control
    });
    once(send_uart(uart_out), |task| communication.spawn(task));
    once(receive_uart(uart_in), |task| communication.spawn(task));
    let board = &*BOARD.init(Stm32f405 { load: peripherals.load, can });

    // Started after the tasks that send, so that the first frames neither wait for the buses to start nor replace each
    // other in the queue.
    interrupt::UART4.set_priority(crate::SAMPLING_EXECUTOR_PRIORITY);
    let level = SAMPLING.start(interrupt::UART4);
    let sensor = Sensor::new(peripherals.sensor, Config::FRESH_KILOHERTZ)
        .with_bus_speeds(wiring::SENSOR_START, wiring::SENSOR_SPEED)
        .with_accelerometer_range(range);
    once(sample(sensor, peripherals.timebase, foot, board), |task| level.spawn(task));

    THREAD.init(Executor::new()).run(|thread| {
        once(serve_requests(storage, board), |task| thread.spawn(task));
        once(feed_watchdog(board), |task| thread.spawn(task));
        once(blink(led), |task| thread.spawn(task));
    })
}

/// Returns whether the supply stays high enough for two seconds. It is checked every millisecond, so that a bouncing
/// connector is likely to fail. Meanwhile the LED flickers as during start-up.
fn supply_holds(led: &mut Output<'static>) -> bool {
    let holds = (0..2_000).all(|ms| {
        led.set_level((ms / 50 % 2 == 0).into());
        embassy_time::block_for(Duration::from_millis(1));
        watchdog::feed();
        !supply::is_low()
    });
    led.set_low();
    holds
}

/// Previous crash, if it caused this start.
fn reason_for_start(crash: Option<crash::Crash>, reset: Reset) -> Option<Crash> {
    if let Some(crash) = crash {
        defmt::error!(
            "previous crash at {=u32:#010x}: reason {=u32}, detail {=u32:#x}",
            crash.record.program_counter,
            crash.record.reason as u32,
            crash.detail
        );
        return Some(crash.record.into());
    }
    (reset == Reset::Watchdog).then_some(Crash { fault: Fault::WatchdogReset, program_counter: 0 })
}

/// Logs the first lines.
fn log_boot(start: &Start) {
    defmt::info!(
        "footfall {=str}, program {=u32:08x}, serial {=u32:08x}, {=str} settings, {=str} oscillator",
        env!("CARGO_PKG_VERSION"),
        start.program.identification,
        start.serial,
        match start.origin {
            Origin::Stored => "stored",
            Origin::Blank => "default",
            Origin::NotLearnt => "stored, but not learnt",
            Origin::Corrupted | Origin::Incompatible | Origin::NotRead => "unreadable",
        },
        match start.crystal {
            Crystal::InUse | Crystal::NotMeasured => "crystal",
            Crystal::Unused { .. } => "internal",
        },
    );
    match start.crystal {
        Crystal::InUse => {}
        Crystal::NotMeasured => defmt::warn!("crystal: not measured"),
        Crystal::Unused { khz } => defmt::error!("crystal: {=u32} kHz", khz),
    }
}

/// Spawns a task that exists once.
fn once<S>(task: Result<SpawnToken<S>, SpawnError>, spawn: impl FnOnce(SpawnToken<S>)) {
    match task {
        Ok(task) => spawn(task),
        Err(_) => defmt::error!("a task was spawned twice"),
    }
}

/// Ends a start that found an inconsistency: LED on, a line in the log, and finally the watchdog's reset.
fn halt(led: &mut Output<'static>, why: &str) -> ! {
    led.set_high();
    defmt::error!("cannot start: {=str}", why);
    loop {
        cortex_m::asm::wfi();
    }
}

/// The board, as the library uses it.
struct Stm32f405 {
    load: LoadSensor,
    /// Absent without a crystal.
    can: Option<can::Control>,
}

impl Board for Stm32f405 {
    const FEEDING_MS: u32 = watchdog::FEEDING_MILLIS;

    fn begin_tick(&self) {
        // The cost of the board does not include a contact that has waited for the bus since an earlier tick.
        can::clear_mailbox_latency();
    }

    fn end_tick(&self) {
        flash::note_tick();
    }

    fn load_reading(&self) -> Option<u16> {
        Some(self.load.reading())
    }

    fn bus_state(&self) -> BusState {
        can::bus_state()
    }

    fn listen_as(&self, node_id: u8) {
        can::listen_as(node_id);
    }

    fn micros_to_mailbox(&self) -> u32 {
        can::mailbox_latency_us()
    }

    fn micros_since_edge(&self, _: &Tick) -> u32 {
        timebase::since_edge()
    }

    fn is_acknowledged(&self) -> bool {
        can::has_sent()
    }

    fn feed_watchdog(&self) {
        watchdog::feed();
        crash::forget_watchdog_resets();
    }

    fn look_at_stack(&self, depth: &mut StackDepth) -> Option<usize> {
        let used = stack::look(depth)?;
        defmt::info!("stack: {} of {} bytes", used, stack::size());
        Some(used)
    }

    fn apply_rates(&self, settings: &Settings) {
        if let Some(can) = &self.can {
            can.set_bit_rate(settings.can_bit_rate());
        }
        UART_RATE.signal(settings.uart_rate());
    }

    fn protect(&self) -> Result<(), StoreFailed> {
        flash::protect()
    }

    fn confirm_program(&self) -> Result<(), StoreFailed> {
        let confirmed = update::confirm();
        if confirmed.is_err() {
            defmt::error!("the new program could not be confirmed");
        }
        confirmed
    }

    fn start_bootloader(&self) -> ! {
        update::ask_for_bootloader();
        self.reset()
    }

    fn reset(&self) -> ! {
        cortex_m::peripheral::SCB::sys_reset()
    }
}

/// Sampling level: tick, edge, burst, estimate and frames.
#[embassy_executor::task]
async fn sample(
    sensor: Sensor<SensorBus>,
    ticks: Timebase,
    foot: &'static mut Foot,
    board: &'static Stm32f405,
) {
    timebase::discard();
    tasks::sample(sensor, Delay, ticks, foot, board, &PORTS).await;
}

/// Time without a frame taken by the bus after which queued frames are too old.
const BUS_DEADLINE: Duration = Duration::from_millis(20);

/// Identifiers of process data. A later frame of process data supersedes an earlier one.
const PROCESS_DATA: Range<u16> = 0x180..0x580;

/// Sends the frames that the bus did not take at once. If the bus takes none until the deadline, process data are
/// withdrawn, also from the mailboxes, so that the first frames after a recovery are new.
#[embassy_executor::task]
async fn send_can(mut can: can::Sender) {
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
async fn receive_can(mut can: can::Receiver) {
    loop {
        let (frame, at) = can.receive().await;
        if can.take_overrun() {
            PORTS.put(Input::CanLost(1)).await;
        }
        PORTS.put(Input::Can(frame, at)).await;
    }
}

/// Sends frames over the serial line, all queued ones in one transfer.
#[embassy_executor::task]
async fn send_uart(mut uart: uart::Sender) {
    let mut batch = UartBatch::default();
    loop {
        let sent = {
            // No tick may come between the choice of the frames and the start of their transfer. A tick would delay
            // the transfer by its own duration, and the contact after the next one could then replace it in the queue.
            let (line, frames) = (&mut uart, &mut batch);
            let transfer = critical_section::with(move |_| match PORTS.take_uart(frames) {
                [] => None,
                bytes => Some(line.start(bytes)),
            });
            match transfer {
                Some(transfer) => Some(transfer.end().await),
                None => None,
            }
        };
        let rate = match sent {
            Some(sent) => {
                if let Err(uart::NotSent(frames)) = sent {
                    PORTS.put(Input::UartDropped(frames)).await;
                }
                UART_RATE.try_take()
            }
            None => match select(PORTS.uart_ready(), UART_RATE.wait()).await {
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
async fn receive_uart(mut uart: uart::Receiver) {
    /// More than the number of bytes that arrive during two ticks of the timer at the largest rate.
    const CHUNK: usize = 128;
    let mut requests = UartReceiver::new();
    let mut bytes = [0; CHUNK];
    loop {
        let Some(bytes) = uart.receive(&mut bytes).await else {
            PORTS.put(Input::UartLost(1)).await;
            // A line with the wrong rate causes errors without end. The wait limits their cost.
            Timer::after_millis(1).await;
            continue;
        };
        PORTS.put_uart(&mut requests, bytes).await;
        // In an unbroken stream the next byte is always ready, and without a wait no other task of this or a lower
        // level would run.
        Timer::after_ticks(1).await;
    }
}

/// Thread level: serves requests of the foot that take longer than a tick.
#[embassy_executor::task]
async fn serve_requests(storage: Storage<ConfigFlash>, board: &'static Stm32f405) {
    tasks::serve_requests(storage, Delay, board, &PORTS).await;
}

/// Thread level: feeds the watchdog, confirms a new program, and measures the depth of the stack.
#[embassy_executor::task]
async fn feed_watchdog(board: &'static Stm32f405) {
    tasks::feed_watchdog(Delay, board, &PORTS).await;
}

/// Thread level: shows the stage.
#[embassy_executor::task]
async fn blink(led: Output<'static>) {
    tasks::blink(led, Delay, &PORTS).await;
}

// Interrupts that run the executors. Their own peripherals are unused. For the barriers see `crate::Barrier`.

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

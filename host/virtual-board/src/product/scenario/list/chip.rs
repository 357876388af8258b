//! Faults of the chip: its clocks, its core, its supply.

use wire::Fault;

use super::{
    LASTING, LOAD_FROM_ANALOG, LOADED, ONE_TICK_US, PLAIN, SENSOR, SENSOR_STREAM, SERIAL_DMA,
    SERIAL_STREAM, TIMER,
};
use crate::emulator::board::Injection::{
    BrownOut, CrystalLost, DebuggerHalt, Derail, DmaError, Hang, InterruptLost, Load, Panic, Reset,
    StackOverflow,
};
use crate::emulator::chip::Crystal;
use crate::emulator::corner::Corner;
use crate::emulator::part::rcc::ResetCause;
use crate::product::scenario::ScenarioStep::{Inject, Wait};
use crate::product::scenario::{Invalid, Reports, Scenario};

/// The crystal stops and does not start again.
const CRYSTAL_LOST: Scenario = Scenario {
    with_can: false,
    reports: Reports::Fault(Fault::CrystalMissing),
    note: "remains reported; CAN stays off",
    ..PLAIN
};

/// No crystal from power-up on.
const NO_CRYSTAL: Scenario = Scenario { at_power_up: true, ..CRYSTAL_LOST };

/// A hang, ended by the watchdog.
const HANG: Scenario = Scenario {
    steps: |_| vec![Inject(Hang)],
    invalid: Invalid::UntilNextSample,
    blind_us: ONE_TICK_US,
    reports: Reports::Fault(Fault::WatchdogReset),
    resets: &[ResetCause::Watchdog],
    ..PLAIN
};

/// Rows in the order of the table.
#[rustfmt::skip]
pub(super) const ROWS: &[Scenario] = &[
    Scenario { name: "no-crystal", what: "crystal missing at power-up",
        board: |options, _| options.chip.crystal = Crystal::Missing, ..NO_CRYSTAL },
    Scenario { name: "crystal-lost", what: "crystal stops while running", steps: |_| vec![Inject(CrystalLost)],
        resets: &[ResetCause::Software], ..CRYSTAL_LOST },
    Scenario { name: "stack-overflow", what: "stack overflow", steps: |_| vec![Inject(StackOverflow)],
        reports: Reports::Fault(Fault::HardFault), resets: &[ResetCause::Software], ..PLAIN },
    Scenario { name: "hard-fault", what: "jump to an unmapped address: HardFault", steps: |_| vec![Inject(Derail)],
        reports: Reports::Fault(Fault::HardFault), resets: &[ResetCause::Software], ..PLAIN },
    Scenario { name: "panic", what: "panic", steps: |_| vec![Inject(Panic)], reports: Reports::Fault(Fault::Panic),
        resets: &[ResetCause::Software], ..PLAIN },
    Scenario { name: "hang", what: "endless loop, interrupts masked", ..HANG },
    Scenario { name: "sampling-stuck", what: "sampling task stuck: its timer's interrupt is lost",
        steps: |_| vec![Inject(InterruptLost(TIMER))], ..HANG },
    Scenario { name: "uart-stuck", what: "UART task stuck: its DMA's interrupt is lost",
        steps: |_| vec![Inject(InterruptLost(SERIAL_DMA))], reports: Reports::Fault(Fault::WatchdogReset),
        note: "CAN continues until the reset", resets: &[ResetCause::Watchdog], ..PLAIN },
    Scenario { name: "brown-out", what: "supply dips: brown-out reset", steps: |_| vec![Inject(BrownOut)],
        reports: Reports::BootUp, resets: &[ResetCause::BrownOut], ..PLAIN },
    Scenario { name: "reset", what: "reset pin", steps: |_| vec![Inject(Reset)], reports: Reports::BootUp,
        resets: &[ResetCause::Pin], ..PLAIN },
    Scenario { name: "load-open", what: "load sensor open", board: |options, _| options.load = LOADED,
        before: &[LOAD_FROM_ANALOG], steps: |_| vec![Inject(Load(0))], lasts_ms: LASTING,
        reports: Reports::Fault(Fault::LoadSensorOpen),
        note: "no load is reported; the probabilities do not depend on it", keeps_time: true, ..PLAIN },
    Scenario { name: "time-wrap", what: "clock passes 2³² µs",
        board: |options, at_us| options.time_base = 0_u32.wrapping_sub(at_us),
        note: "timestamps continue beyond 2³² µs", keeps_time: true, clock_beyond_us: 1 << 32, ..PLAIN },
    Scenario { name: "crystal-lost-at-start", what: "crystal stops during start-up, every 0.5 ms of the first 6 ms",
        steps: |variant| vec![Wait(500 + 500 * variant as u32), Inject(CrystalLost)], variants: (0, 11, 1),
        at_power_up: true, any_reset: true, ..CRYSTAL_LOST },
    Scenario { name: "crystal-and-stack", what: "crystal stops while the stack overflows",
        steps: |_| vec![Inject(StackOverflow), Inject(CrystalLost)], any_reset: true, ..CRYSTAL_LOST },
    Scenario { name: "no-crystal-warm", what: "crystal missing at power-up, internal oscillator 4 % fast",
        board: |options, _| { options.chip.crystal = Crystal::Missing; options.chip.corner = Corner::Fast; },
        ..NO_CRYSTAL },
    Scenario { name: "no-crystal-cold", what: "crystal missing at power-up, internal oscillator 4 % slow",
        board: |options, _| { options.chip.crystal = Crystal::Missing; options.chip.corner = Corner::Slow; },
        ..NO_CRYSTAL },
    Scenario { name: "hang-at-start", what: "endless loop at each ms of start-up",
        steps: |variant| vec![Wait(300 + 1_000 * variant as u32), Inject(Hang)], variants: (0, 13, 1),
        at_power_up: true, invalid: Invalid::UntilNextSample, reports: Reports::Fault(Fault::WatchdogReset),
        resets: &[ResetCause::Watchdog], ..PLAIN },
    Scenario { name: "hang-fast-watchdog", what: "endless loop, the watchdog's oscillator at 47 kHz",
        board: |options, _| options.chip.corner = Corner::Fast, ..HANG },
    Scenario { name: "hang-slow-watchdog", what: "endless loop, the watchdog's oscillator at 17 kHz",
        board: |options, _| options.chip.corner = Corner::Slow, ..HANG },
    Scenario { name: "debugger-halt", what: "a debugger halts the core for 50 ms",
        steps: |_| vec![Inject(DebuggerHalt(50))], reports: Reports::Any, clock_stops: true,
        note: "the board's clock stops meanwhile", ..PLAIN },
    Scenario { name: "two-dma-errors", what: "DMA errors on the sensor's bus and on the serial line at once",
        steps: |_| vec![Inject(DmaError(SENSOR_STREAM)), Inject(DmaError(SERIAL_STREAM))],
        reports: Reports::Fault(Fault::SensorSilent), ..SENSOR },
];

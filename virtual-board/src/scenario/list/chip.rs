//! What can go wrong with the chip: its clocks, its core, its supply.

use wire::Fault as Told;

use super::{
    LASTING, LOAD_FROM_ANALOG, LOADED, ONE_TICK_US, PLAIN, SENSOR, SENSOR_STREAM, SERIAL_DMA,
    SERIAL_STREAM, TIMER,
};
use crate::board::Fault;
use crate::corner::Corner;
use crate::part::rcc::ResetCause;
use crate::scenario::{Invalid, Scenario, Step, Tells};

const NO_CRYSTAL: Scenario = Scenario {
    at_power_up: true,
    with_can: false,
    tells: Tells::Fault(Told::CrystalMissing),
    note: "stays, reported; CAN stays off",
    ..PLAIN
};

const HANG: Scenario = Scenario {
    steps: |_| vec![Step::Wrong(Fault::Hang)],
    invalid: Invalid::ToTheNextSample,
    blind_us: ONE_TICK_US,
    tells: Tells::Fault(Told::WatchdogReset),
    resets: &[ResetCause::Watchdog],
    ..PLAIN
};

/// In the order of the table.
pub(super) const ROWS: &[Scenario] = &[
    Scenario {
        name: "no-crystal",
        what: "crystal missing at power-up",
        board: |options, _| options.chip.crystal = None,
        at_power_up: true,
        with_can: false,
        tells: Tells::Fault(Told::CrystalMissing),
        note: "stays, reported; CAN stays off",
        ..PLAIN
    },
    Scenario {
        name: "crystal-lost",
        what: "crystal stops while running",
        steps: |_| vec![Step::Wrong(Fault::CrystalLost)],
        with_can: false,
        tells: Tells::Fault(Told::CrystalMissing),
        resets: &[ResetCause::Software],
        note: "stays, reported; CAN stays off",
        ..PLAIN
    },
    Scenario {
        name: "stack-overflow",
        what: "stack overflow",
        steps: |_| vec![Step::Wrong(Fault::StackOverflow)],
        tells: Tells::Fault(Told::HardFault),
        resets: &[ResetCause::Software],
        ..PLAIN
    },
    Scenario {
        name: "hard-fault",
        what: "jump to where nothing is: HardFault",
        steps: |_| vec![Step::Wrong(Fault::Derail)],
        tells: Tells::Fault(Told::HardFault),
        resets: &[ResetCause::Software],
        ..PLAIN
    },
    Scenario {
        name: "panic",
        what: "panic",
        steps: |_| vec![Step::Wrong(Fault::Panic)],
        tells: Tells::Fault(Told::Panic),
        resets: &[ResetCause::Software],
        ..PLAIN
    },
    Scenario {
        name: "hang",
        what: "endless loop, interrupts masked",
        steps: |_| vec![Step::Wrong(Fault::Hang)],
        invalid: Invalid::ToTheNextSample,
        blind_us: ONE_TICK_US,
        tells: Tells::Fault(Told::WatchdogReset),
        resets: &[ResetCause::Watchdog],
        ..PLAIN
    },
    Scenario {
        name: "sampling-stuck",
        what: "sampling task stuck: its timer is not heard",
        steps: |_| vec![Step::Wrong(Fault::Deaf(TIMER))],
        invalid: Invalid::ToTheNextSample,
        blind_us: ONE_TICK_US,
        tells: Tells::Fault(Told::WatchdogReset),
        resets: &[ResetCause::Watchdog],
        ..PLAIN
    },
    Scenario {
        name: "uart-stuck",
        what: "UART task stuck: its DMA is not heard",
        steps: |_| vec![Step::Wrong(Fault::Deaf(SERIAL_DMA))],
        tells: Tells::Fault(Told::WatchdogReset),
        note: "CAN goes on until the reset",
        resets: &[ResetCause::Watchdog],
        ..PLAIN
    },
    Scenario {
        name: "brown-out",
        what: "supply dips: brown-out reset",
        steps: |_| vec![Step::Wrong(Fault::BrownOut)],
        tells: Tells::BootUp,
        resets: &[ResetCause::BrownOut],
        ..PLAIN
    },
    Scenario {
        name: "reset",
        what: "reset pin",
        steps: |_| vec![Step::Wrong(Fault::Reset)],
        tells: Tells::BootUp,
        resets: &[ResetCause::Pin],
        ..PLAIN
    },
    Scenario {
        name: "load-open",
        what: "load sensor open",
        board: |options, _| options.load = LOADED,
        before: &[LOAD_FROM_ANALOG],
        steps: |_| vec![Step::Wrong(Fault::Load(0))],
        lasts_ms: LASTING,
        tells: Tells::Fault(Told::LoadSensorOpen),
        note: "the load is left out, the probabilities do not need it",
        keeps_time: true,
        ..PLAIN
    },
    Scenario {
        name: "time-wrap",
        what: "time going over 32 bits of µs",
        board: |options, at_us| options.time_base = 0_u32.wrapping_sub(at_us),
        note: "timestamps go on beyond 2³² µs",
        keeps_time: true,
        clock_beyond_us: 1 << 32,
        ..PLAIN
    },
    Scenario {
        name: "crystal-lost-at-start",
        what: "crystal stops in the course of the start, at each half ms of its first 6",
        steps: |variant| {
            vec![
                Step::Wait(500 + 500 * variant as u32),
                Step::Wrong(Fault::CrystalLost),
            ]
        },
        variants: (0, 11, 1),
        at_power_up: true,
        with_can: false,
        tells: Tells::Fault(Told::CrystalMissing),
        any_reset: true,
        note: "stays, reported; CAN stays off",
        ..PLAIN
    },
    Scenario {
        name: "crystal-and-stack",
        what: "crystal stops while the stack overflows",
        steps: |_| {
            vec![
                Step::Wrong(Fault::StackOverflow),
                Step::Wrong(Fault::CrystalLost),
            ]
        },
        with_can: false,
        tells: Tells::Fault(Told::CrystalMissing),
        any_reset: true,
        note: "stays, reported; CAN stays off",
        ..PLAIN
    },
    Scenario {
        name: "no-crystal-warm",
        what: "crystal missing at power-up, internal oscillator 4 % fast",
        board: |options, _| {
            options.chip.crystal = None;
            options.chip.corner = Corner::Fast;
        },
        ..NO_CRYSTAL
    },
    Scenario {
        name: "no-crystal-cold",
        what: "crystal missing at power-up, internal oscillator 4 % slow",
        board: |options, _| {
            options.chip.crystal = None;
            options.chip.corner = Corner::Slow;
        },
        ..NO_CRYSTAL
    },
    Scenario {
        name: "hang-at-start",
        what: "endless loop at each ms of the start",
        steps: |variant| {
            vec![
                Step::Wait(300 + 1_000 * variant as u32),
                Step::Wrong(Fault::Hang),
            ]
        },
        variants: (0, 13, 1),
        at_power_up: true,
        invalid: Invalid::ToTheNextSample,
        tells: Tells::Fault(Told::WatchdogReset),
        resets: &[ResetCause::Watchdog],
        ..PLAIN
    },
    Scenario {
        name: "hang-fast-watchdog",
        what: "endless loop, the watchdog's oscillator at 47 kHz",
        board: |options, _| options.chip.corner = Corner::Fast,
        ..HANG
    },
    Scenario {
        name: "hang-slow-watchdog",
        what: "endless loop, the watchdog's oscillator at 17 kHz",
        board: |options, _| options.chip.corner = Corner::Slow,
        ..HANG
    },
    Scenario {
        name: "debugger-halt",
        what: "a debugger halts the core for 50 ms",
        steps: |_| vec![Step::Wrong(Fault::DebuggerHalt(50))],
        tells: Tells::Any,
        clock_stops: true,
        note: "the board's clock stands still meanwhile",
        ..PLAIN
    },
    Scenario {
        name: "two-dma-errors",
        what: "the DMA meets errors on the sensor's bus and on the serial line at once",
        steps: |_| {
            vec![
                Step::Wrong(Fault::DmaError(SENSOR_STREAM)),
                Step::Wrong(Fault::DmaError(SERIAL_STREAM)),
            ]
        },
        tells: Tells::Fault(Told::SensorSilent),
        ..SENSOR
    },
];

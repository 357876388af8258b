//! Everything that can go wrong: the rows of the fault matrix, and the names of the command line.

use lsm6dsox::sim::Fault as Sensor;
use wire::dictionary::index;
use wire::{Address, Counter, Fault as Told, Value};

use super::{Invalid, Scenario, Step, Tells};
use crate::board::Fault;
use crate::part::can::BusFault;
use crate::part::rcc::ResetCause;
use crate::part::usart::LineFault;

/// How long what does not end by itself lasts, ms.
const LASTING: Option<u64> = Some(300);

/// TIM2's interrupt: tick and edges.
const TIMER: u16 = 28;

/// The interrupt of the DMA that feeds the serial line.
const SERIAL_DMA: u16 = 70;

/// The streams of DMA2 that fetch from the sensor's bus and feed the serial line.
const SENSOR_STREAM: usize = 0;
const SERIAL_STREAM: usize = 7;

/// A source of load that is plugged in, as read.
const LOADED: u16 = 2000;

/// The sensor's edges are 150 µs apart and its reading takes 20 µs; a frame about the tick before
/// may still be on its way.
const ONE_TICK_US: u64 = 1_700;

/// From which on every kind of fault of the sensor has been found.
const FOUND_US: u64 = 5_000;

const PLAIN: Scenario = Scenario {
    name: "",
    what: "",
    board: |_, _| {},
    before: &[],
    steps: |_| Vec::new(),
    variants: (0, 0, 1),
    at_power_up: false,
    lasts_ms: None,
    invalid: Invalid::Never,
    blind_us: 0,
    phases: 1,
    tells: Tells::Nothing,
    with_can: true,
    resets: &[],
    keeps_time: false,
    clock_beyond_us: 0,
    kept: None,
    note: "",
};

/// Of the sensor, for a while.
const SENSOR: Scenario = Scenario {
    lasts_ms: LASTING,
    invalid: Invalid::ToTheEnd,
    blind_us: ONE_TICK_US,
    phases: 4,
    ..PLAIN
};

const LOAD_FROM_ANALOG: Step = Step::Set(Address::new(index::LOAD_INPUT, 1), Value::U8(1));

/// A setting that is changed, where it does not matter which.
const LOAD_SCALE: Address = Address::new(index::LOAD_INPUT, 2);

const OLD_AND_NEW: [Value; 2] = [Value::F32(2.0), Value::F32(3.0)];

/// All of them, in the order of the table.
pub static ALL: &[Scenario] = &[
    Scenario {
        name: "miso-low",
        what: "SPI data line stuck low",
        steps: |_| vec![Step::Wrong(Fault::Sensor(Sensor::MisoStuckLow))],
        tells: Tells::Fault(Told::SensorWrongId),
        ..SENSOR
    },
    Scenario {
        name: "miso-high",
        what: "SPI data line stuck high",
        steps: |_| vec![Step::Wrong(Fault::Sensor(Sensor::MisoStuckHigh))],
        tells: Tells::Fault(Told::SensorWrongId),
        ..SENSOR
    },
    Scenario {
        name: "bit-flips",
        what: "SPI: one bit in ten wrong",
        steps: |_| {
            vec![Step::Wrong(Fault::Sensor(Sensor::BitFlips {
                per_million: 100_000,
            }))]
        },
        blind_us: FOUND_US,
        tells: Tells::Fault(Told::SensorConfigMismatch),
        ..SENSOR
    },
    Scenario {
        name: "spi-dma-error",
        what: "SPI: the DMA meets an error in the middle of each sample",
        steps: |_| vec![Step::Wrong(Fault::DmaError(SENSOR_STREAM))],
        tells: Tells::Fault(Told::SensorSilent),
        ..SENSOR
    },
    Scenario {
        name: "spi-hung",
        what: "SPI: its clock stands",
        steps: |_| vec![Step::Wrong(Fault::SensorClockStopped)],
        tells: Tells::Fault(Told::SensorSilent),
        ..SENSOR
    },
    Scenario {
        name: "sensor-reset",
        what: "sensor resets itself",
        steps: |_| vec![Step::Wrong(Fault::Sensor(Sensor::Reset))],
        lasts_ms: None,
        invalid: Invalid::ToTheNextSample,
        tells: Tells::Fault(Told::SensorReset),
        ..SENSOR
    },
    Scenario {
        name: "wrong-id",
        what: "another identity from power-up on",
        steps: |_| vec![Step::Wrong(Fault::Sensor(Sensor::WrongId(0x6B)))],
        at_power_up: true,
        phases: 1,
        tells: Tells::Fault(Told::SensorWrongId),
        ..SENSOR
    },
    Scenario {
        name: "no-sensor",
        what: "no sensor on the bus",
        board: |options, _| options.sensor = None,
        at_power_up: true,
        lasts_ms: None,
        phases: 1,
        tells: Tells::Fault(Told::SensorWrongId),
        ..SENSOR
    },
    Scenario {
        name: "data-ready-lost",
        what: "data-ready line dead",
        steps: |_| vec![Step::Wrong(Fault::Sensor(Sensor::DataReadyLost))],
        tells: Tells::Fault(Told::SensorSilent),
        ..SENSOR
    },
    Scenario {
        name: "data-ready-storm",
        what: "data-ready storm, 100 kHz",
        steps: |_| {
            vec![Step::Wrong(Fault::Sensor(Sensor::DataReadyStorm {
                period_ns: 10_000,
            }))]
        },
        tells: Tells::Fault(Told::SensorTiming),
        ..SENSOR
    },
    Scenario {
        name: "frozen",
        what: "outputs repeat, and say they are new",
        steps: |_| vec![Step::Wrong(Fault::Sensor(Sensor::FrozenOutput))],
        blind_us: FOUND_US,
        tells: Tells::Fault(Told::SensorFrozen),
        ..SENSOR
    },
    Scenario {
        name: "saturated",
        what: "every axis at the end of its range",
        steps: |_| vec![Step::Wrong(Fault::Sensor(Sensor::Saturation))],
        blind_us: ONE_TICK_US,
        tells: Tells::Fault(Told::SensorSaturated),
        ..SENSOR
    },
    Scenario {
        name: "clock-fast",
        what: "sensor's clock 5 % fast",
        steps: |_| vec![Step::Wrong(Fault::Sensor(Sensor::ClockRatio(1.05)))],
        invalid: Invalid::Never,
        note: "within what the timing takes",
        keeps_time: true,
        ..SENSOR
    },
    Scenario {
        name: "clock-slow",
        what: "sensor's clock 5 % slow",
        steps: |_| vec![Step::Wrong(Fault::Sensor(Sensor::ClockRatio(0.95)))],
        invalid: Invalid::Never,
        note: "within what the timing takes",
        keeps_time: true,
        ..SENSOR
    },
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
        name: "bus-shorted",
        what: "CAN lines shorted: bus-off",
        steps: |_| vec![Step::Wrong(Fault::Bus(BusFault::Shorted))],
        lasts_ms: LASTING,
        tells: Tells::Fault(Told::CanBusOff),
        keeps_time: true,
        ..PLAIN
    },
    Scenario {
        name: "no-acknowledge",
        what: "nobody acknowledges on CAN",
        steps: |_| vec![Step::Wrong(Fault::Bus(BusFault::NoAcknowledge))],
        lasts_ms: LASTING,
        tells: Tells::Fault(Told::CanErrorPassive),
        keeps_time: true,
        ..PLAIN
    },
    Scenario {
        name: "bus-saturated",
        what: "CAN full of frames that go first",
        steps: |_| vec![Step::Wrong(Fault::Bus(BusFault::Saturated))],
        lasts_ms: LASTING,
        tells: Tells::Counter(Counter::CanDropped),
        keeps_time: true,
        ..PLAIN
    },
    Scenario {
        name: "uart-open",
        what: "serial line open: nobody reads",
        steps: |_| vec![Step::Wrong(Fault::Line(LineFault::Open))],
        lasts_ms: LASTING,
        note: "without flow control a sender cannot know; the next whole frame is read",
        ..PLAIN
    },
    Scenario {
        name: "uart-break",
        what: "serial consumer without power: line held low",
        steps: |_| vec![Step::Wrong(Fault::Line(LineFault::Break))],
        lasts_ms: LASTING,
        tells: Tells::Fault(Told::UartOverrun),
        ..PLAIN
    },
    Scenario {
        name: "uart-dma-error",
        what: "serial line: the DMA meets an error in the middle of each transfer",
        steps: |_| vec![Step::Wrong(Fault::DmaError(SERIAL_STREAM))],
        lasts_ms: LASTING,
        tells: Tells::Counter(Counter::UartDropped),
        ..PLAIN
    },
    Scenario {
        name: "uart-garbage",
        what: "20 000 bytes of garbage on the serial line",
        steps: |_| vec![Step::Garbage(20_000)],
        tells: Tells::Counter(Counter::UartRefused),
        keeps_time: true,
        ..PLAIN
    },
    Scenario {
        name: "command-flood",
        what: "1000 requests over CAN and 500 over the serial line at once",
        steps: |_| vec![Step::Flood(500)],
        tells: Tells::Counter(Counter::UartDropped),
        ..PLAIN
    },
    Scenario {
        name: "flash-blank",
        what: "stored settings gone, then a reset",
        before: &[Step::Store],
        steps: |_| {
            vec![
                Step::Wrong(Fault::SettingsErased),
                Step::Wrong(Fault::Reset),
            ]
        },
        tells: Tells::BootUp,
        note: "a new board is like this: defaults apply",
        resets: &[ResetCause::Pin],
        ..PLAIN
    },
    Scenario {
        name: "flash-corrupted",
        what: "stored settings damaged, then a reset",
        before: &[Step::Store],
        steps: |_| {
            vec![
                Step::Wrong(Fault::SettingsDamaged),
                Step::Wrong(Fault::Reset),
            ]
        },
        tells: Tells::Fault(Told::ConfigCorrupted),
        note: "defaults apply; stays, reported, until settings are stored",
        resets: &[ResetCause::Pin],
        ..PLAIN
    },
    Scenario {
        name: "power-cut",
        what: "supply cut while settings are stored, in each fourth of 115 writes",
        before: &[
            Step::Set(LOAD_SCALE, OLD_AND_NEW[0]),
            Step::Store,
            Step::Set(LOAD_SCALE, OLD_AND_NEW[1]),
        ],
        steps: |write| vec![Step::Wrong(Fault::CutInFlash(write)), Step::Store],
        kept: Some((LOAD_SCALE, OLD_AND_NEW)),
        variants: (3, 115, 4),
        tells: Tells::BootUp,
        resets: &[ResetCause::PowerOn],
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
];

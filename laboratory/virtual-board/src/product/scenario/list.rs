//! All scenarios: the rows of the fault matrix, and the names of the command line.

use std::sync::LazyLock;

use lsm6dsox::setting::Sensor::{self, Accel as Accelerometer, Gyro as Gyroscope};
use lsm6dsox::sim::{Axis, PartFault as SensorFault, StartTimes, Stimulus};
use wire::dictionary::index;
use wire::node::NmtCommand;
use wire::{Address, Counter, Fault, Value};

use super::ScenarioStep::{
    self, CutInErase, Flood, Garbage, Inject, Nmt, Restore, Set, Store, StoreStopped, Wait,
};
use super::{Invalid, Pages, Reports, Scenario};
use crate::emulator::board::BoardOptions;
use crate::emulator::board::Injection::{
    self, BrownOut, Bus, CrystalLost, CutInFlash, DebuggerHalt, Derail, DmaError, Hang,
    InterruptLost, Line, Load, Panic, Reset, SensorClockStopped, SettingsDamaged, SettingsErased,
    SettingsGarbage, StackOverflow, Supply, WornFlash,
};
use crate::emulator::chip::Crystal;
use crate::emulator::corner::Corner;
use crate::emulator::part::can::BusFault;
use crate::emulator::part::rcc::ResetCause;
use crate::emulator::part::usart::LineFault;

/// Clears all faults that can be cleared.
pub static CLEAR: Scenario =
    Scenario { name: "clear", steps: |_| vec![Inject(Injection::Clear)], ..PLAIN };

/// All scenarios, in the order of the table.
pub static ALL: LazyLock<Vec<Scenario>> =
    LazyLock::new(|| [SENSOR_ROWS, LINE_ROWS, SETTINGS_ROWS, CHIP_ROWS].concat());

/// Duration of a fault that does not end by itself, ms.
const LASTING: Option<u64> = Some(300);

/// Interrupt of TIM2: tick and edges.
const TIMER: u16 = 28;

/// Interrupt of the DMA that feeds the serial line.
const SERIAL_DMA: u16 = 70;

/// Streams of DMA2 that read from the sensor's bus, and from and to the serial line.
const SENSOR_STREAM: usize = 0;
const RECEIVE_STREAM: usize = 2;
const SERIAL_STREAM: usize = 7;

/// Code of a connected load source.
const LOADED: u16 = 2000;

/// The sensor's edges are 150 µs apart and its reading takes 20 µs; a frame about the tick before
/// may still be on its way.
const ONE_TICK_US: u64 = 1_700;

/// Time by which every kind of sensor fault has been detected, µs.
const FOUND_US: u64 = 5_000;

const PLAIN: Scenario = Scenario {
    name: "",
    what: "",
    board: |_, _| {},
    motion: |_| Stimulus::REST,
    pages: Pages::Blank,
    before: &[],
    steps: |_| Vec::new(),
    variants: (0, 0, 1),
    at_power_up: false,
    lasts_ms: None,
    deadline_ms: None,
    invalid: Invalid::Never,
    blind_us: 0,
    detected_within_us: u64::MAX,
    phases: 1,
    reports: Reports::Nothing,
    with_can: true,
    may_be_silent: false,
    resets: &[],
    any_reset: false,
    keeps_time: false,
    clock_stops: false,
    clock_beyond_us: 0,
    kept: None,
    keeps_new: false,
    note: "",
};

/// A sensor fault that is cleared after a while.
const SENSOR: Scenario = Scenario {
    lasts_ms: LASTING,
    invalid: Invalid::UntilCleared,
    blind_us: ONE_TICK_US,
    phases: 4,
    ..PLAIN
};

const LOAD_FROM_ANALOG: ScenarioStep = Set(Address::new(index::LOAD_INPUT, 1), Value::U8(1));

/// A setting that is changed; which one does not matter.
const LOAD_SCALE: Address = Address::new(index::LOAD_INPUT, 2);

const OLD_AND_NEW: [Value; 2] = [Value::F32(2.0), Value::F32(3.0)];

/// Sets the old value of the setting that is changed.
pub(super) const OLD_SCALE: ScenarioStep = Set(LOAD_SCALE, OLD_AND_NEW[0]);
/// Sets its new value.
const NEW_SCALE: ScenarioStep = Set(LOAD_SCALE, OLD_AND_NEW[1]);

/// Period in which every register is read back, µs.
const ROTATION_US: u64 = 200_000;

/// A register of the sensor changes its value.
const FLIPPED: Scenario = Scenario {
    lasts_ms: None,
    invalid: Invalid::Never,
    detected_within_us: ROTATION_US,
    phases: 1,
    reports: Reports::Fault(Fault::SensorConfigMismatch),
    ..SENSOR
};

/// A deviation of the sensor that the firmware copes with.
const HARMLESS: Scenario = Scenario {
    lasts_ms: None,
    invalid: Invalid::Never,
    phases: 1,
    reports: Reports::Any,
    ..SENSOR
};

/// One axis after the other is stuck.
const STUCK: Scenario = Scenario {
    variants: (0, 2, 1),
    phases: 1,
    blind_us: 95_000,
    reports: Reports::Fault(Fault::SensorFrozen),
    ..SENSOR
};

/// A third of gravity along all of the foot.
const SLIDING: Stimulus = Stimulus { specific_force: [3.0, 3.0, 9.806_65 + 3.0], ..Stimulus::REST };

const TURNING: Stimulus = Stimulus { angular_rate: [2.0; 3], ..Stimulus::REST };

/// At rest, except while the fault lasts.
fn while_wrong(seconds: f64, moving: Stimulus) -> Stimulus {
    match seconds {
        0.0..0.3 => moving,
        _ => Stimulus::REST,
    }
}

const fn sensor(fault: SensorFault) -> ScenarioStep {
    Inject(Injection::Sensor(fault))
}

fn stuck(part: Sensor, axis: u64, code: i16) -> ScenarioStep {
    sensor(SensorFault::AxisStuck { sensor: part, axis: Axis::ALL[axis as usize % 3], code })
}

const fn flipped(address: u8, bits: u8) -> ScenarioStep {
    sensor(SensorFault::RegisterFlipped { address, bits })
}

fn set_bias(options: &mut BoardOptions, degrees: f64) {
    if let Some(sensor) = &mut options.sensor {
        sensor.gyro_bias = [degrees.to_radians(); 3];
    }
}

/// Faults of the sensor and its line, in the order of the table.
#[rustfmt::skip]
const SENSOR_ROWS: &[Scenario] = &[
    Scenario { name: "miso-low", what: "SPI data line stuck low", steps: |_| vec![sensor(SensorFault::MisoStuckLow)],
        reports: Reports::Fault(Fault::SensorWrongId), ..SENSOR },
    Scenario { name: "miso-high", what: "SPI data line stuck high",
        steps: |_| vec![sensor(SensorFault::MisoStuckHigh)], reports: Reports::Fault(Fault::SensorWrongId), ..SENSOR },
    Scenario { name: "bit-flips", what: "SPI: one bit in ten wrong",
        steps: |_| vec![sensor(SensorFault::BitFlips { per_million: 100_000 })], blind_us: FOUND_US,
        reports: Reports::Fault(Fault::SensorConfigMismatch), ..SENSOR },
    Scenario { name: "spi-dma-error", what: "SPI: DMA error in the middle of each sample",
        steps: |_| vec![Inject(DmaError(SENSOR_STREAM))], reports: Reports::Fault(Fault::SensorSilent), ..SENSOR },
    Scenario { name: "spi-hung", what: "SPI: clock stopped", steps: |_| vec![Inject(SensorClockStopped)],
        reports: Reports::Fault(Fault::SensorSilent), ..SENSOR },
    Scenario { name: "sensor-reset", what: "sensor resets itself", steps: |_| vec![sensor(SensorFault::Reset)],
        lasts_ms: None, invalid: Invalid::UntilNextSample, reports: Reports::Fault(Fault::SensorReset), ..SENSOR },
    Scenario { name: "wrong-id", what: "wrong identity from power-up on",
        steps: |_| vec![sensor(SensorFault::WrongId(0x6B))], at_power_up: true, phases: 1,
        reports: Reports::Fault(Fault::SensorWrongId), ..SENSOR },
    Scenario { name: "no-sensor", what: "no sensor on the bus", board: |options, _| options.sensor = None,
        at_power_up: true, lasts_ms: None, phases: 1, reports: Reports::Fault(Fault::SensorWrongId), ..SENSOR },
    Scenario { name: "data-ready-lost", what: "data-ready line dead",
        steps: |_| vec![sensor(SensorFault::DataReadyLost)], invalid: Invalid::Never,
        reports: Reports::Fault(Fault::DataReadyDead),
        note: "after a restart of the sensor, samples are read by the timer", ..SENSOR },
    Scenario { name: "edges-lost", what: "data-ready line loses one edge in 20",
        steps: |_| vec![sensor(SensorFault::DataReadyLosses { per_million: 50_000 })], invalid: Invalid::Never,
        lasts_ms: Some(1_000), reports: Reports::Fault(Fault::DataReadyDead), note: "without a restart of the sensor", ..SENSOR },
    Scenario { name: "data-ready-storm", what: "data-ready storm, 100 kHz",
        steps: |_| vec![sensor(SensorFault::DataReadyStorm { period_ns: 10_000 })],
        reports: Reports::Fault(Fault::SensorTiming), ..SENSOR },
    Scenario { name: "frozen", what: "outputs repeat, flagged as new",
        steps: |_| vec![sensor(SensorFault::FrozenOutput)], blind_us: FOUND_US,
        reports: Reports::Fault(Fault::SensorFrozen), ..SENSOR },
    Scenario { name: "saturated", what: "every axis at the end of its range",
        steps: |_| vec![sensor(SensorFault::Saturation)], blind_us: ONE_TICK_US,
        reports: Reports::Fault(Fault::SensorSaturated), ..SENSOR },
    Scenario { name: "clock-fast", what: "sensor's clock 5 % fast",
        steps: |_| vec![sensor(SensorFault::ClockRatio(1.05))], invalid: Invalid::Never,
        note: "within the timing tolerance", keeps_time: true, ..SENSOR },
    Scenario { name: "clock-slow", what: "sensor's clock 5 % slow",
        steps: |_| vec![sensor(SensorFault::ClockRatio(0.95))], invalid: Invalid::Never,
        note: "within the timing tolerance", keeps_time: true, ..SENSOR },
    Scenario { name: "accelerometer-frozen", what: "accelerometer repeats, gyroscope works",
        steps: |_| vec![sensor(SensorFault::SensorFrozen(Accelerometer))], blind_us: 25_000,
        reports: Reports::Fault(Fault::SensorFrozen), ..SENSOR },
    Scenario { name: "gyroscope-frozen", what: "gyroscope repeats, accelerometer works",
        steps: |_| vec![sensor(SensorFault::SensorFrozen(Gyroscope))], blind_us: 45_000,
        reports: Reports::Fault(Fault::SensorFrozen), ..SENSOR },
    Scenario { name: "accelerometer-axis-stuck",
        what: "x, y or z of the accelerometer stuck while the foot slides at 3 m/s²",
        motion: |seconds| while_wrong(seconds, SLIDING),
        steps: |axis| vec![stuck(Accelerometer, axis, if axis == 2 { 2048 } else { 0 })], blind_us: 35_000, ..STUCK },
    Scenario { name: "gyroscope-axis-stuck",
        what: "x, y or z of the gyroscope stuck while the foot turns at 2 rad/s about it",
        motion: |seconds| while_wrong(seconds, TURNING), steps: |axis| vec![stuck(Gyroscope, axis, 0)], ..STUCK },
    Scenario { name: "gyroscope-axis-off",
        what: "x, y or z of the gyroscope stuck at 0.2 rad/s on a foot that stands",
        steps: |axis| vec![stuck(Gyroscope, axis, 164)], ..STUCK },
    Scenario { name: "self-test-on", what: "CTRL5_C flips: both self-tests on",
        steps: |_| vec![flipped(0x14, 0b0101)], ..FLIPPED },
    Scenario { name: "high-pass-on", what: "CTRL7_G flips: the gyroscope's high-pass filter on",
        steps: |_| vec![flipped(0x16, 0x40)], ..FLIPPED },
    Scenario { name: "bank-switched", what: "FUNC_CFG_ACCESS flips: another register bank",
        steps: |_| vec![flipped(0x01, 0x80)], reports: Reports::Fault(Fault::SensorWrongId), ..FLIPPED },
    Scenario { name: "three-wire", what: "CTRL3_C.SIM flips: data line not driven",
        steps: |_| vec![flipped(0x12, 0x08)], reports: Reports::Fault(Fault::SensorWrongId), ..FLIPPED },
    Scenario { name: "user-offset", what: "X_OFS_USR flips: an offset is added",
        steps: |_| vec![flipped(0x73, 0x40)], ..FLIPPED },
    Scenario { name: "pins-changed", what: "PIN_CTRL flips: a pull-up on SDO", steps: |_| vec![flipped(0x02, 0x40)],
        ..FLIPPED },
    Scenario { name: "range-changed", what: "CTRL1_XL flips: ±2 g instead of ±16 g",
        steps: |_| vec![flipped(0x10, 0x04)], ..FLIPPED },
    Scenario { name: "edge-glitches", what: "extra pulses of 1 µs on the data-ready line, every 1.1 ms",
        steps: |_| vec![sensor(SensorFault::DataReadyGlitches { period_ns: 1_100_000, width_ns: 1_000 })],
        invalid: Invalid::Never, reports: Reports::Any, ..SENSOR },
    Scenario { name: "edge-noise", what: "extra pulses of 10, 45 or 80 ns on the data-ready line, every 53 µs",
        variants: (10, 80, 35), invalid: Invalid::Never, keeps_time: true, note: "filtered by the timer",
        steps: |ns| vec![sensor(SensorFault::DataReadyGlitches { period_ns: 53_000, width_ns: ns as u32 })], ..SENSOR },
    Scenario { name: "gyroscope-bias", what: "gyroscope bias of 2 °/s on each axis from power-up on",
        board: |options, _| set_bias(options, 2.0), at_power_up: true, note: "learnt at rest", ..HARMLESS },
    Scenario { name: "gyroscope-bias-large", what: "gyroscope bias of 15 °/s on each axis from power-up on",
        board: |options, _| set_bias(options, 15.0), at_power_up: true, phases: 1, lasts_ms: None,
        deadline_ms: Some(7_000), blind_us: 500_000, reports: Reports::Fault(Fault::GyroBias),
        note: "beyond the range that is learnt", ..SENSOR },
    Scenario { name: "data-line-late",
        what: "SPI: data valid 105 ns after the clock's edge, later than half a period at 5 MHz",
        steps: |_| vec![sensor(SensorFault::SdoDelay { ns: 105 })], note: "continues at 2.5 MHz", ..HARMLESS },
    Scenario { name: "data-line-late-at-start", what: "the same from power-up on",
        steps: |_| vec![sensor(SensorFault::SdoDelay { ns: 105 })], at_power_up: true, note: "continues at 2.5 MHz",
        ..HARMLESS },
    Scenario { name: "sensor-fast", what: "sensor with the shortest start-up time",
        board: |options, _| { if let Some(sensor) = &mut options.sensor { sensor.start = StartTimes::FASTEST; } },
        at_power_up: true, ..HARMLESS },
];

/// A fault of a line that is cleared after a while.
const LINE: Scenario = Scenario { lasts_ms: LASTING, ..PLAIN };

/// Faults of the external lines, in the order of the table.
#[rustfmt::skip]
const LINE_ROWS: &[Scenario] = &[
    Scenario { name: "bus-shorted", what: "CAN lines shorted: bus-off",
        steps: |_| vec![Inject(Bus(BusFault::Shorted))], reports: Reports::Fault(Fault::CanBusOff), keeps_time: true,
        ..LINE },
    Scenario { name: "no-acknowledge", what: "no node acknowledges on CAN",
        steps: |_| vec![Inject(Bus(BusFault::NoAcknowledge))], reports: Reports::Fault(Fault::CanErrorPassive),
        keeps_time: true, ..LINE },
    Scenario { name: "bus-saturated", what: "CAN full of frames of higher priority",
        steps: |_| vec![Inject(Bus(BusFault::Saturated))], reports: Reports::Counter(Counter::CanDropped),
        keeps_time: true, ..LINE },
    Scenario { name: "uart-open", what: "serial line open: no reader",
        steps: |_| vec![Inject(Line(LineFault::Open))],
        note: "undetectable without flow control; the next whole frame is read", ..LINE },
    Scenario { name: "uart-break", what: "serial consumer without power: line held low",
        steps: |_| vec![Inject(Line(LineFault::Break))], reports: Reports::Fault(Fault::UartOverrun), ..LINE },
    Scenario { name: "uart-dma-error", what: "serial line: DMA error in the middle of each transfer",
        steps: |_| vec![Inject(DmaError(SERIAL_STREAM))], reports: Reports::Counter(Counter::UartDropped), ..LINE },
    Scenario { name: "uart-receive-dma-error",
        what: "serial line: receive DMA error in the second half of its buffer, during garbage",
        // The first error comes with byte 257, which is the last byte of variant 0.
        steps: |variant| vec![Inject(DmaError(RECEIVE_STREAM)), Garbage(257 + 450 * variant as u32)],
        variants: (0, 4, 1), kept: Some((LOAD_SCALE, [Value::F32(1.0), OLD_AND_NEW[0]])),
        reports: Reports::Counter(Counter::UartOverruns), note: "settings are answered again afterwards", ..LINE },
    Scenario { name: "uart-garbage", what: "20 000 bytes of garbage on the serial line",
        steps: |_| vec![Garbage(20_000)], reports: Reports::Counter(Counter::UartRefused), keeps_time: true, ..PLAIN },
    Scenario { name: "command-flood", what: "1000 requests over CAN and 500 over the serial line at once",
        steps: |_| vec![Flood(500)], reports: Reports::Counter(Counter::UartDropped), ..PLAIN },
    Scenario { name: "bus-dominant-at-set", what: "CAN lines shorted while the controller is reconfigured",
        steps: |_| vec![Inject(Bus(BusFault::Shorted)), Set(Address::new(index::CAN_BIT_RATE, 0), Value::U16(500)),
            Nmt(NmtCommand::ResetCommunication), Wait(250_000), Nmt(NmtCommand::StartRemoteNode)],
        reports: Reports::Any, ..LINE },
    Scenario { name: "flood-then-sensor", what: "a flood of requests, and 12 ms later the SPI data line stuck low",
        steps: |_| vec![Flood(500), Wait(12_000), Inject(Injection::Sensor(SensorFault::MisoStuckLow))],
        invalid: Invalid::UntilCleared, blind_us: 12_000 + ONE_TICK_US,
        reports: Reports::Fault(Fault::SensorWrongId), ..LINE },
    Scenario { name: "uart-flood-of-breaks", what: "serial line held low for 2 ms, every 10 ms",
        steps: |_| [Inject(Line(LineFault::Break)), Wait(2_000), Inject(Line(LineFault::None)), Wait(8_000)].repeat(20),
        reports: Reports::Fault(Fault::UartOverrun), ..LINE },
];

/// Faults of the settings and the flash that stores them, in the order of the table.
#[rustfmt::skip]
const SETTINGS_ROWS: &[Scenario] = &[
    Scenario { name: "flash-blank", what: "stored settings erased, then a reset", before: &[Store],
        steps: |_| vec![Inject(SettingsErased), Inject(Reset)], reports: Reports::BootUp,
        note: "as on a new board: defaults apply", resets: &[ResetCause::Pin], ..PLAIN },
    Scenario { name: "flash-corrupted", what: "stored settings damaged, then a reset", before: &[Store],
        steps: |_| vec![Inject(SettingsDamaged), Inject(Reset)], reports: Reports::Fault(Fault::ConfigCorrupted),
        note: "defaults apply; remains reported until settings are stored", resets: &[ResetCause::Pin], ..PLAIN },
    Scenario { name: "power-cut", what: "supply cut while settings are stored, at every fourth of 115 writes",
        before: &[OLD_SCALE, Store, NEW_SCALE], steps: |write| vec![Inject(CutInFlash(write)), Store],
        kept: Some((LOAD_SCALE, OLD_AND_NEW)), variants: (3, 115, 4), reports: Reports::BootUp,
        resets: &[ResetCause::PowerOn], ..PLAIN },
    Scenario { name: "garbage-at-power-up", what: "arbitrary bytes in the settings pages at power-up: twelve seeds",
        steps: |seed| vec![Inject(SettingsGarbage(seed))], variants: (1, 12, 1), at_power_up: true,
        reports: Reports::Any, note: "defaults apply where no valid record is found", ..PLAIN },
    Scenario { name: "reload-damaged", what: "stored settings damaged, then NMT reset communication",
        before: &[Store],
        steps: |_| vec![Inject(SettingsDamaged), Nmt(NmtCommand::ResetCommunication), Wait(50_000),
            Nmt(NmtCommand::StartRemoteNode)],
        reports: Reports::Fault(Fault::ConfigCorrupted),
        note: "defaults apply; remains reported until settings are stored", ..PLAIN },
    Scenario { name: "load-defaults", what: "0x1011 \"load\" restores the defaults", before: &[Store],
        steps: |_| vec![Restore], reports: Reports::Any, ..PLAIN },
    Scenario { name: "store-erases", what: "a store that has to erase a page, in pre-operational",
        pages: Pages::BeforeAnErase, steps: |_| vec![StoreStopped],
        // The erase may begin at any moment of a tick.
        phases: 16, reports: Reports::Any, ..PLAIN },
    Scenario { name: "store-would-erase", what: "a store that has to erase a page, in operational",
        pages: Pages::BeforeAnErase, steps: |_| vec![Store], reports: Reports::Any, ..PLAIN },
    Scenario { name: "power-cut-erasing", what: "supply cut in a store that has to erase, at 16 of its operations",
        pages: Pages::BeforeAnErase, before: &[NEW_SCALE], steps: |part| vec![CutInErase(part as u32), StoreStopped],
        kept: Some((LOAD_SCALE, OLD_AND_NEW)), variants: (0, 31, 2), reports: Reports::BootUp,
        resets: &[ResetCause::PowerOn], ..PLAIN },
    Scenario { name: "worn-flash",
        what: "a bit cleared in the record that is stored, at every twelfth word, then a reset",
        before: &[OLD_SCALE, Store, NEW_SCALE],
        steps: |write| vec![Inject(WornFlash(write)), StoreStopped, Wait(100_000), Inject(Reset)],
        kept: Some((LOAD_SCALE, OLD_AND_NEW)), keeps_new: true, variants: (2, 110, 12), reports: Reports::BootUp,
        resets: &[ResetCause::Pin], ..PLAIN },
    Scenario { name: "supply-low-store", what: "settings stored at 2.6 V, brown-out level 1",
        board: |options, _| options.chip.brown_out_level = 1, steps: |_| vec![Inject(Supply(2_600)), StoreStopped],
        lasts_ms: LASTING, reports: Reports::Fault(Fault::ConfigStore), note: "refused below 2.7 V", ..PLAIN },
];

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

/// Faults of the chip: its clocks, its core, its supply, in the order of the table.
#[rustfmt::skip]
const CHIP_ROWS: &[Scenario] = &[
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

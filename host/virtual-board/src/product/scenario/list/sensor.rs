//! Faults of the sensor and its line.

use lsm6dsox::setting::Sensor::{self, Accel as Accelerometer, Gyro as Gyroscope};
use lsm6dsox::sim::{Axis, PartFault as SensorFault, StartTimes, Stimulus};
use wire::Fault;

use super::{FOUND_US, ONE_TICK_US, SENSOR, SENSOR_STREAM};
use crate::emulator::board::BoardOptions;
use crate::emulator::board::Injection::{self, DmaError, SensorClockStopped};
use crate::product::scenario::ScenarioStep::{self, Inject};
use crate::product::scenario::{Invalid, Reports, Scenario};

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

/// Rows in the order of the table.
#[rustfmt::skip]
pub(super) const ROWS: &[Scenario] = &[
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

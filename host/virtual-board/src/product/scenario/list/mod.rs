//! All scenarios: the rows of the fault matrix, and the names of the command line.

mod chip;
mod lines;
mod sensor;
mod settings;

use std::sync::LazyLock;

use lsm6dsox::sim::Stimulus;
use wire::dictionary::index;
use wire::{Address, Value};

use super::{Injection, Invalid, Pages, Reports, Scenario, ScenarioStep};

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

const LOAD_FROM_ANALOG: ScenarioStep =
    ScenarioStep::Set(Address::new(index::LOAD_INPUT, 1), Value::U8(1));

/// A setting that is changed; which one does not matter.
const LOAD_SCALE: Address = Address::new(index::LOAD_INPUT, 2);

const OLD_AND_NEW: [Value; 2] = [Value::F32(2.0), Value::F32(3.0)];

/// Sets the old value of the setting that is changed.
pub(super) const OLD_SCALE: ScenarioStep = ScenarioStep::Set(LOAD_SCALE, OLD_AND_NEW[0]);
/// Sets its new value.
const NEW_SCALE: ScenarioStep = ScenarioStep::Set(LOAD_SCALE, OLD_AND_NEW[1]);

/// Clears all faults that can be cleared.
pub static CLEAR: Scenario =
    Scenario { name: "clear", steps: |_| vec![ScenarioStep::Inject(Injection::Clear)], ..PLAIN };

/// All scenarios, in the order of the table.
pub static ALL: LazyLock<Vec<Scenario>> =
    LazyLock::new(|| [sensor::ROWS, lines::ROWS, settings::ROWS, chip::ROWS].concat());

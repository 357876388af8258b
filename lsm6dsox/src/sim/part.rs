//! The simulated part: time, ticks, resets and faults.

use std::boxed::Box;

use super::channel::Channel;
use super::clock::Clock;
use super::fault::{Broken, Faults, PartFault};
use super::memory::{Memory, Violation};
use super::motion::{Motion, Stimulus};
use super::outputs::{Phase, Update, Words};
use super::random::Random;
use crate::register::{self, ctrl3_c, ctrl9_xl};
use crate::scale::{DEGREE, STANDARD_GRAVITY};

/// Duration of a software reset, ns \[S\].
const RESET_NS: u64 = 50_000;

/// Ticks per temperature sample: 52 Hz.
const TEMPERATURE_DIVIDER: u64 = 128;

/// Temperature at which offsets are specified and the temperature's code is 0, °C \[P\].
const REFERENCE_TEMPERATURE: f64 = 25.0;

/// Start-up times of a specimen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartTimes {
    /// Time from power-up until the part answers, ns.
    pub boot_ns: u64,
    /// Time from setting the data rate to the accelerometer's first sample, ns.
    pub accel_turn_on_ns: u64,
    /// Time from setting the data rate to the gyroscope's first sample, ns.
    pub gyro_turn_on_ns: u64,
    /// Time from setting the data rate until the gyroscope's samples are valid, ns.
    pub gyro_settled_ns: u64,
    /// Error of the gyroscope when its data rate is set, rad/s on each axis; it falls
    /// linearly to 0.
    pub gyro_start_error: f64,
}

impl StartTimes {
    /// The longest times: boot 10 ms \[P example\], accelerometer 5 ms (assumed), gyroscope's first sample
    /// 35 ms \[D\] and settled 70 ms (AN5040, LSM6DSL); the error, 0.2 rad/s, is assumed.
    pub const SLOWEST: Self = Self {
        boot_ns: 10_000_000,
        accel_turn_on_ns: 5_000_000,
        gyro_turn_on_ns: 35_000_000,
        gyro_settled_ns: 70_000_000,
        gyro_start_error: 0.2,
    };

    /// The shortest times; all are assumed.
    pub const FASTEST: Self = Self {
        boot_ns: 3_000_000,
        accel_turn_on_ns: 1_000_000,
        gyro_turn_on_ns: 15_000_000,
        gyro_settled_ns: 15_000_000,
        gyro_start_error: 0.0,
    };
}

/// Properties of one specimen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartOptions {
    /// Seed of noise, jitter and bit flips.
    pub seed: u64,
    /// Fraction by which the clock is fast; `INTERNAL_FREQ_FINE` shows it in steps of 0.15 %.
    pub clock_error: f64,
    /// Largest delay of an edge, ns; each edge has its own.
    pub jitter_ns: u32,
    /// Enables noise. It takes three quarters of a run's time: with it, an hour
    /// of 24 million ticks takes some seconds.
    pub noise: bool,
    /// Zero-g offset at 25 °C, m/s².
    pub accel_bias: [f64; 3],
    /// Zero-rate offset at 25 °C, rad/s.
    pub gyro_bias: [f64; 3],
    /// Change of the zero-g offset with temperature, m/s² per °C.
    pub accel_drift: [f64; 3],
    /// Change of the zero-rate offset with temperature, rad/s per °C.
    pub gyro_drift: [f64; 3],
    /// Change of the accelerometer under its test signal, m/s².
    pub accel_test_signal: [f64; 3],
    /// Change of the gyroscope under its test signal, rad/s.
    pub gyro_test_signal: [f64; 3],
    /// Time that passes with each byte on the bus, ns: 0, or 800 for 10 MHz.
    pub byte_time_ns: u32,
    /// Start-up times.
    pub start: StartTimes,
    /// Delay from the clock's edge until the data line is valid, ns; on a sibling at most 50. It has an
    /// effect once the clock is known, [`Part::set_bus_clock`].
    pub sdo_delay_ns: u32,
    /// Value read by the master while the part does not drive the data line: the board's pull.
    pub open_line: u8,
}

impl Default for PartOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl PartOptions {
    /// A part without error, offset or drift, with noise and 500 ns of jitter; 0.5 g and 400 °/s of
    /// test signal; transfers take no time; slowest start-up; 25 ns from the clock to the
    /// data line, which is pulled down.
    pub const DEFAULT: Self = Self {
        seed: 1,
        clock_error: 0.0,
        jitter_ns: 500,
        noise: true,
        accel_bias: [0.0; 3],
        gyro_bias: [0.0; 3],
        accel_drift: [0.0; 3],
        gyro_drift: [0.0; 3],
        accel_test_signal: [0.5 * STANDARD_GRAVITY as f64; 3],
        gyro_test_signal: [400.0 * DEGREE as f64; 3],
        byte_time_ns: 0,
        start: StartTimes::SLOWEST,
        sdo_delay_ns: 25,
        open_line: 0x00,
    };

    /// The zero-g offset at a temperature in °C, m/s².
    fn accel_offset(&self, temperature: f64) -> [f64; 3] {
        offset(self.accel_bias, self.accel_drift, temperature)
    }

    /// The zero-rate offset at a temperature in °C, rad/s.
    fn gyro_offset(&self, temperature: f64) -> [f64; 3] {
        offset(self.gyro_bias, self.gyro_drift, temperature)
    }
}

fn offset(bias: [f64; 3], drift: [f64; 3], temperature: f64) -> [f64; 3] {
    let warmth = temperature - REFERENCE_TEMPERATURE;
    core::array::from_fn(|axis| bias[axis] + drift[axis] * warmth)
}

/// State in which the part does not answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Busy {
    /// Booting: nothing answers.
    Boot,
    /// A software reset: `SW_RESET` reads 1, writes are lost.
    Reset,
}

/// A simulated LSM6DSOX.
pub struct Part {
    pub(super) now_ns: u64,
    pub(super) options: PartOptions,
    pub(super) memory: Memory,
    pub(super) phase: Phase,
    pub(super) words: Words,
    pub(super) faults: Faults,
    pub(super) flips: Random,
    pub(super) busy: Option<(Busy, u64)>,
    /// Whether the part answers on I3C alone.
    pub(super) i3c: bool,
    pub(super) clock: Clock,
    pub(super) next_tick: u64,
    pub(super) accel: Channel,
    pub(super) gyro: Channel,
    /// Time at which the gyroscope was switched on, ns.
    gyro_on_ns: u64,
    pub(super) bus_clock_hertz: Option<u32>,
    /// Last bit on the data line, used if bits are read late.
    pub(super) late_bit: u8,
    pub(super) accel_edge_ns: Option<u64>,
    pub(super) gyro_edge_ns: Option<u64>,
    noise: Random,
    motion: Box<dyn Motion>,
}

impl core::fmt::Debug for Part {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Part")
            .field("now_ns", &self.now_ns)
            .field("options", &self.options)
            .field("faults", &self.faults)
            .finish_non_exhaustive()
    }
}

impl Part {
    /// Creates a part after power-up that senses `motion`.
    pub fn new(motion: impl Motion + 'static) -> Self {
        Self::with_options(motion, PartOptions::default())
    }

    /// Creates a specimen with these properties after power-up.
    pub fn with_options(motion: impl Motion + 'static, options: PartOptions) -> Self {
        Self {
            now_ns: 0,
            options,
            memory: Memory::new(),
            phase: Phase::Idle,
            words: Words::default(),
            faults: Faults::default(),
            flips: Random::new(options.seed ^ 0xF11F),
            busy: Some((Busy::Boot, options.start.boot_ns)),
            i3c: false,
            clock: Clock::new(1.0 + options.clock_error, options.jitter_ns, options.seed),
            next_tick: 0,
            accel: Channel::new(),
            gyro: Channel::new(),
            gyro_on_ns: 0,
            bus_clock_hertz: None,
            late_bit: 0,
            accel_edge_ns: None,
            gyro_edge_ns: None,
            noise: Random::new(options.seed),
            motion: Box::new(motion),
        }
    }

    /// Time since power-up, ns.
    #[must_use]
    pub const fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// Recorded violations of register accesses, in order; the first 256.
    #[must_use]
    pub fn violations(&self) -> &[Violation] {
        self.memory.violations()
    }

    /// Advances time to `now_ns` since power-up. Time does not run backwards.
    pub fn advance_to(&mut self, now_ns: u64) {
        let now_ps = now_ns.saturating_mul(1000);
        while self.measures() {
            let tick_ps = self.clock.tick_ps(self.next_tick);
            if tick_ps > now_ps {
                break;
            }
            let tick = self.next_tick;
            self.next_tick += 1;
            self.tick(tick, tick_ps);
        }
        self.now_ns = self.now_ns.max(now_ns);
        if let Some((_, until_ns)) = self.busy
            && until_ns <= self.now_ns
        {
            self.busy = None;
        }
    }

    /// Activates a fault.
    pub fn inject(&mut self, fault: PartFault) {
        match fault {
            PartFault::MisoStuckLow => self.faults.stuck = Some(0x00),
            PartFault::MisoStuckHigh => self.faults.stuck = Some(0xFF),
            PartFault::BitFlips { per_million } => self.faults.flips_per_million = per_million,
            PartFault::WrongId(id) => self.faults.id = Some(id),
            PartFault::Reset => self.reboot(),
            PartFault::Int1High => {
                self.reboot();
                self.i3c = true;
            }
            PartFault::DataReadyLost => self.faults.pins_lost = true,
            PartFault::DataReadyLosses { per_million } => {
                self.faults.losses_per_million = per_million.min(999_999);
            }
            PartFault::DataReadyStorm { period_ns } => {
                self.faults.storm_period_ns = Some(u64::from(period_ns).max(2));
            }
            PartFault::SdoDelay { ns } => self.faults.sdo_delay_ns = Some(ns),
            PartFault::FrozenOutput => {
                self.faults.accel.frozen = true;
                self.faults.gyro.frozen = true;
            }
            PartFault::SensorFrozen(sensor) => self.faults.broken(sensor).frozen = true,
            PartFault::AxisStuck { sensor, axis, code } => {
                self.faults.broken(sensor).stuck[axis as usize] = Some(code);
            }
            PartFault::RegisterFlipped { address, bits } => self.flip(address, bits),
            PartFault::ReservedBits => self.faults.reserved_bits = true,
            PartFault::DataReadyGlitches { period_ns, width_ns } => {
                let [period, width] = [period_ns, width_ns].map(u64::from);
                self.faults.glitches_ns = Some([period.max(2 * width).max(2), width]);
            }
            PartFault::PinsInverted => self.faults.pins_inverted = true,
            PartFault::Saturation => self.faults.saturated = true,
            PartFault::ClockRatio(ratio) => self.set_clock_ratio(ratio),
        }
    }

    /// Removes all faults. The effects of a reset remain.
    pub fn clear_faults(&mut self) {
        self.faults = Faults::default();
        self.set_clock_ratio(1.0);
    }

    fn set_clock_ratio(&mut self, ratio: f64) {
        let ratio = (1.0 + self.options.clock_error) * ratio;
        self.clock.set_ratio(ratio, self.now_ns * 1000);
        self.next_tick = self.clock.next_tick(self.now_ns * 1000);
    }

    /// Resets all settings; the part is busy for `duration_ns`.
    fn restart(&mut self, busy: Busy, duration_ns: u64) {
        self.memory.reset();
        self.words = Words::default();
        self.settings_changed();
        self.busy = Some((busy, self.now_ns + duration_ns));
    }

    pub(super) fn software_reset(&mut self) {
        let disabled = ctrl9_xl::I3C_DISABLE.is_set(self.memory.get(register::CTRL9_XL));
        self.i3c = self.drives_int1() || (self.i3c && !disabled);
        self.restart(Busy::Reset, RESET_NS);
    }

    pub(super) fn reboot(&mut self) {
        self.i3c = false;
        self.restart(Busy::Boot, self.options.start.boot_ns);
    }

    /// The host is reset, and lets go of INT1: where that is high, the part enters I3C mode.
    pub fn host_reset(&mut self) {
        self.i3c |= self.drives_int1();
    }

    const fn measures(&self) -> bool {
        self.accel.is_on() || self.gyro.is_on()
    }

    /// Applies the registers to the signal paths.
    pub(super) fn settings_changed(&mut self) {
        let asleep = !self.measures();
        let (accel, gyro) = (self.accel_setting(), self.gyro_setting());
        let start = self.options.start;
        let gyro_was_off = !self.gyro.is_on();
        self.accel.set(accel, self.now_ns, start.accel_turn_on_ns);
        self.gyro.set(gyro, self.now_ns, start.gyro_turn_on_ns);
        if gyro_was_off {
            self.gyro_on_ns = self.now_ns;
        }
        if asleep {
            // Skips the ticks that have passed while the part was asleep.
            self.next_tick = self.clock.next_tick(self.now_ns * 1000);
        }
    }

    fn tick(&mut self, tick: u64, tick_ps: u64) {
        let tick_ns = tick_ps.div_ceil(1000);
        let Stimulus { specific_force, angular_rate, temperature } =
            self.motion.at(tick_ps as f64 * 1.0e-12);
        let add = |a: [f64; 3], b: [f64; 3]| core::array::from_fn(|axis| a[axis] + b[axis]);
        let update = if ctrl3_c::BDU.is_set(self.memory.get(register::CTRL3_C)) {
            Update::Blocked
        } else {
            Update::Continuous
        };
        let error = self.gyro_start_error(tick_ns);
        let mut noise = self.options.noise.then_some(&mut self.noise);

        let mut gyro_sample = false;
        if self.gyro.is_on() {
            let input = add(angular_rate, self.options.gyro_offset(temperature));
            let input = input.map(|rate| rate + error);
            gyro_sample = self.gyro.tick(tick, tick_ns, input, noise.as_deref_mut());
        }
        let mut accel_sample = false;
        if self.accel.is_on() {
            let input = add(specific_force, self.options.accel_offset(temperature));
            accel_sample = self.accel.tick(tick, tick_ns, input, noise);
        }
        if gyro_sample {
            self.gyro_edge_ns = Some(tick_ns);
            let codes = self.broken(self.faults.gyro, self.gyro.codes);
            self.words.update_gyro(codes, update);
        }
        if accel_sample {
            self.accel_edge_ns = Some(tick_ns);
            let codes = self.broken(self.faults.accel, self.accel.codes);
            self.words.update_accel(codes, update);
        }
        if tick.is_multiple_of(TEMPERATURE_DIVIDER) {
            let code = libm::floor((temperature - REFERENCE_TEMPERATURE) * 256.0 + 0.5) as i16;
            self.words.update_temperature(code, update);
        }
    }

    /// Remaining error of the gyroscope after its start, rad/s.
    fn gyro_start_error(&self, now_ns: u64) -> f64 {
        let StartTimes { gyro_settled_ns, gyro_start_error, .. } = self.options.start;
        let left = (self.gyro_on_ns + gyro_settled_ns).saturating_sub(now_ns);
        if left == 0 {
            return 0.0;
        }
        gyro_start_error * left as f64 / gyro_settled_ns as f64
    }

    /// Returns the codes as output by a broken sensor; `None` if the old ones remain.
    fn broken(&self, broken: Broken, codes: [i16; 3]) -> Option<[i16; 3]> {
        if broken.frozen {
            None
        } else if self.faults.saturated {
            Some([i16::MAX, i16::MIN, i16::MAX])
        } else {
            let stuck = |axis: usize| broken.stuck[axis].unwrap_or(codes[axis]);
            Some(core::array::from_fn(stuck))
        }
    }
}

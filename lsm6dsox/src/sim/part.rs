//! The simulated part: its time and ticks, resets and faults, the bus, and the interrupt pins.

use std::boxed::Box;

use super::channel::{self, Channel};
use super::clock::Clock;
use super::fault::{Broken, Faults, PartFault};
use super::memory::{Bank, Memory, Update, Violation, Words};
use super::motion::{Motion, Stimulus};
use super::random::{Random, hash};
use crate::register::{
    self, Access, Register, counter_bdr_reg1, ctrl3_c, ctrl4_c, ctrl5_c, ctrl9_xl, func_cfg_access,
    int1_ctrl, int2_ctrl,
};
use crate::scale::{DEGREE, STANDARD_GRAVITY};
use crate::setting::Pin;

/// Duration of a software reset, ns \[S\].
const RESET_NS: u64 = 50_000;

/// Ticks per temperature sample: 52 Hz.
const TEMPERATURE_DIVIDER: u64 = 128;

/// Temperature at which offsets are specified and the temperature's code is 0, °C \[P\].
const REFERENCE_TEMPERATURE: f64 = 25.0;

/// Setup time of the master before the sampling edge, ns: of the order given in
/// STM32's data sheets (assumed).
const SETUP_NS: u32 = 5;

/// Duration of a data-ready pulse, ns \[D\].
const PULSE_NS: u64 = 75_000;

/// A simulated LSM6DSOX.
pub struct Part {
    now_ns: u64,
    options: PartOptions,
    memory: Memory,
    phase: Phase,
    words: Words,
    faults: Faults,
    flips: Random,
    busy: Option<(Busy, u64)>,
    /// Whether the part answers only on I3C.
    i3c: bool,
    clock: Clock,
    next_tick: u64,
    accel: Channel,
    gyro: Channel,
    /// Time at which the gyroscope was switched on, ns.
    gyro_on_ns: u64,
    bus_clock_hertz: Option<u32>,
    /// Last bit on the data line, used if bits are read late.
    late_bit: u8,
    accel_edge_ns: Option<u64>,
    gyro_edge_ns: Option<u64>,
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

    fn software_reset(&mut self) {
        let disabled = ctrl9_xl::I3C_DISABLE.is_set(self.memory.get(register::CTRL9_XL));
        self.i3c = self.drives_int1() || (self.i3c && !disabled);
        self.restart(Busy::Reset, RESET_NS);
    }

    fn reboot(&mut self) {
        self.i3c = false;
        self.restart(Busy::Boot, self.options.start.boot_ns);
    }

    /// Resets the host, which releases INT1. If INT1 is then high, the part enters I3C mode.
    pub fn host_reset(&mut self) {
        self.i3c |= self.drives_int1();
    }

    const fn measures(&self) -> bool {
        self.accel.is_on() || self.gyro.is_on()
    }

    /// Applies the registers to the signal paths.
    fn settings_changed(&mut self) {
        let asleep = !self.measures();
        let accel = channel::accel_setting(&self.memory, self.options.accel_test_signal);
        let gyro = channel::gyro_setting(&self.memory, self.options.gyro_test_signal);
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

/// The bus: reads and writes of registers, byte by byte.
impl Part {
    /// Drives chip select low: the next byte is an address, its top bit set to read.
    pub const fn select(&mut self) {
        self.phase = Phase::Address;
    }

    /// Drives chip select high.
    pub const fn deselect(&mut self) {
        self.phase = Phase::Idle;
    }

    /// Sets the clock with which the master reads from now on, Hz. If its half period is shorter than
    /// [`least_half_period_ns`](Self::least_half_period_ns), every bit is read one clock late.
    pub const fn set_bus_clock(&mut self, hertz: u32) {
        self.bus_clock_hertz = Some(hertz);
        if self.options.byte_time_ns > 0 && hertz > 0 {
            self.options.byte_time_ns = (8_000_000_000 / hertz as u64) as u32;
        }
    }

    /// Least time from the clock's shifting edge to its sampling edge with which the part's data are
    /// read correctly, ns: the part's delay and the master's setup time.
    #[must_use]
    pub fn least_half_period_ns(&self) -> u32 {
        self.faults.sdo_delay_ns.unwrap_or(self.options.sdo_delay_ns) + SETUP_NS
    }

    /// Returns whether the data line lags the master's clock.
    fn is_late(&self) -> bool {
        let half_period_ns = |hertz: u32| 500_000_000 / hertz.max(1);
        self.bus_clock_hertz
            .is_some_and(|hertz| half_period_ns(hertz) < self.least_half_period_ns())
    }

    /// Exchanges one byte with the master. While chip select is high, with 3-wire SPI, or in I3C mode, the part does
    /// not drive the data line: [`open_line`](super::PartOptions::open_line).
    pub fn exchange(&mut self, out: u8) -> u8 {
        let byte = self.answer(out);
        if self.i3c || ctrl3_c::SIM.is_set(self.memory.get(register::CTRL3_C)) {
            return self.faults.stuck.unwrap_or(self.options.open_line);
        }
        if !self.is_late() {
            return byte;
        }
        let late = self.late_bit << 7 | byte >> 1;
        self.late_bit = byte & 1;
        self.faults.stuck.unwrap_or(late)
    }

    /// Returns the byte that the part shifts out while it receives `out`.
    fn answer(&mut self, out: u8) -> u8 {
        self.byte_time();
        match self.phase {
            Phase::Idle => self.options.open_line,
            Phase::Address => {
                let address = out & !Register::READ;
                self.phase = if out & Register::READ == 0 {
                    Phase::Writing(address)
                } else {
                    Phase::Reading(address)
                };
                0
            }
            Phase::Reading(address) => {
                self.phase = Phase::Reading(self.following(address));
                self.read_bus(address)
            }
            Phase::Writing(address) => {
                self.phase = Phase::Writing(self.following(address));
                self.write_register(address, out);
                0
            }
        }
    }

    /// Returns whether the part answers on I²C.
    pub(super) fn has_i2c(&self) -> bool {
        !ctrl4_c::I2C_DISABLE.is_set(self.memory.get(register::CTRL4_C))
    }

    /// Returns the address that follows in a burst.
    pub(super) fn following(&self, address: u8) -> u8 {
        let increments = ctrl3_c::IF_INC.is_set(self.memory.get(register::CTRL3_C));
        if !increments { address } else { self.rounded(address).unwrap_or((address + 1) & 0x7F) }
    }

    /// Returns the address to which a burst wraps from the last output, by `ROUNDING` in `CTRL5_C`.
    fn rounded(&self, address: u8) -> Option<u8> {
        const LAST_GYRO: u8 = register::OUTX_L_A.address - 1;
        const LAST_ACCEL: u8 = register::OUTZ_H_A.address;
        let rounding = ctrl5_c::ROUNDING.of(self.memory.get(register::CTRL5_C));
        match (rounding, address) {
            (0b01, LAST_ACCEL) => Some(register::OUTX_L_A.address),
            (0b10, LAST_GYRO) | (0b11, LAST_ACCEL) => Some(register::OUTX_L_G.address),
            _ => None,
        }
    }

    /// Advances time by one byte on the bus.
    pub(super) fn byte_time(&mut self) {
        if self.options.byte_time_ns > 0 {
            self.advance_to(self.now_ns + u64::from(self.options.byte_time_ns));
        }
    }

    /// Returns a byte as received by the master, with the faults of the line.
    pub(super) fn read_bus(&mut self, address: u8) -> u8 {
        let mut byte = self.read_register(address);
        if self.faults.reserved_bits
            && let Some(register) = register::ALL.iter().find(|r| r.address == address)
            && register.access == Access::ReadWrite
        {
            byte ^= !register.mask;
        }
        if self.faults.flips_per_million > 0 {
            for bit in 0..8 {
                byte ^= u8::from(self.flips.chance(self.faults.flips_per_million)) << bit;
            }
        }
        self.faults.stuck.unwrap_or(byte)
    }

    fn read_register(&mut self, address: u8) -> u8 {
        const OUT: u8 = register::OUT_TEMP_L.address;
        const OUT_END: u8 = register::OUTZ_H_A.address;
        const IS: fn(Register) -> u8 = |register| register.address;
        match self.busy {
            Some((Busy::Boot, _)) => return 0,
            Some((Busy::Reset, _)) if address == IS(register::CTRL3_C) => {
                return register::CTRL3_C.reset | ctrl3_c::SW_RESET.mask();
            }
            _ => {}
        }
        if let Some(bank) = self.other_bank(address) {
            return self.memory.read_other(bank, address);
        }
        match address {
            OUT..=OUT_END => self.words.read(address - OUT),
            _ if address == IS(register::STATUS_REG) => self.words.status(),
            _ if address == IS(register::WHO_AM_I) => {
                self.faults.id.unwrap_or(register::WHO_AM_I.reset)
            }
            _ if address == IS(register::INTERNAL_FREQ_FINE) => {
                let steps = libm::floor(self.options.clock_error / 0.0015 + 0.5);
                // The cast saturates at the range of the register.
                (steps as i8).to_le_bytes()[0]
            }
            _ => self.memory.read(address),
        }
    }

    /// Handles a byte written by the master.
    pub(super) fn write_register(&mut self, address: u8, value: u8) {
        if self.busy.is_some() {
            return;
        }
        if let Some(bank) = self.other_bank(address) {
            return self.memory.write_other(bank, address, value);
        }
        self.memory.write(address, value);
        self.act_on(address, value);
    }

    /// Returns the bank that an address refers to, if it is not the one described in
    /// [`register`]: that of the embedded functions or of the sensor hub.
    fn other_bank(&self, address: u8) -> Option<Bank> {
        const SENSOR_HUB: u8 = 0b01;
        if address == register::FUNC_CFG_ACCESS.address {
            return None;
        }
        let access = self.memory.get(register::FUNC_CFG_ACCESS);
        match func_cfg_access::REG_ACCESS.of(access) {
            0 => None,
            SENSOR_HUB => Some(Bank::SensorHub),
            _ => Some(Bank::EmbeddedFunctions),
        }
    }

    /// Changes bits of a register without a write on the bus.
    fn flip(&mut self, address: u8, bits: u8) {
        let value = self.memory.read(address) ^ bits;
        self.memory.force(address, value);
        self.act_on(address, value);
    }

    /// Applies the effect of a register's new value.
    fn act_on(&mut self, address: u8, value: u8) {
        if address == register::CTRL3_C.address && ctrl3_c::BOOT.is_set(value) {
            return self.reboot();
        }
        if address == register::CTRL3_C.address && ctrl3_c::SW_RESET.is_set(value) {
            return self.software_reset();
        }
        self.settings_changed();
    }
}

/// The interrupt pins: their levels and next rising edges.
impl Part {
    /// Returns whether accelerometer and gyroscope are routed to a pin.
    fn routing(&self, pin: Pin) -> (bool, bool) {
        let (int1, int2) =
            (self.memory.get(register::INT1_CTRL), self.memory.get(register::INT2_CTRL));
        let first = (int1_ctrl::DRDY_XL.is_set(int1), int1_ctrl::DRDY_G.is_set(int1));
        let second = (int2_ctrl::DRDY_XL.is_set(int2), int2_ctrl::DRDY_G.is_set(int2));
        let together = ctrl4_c::INT2_ON_INT1.is_set(self.memory.get(register::CTRL4_C));
        match (pin, together) {
            (Pin::Int1, false) => first,
            (Pin::Int2, false) => second,
            (Pin::Int1, true) => (first.0 || second.0, first.1 || second.1),
            (Pin::Int2, true) => (false, false),
        }
    }

    fn pulsed(&self) -> bool {
        counter_bdr_reg1::DATAREADY_PULSED.is_set(self.memory.get(register::COUNTER_BDR_REG1))
    }

    /// Returns whether a pin is high now.
    #[must_use]
    pub fn pin_is_high(&self, pin: Pin) -> bool {
        if self.faults.pins_lost {
            return false;
        }
        if let Some(period) = self.faults.storm_period_ns {
            return self.now_ns % period < period / 2;
        }
        self.glitches() || self.announces(pin) != self.is_active_low()
    }

    /// Width, ns, of the glitch that drives a pin high now; `None` if no glitch does.
    #[must_use]
    pub fn glitch_ns(&self, pin: Pin) -> Option<u64> {
        let is_glitch = self.glitches() && self.announces(pin) == self.is_active_low();
        let [_, width] = self.faults.glitches_ns?;
        is_glitch.then_some(width)
    }

    /// Returns whether the part drives INT1 high now.
    fn drives_int1(&self) -> bool {
        self.announces(Pin::Int1) != (self.is_active_low() != self.faults.pins_inverted)
    }

    /// Returns whether the pins are active low at the host.
    fn is_active_low(&self) -> bool {
        let active_low = ctrl3_c::H_LACTIVE.is_set(self.memory.get(register::CTRL3_C));
        active_low != self.faults.pins_inverted
    }

    /// Returns whether the pulse that begins at `edge_ns` is lost.
    const fn loses(&self, edge_ns: u64) -> bool {
        hash(edge_ns) % 1_000_000 < self.faults.losses_per_million as u64
    }

    /// Returns whether a glitch drives the pins high now.
    fn glitches(&self) -> bool {
        let glitches = self.faults.glitches_ns;
        glitches.is_some_and(|[period, width]| self.now_ns % period < width)
    }

    /// Returns whether a signal routed to a pin drives it high.
    fn announces(&self, pin: Pin) -> bool {
        let (accel, gyro) = self.routing(pin);
        let recent = |edge: Option<u64>| {
            edge.is_some_and(|edge| self.now_ns < edge + PULSE_NS && !self.loses(edge))
        };
        let (accel_ready, gyro_ready) = if self.pulsed() {
            (recent(self.accel_edge_ns), recent(self.gyro_edge_ns))
        } else {
            (self.words.accel_fresh, self.words.gyro_fresh)
        };
        (accel && accel_ready) || (gyro && gyro_ready)
    }

    /// Time of a pin's next rising edge by data-ready, ns since power-up, later than now. `None` if there is no edge,
    /// or none before the sample that holds the pin high is read.
    #[must_use]
    pub fn next_rising_edge_ns(&self, pin: Pin) -> Option<u64> {
        if self.faults.pins_lost {
            return None;
        }
        if let Some(period) = self.faults.storm_period_ns {
            return Some((self.now_ns / period + 1) * period);
        }
        let (accel, gyro) = self.routing(pin);
        if self.is_active_low() {
            return self.next_end_of_a_pulse_ns(accel, gyro);
        }
        if !self.pulsed() && self.announces(pin) {
            return None;
        }
        // A glitch within a sample's pulse does not cause an edge.
        let pulse_end = |routed: bool, edge: Option<u64>| {
            let edge = edge.filter(|_| routed && self.pulsed());
            edge.map_or(0, |edge| edge + PULSE_NS - 1)
        };
        let low_from = self
            .now_ns
            .max(pulse_end(accel, self.accel_edge_ns).max(pulse_end(gyro, self.gyro_edge_ns)));
        let glitch = self.faults.glitches_ns;
        let glitch = glitch.map(|[period, _]| (low_from / period + 1) * period);
        let edge = |routed: bool, channel: &Channel| {
            routed.then(|| self.next_sample_ns(channel)).flatten()
        };
        [edge(accel, &self.accel), edge(gyro, &self.gyro), glitch].into_iter().flatten().min()
    }

    /// Time of the next rising edge of active-low pins: the end of a pulse. Latched pins rise when a sample is read.
    fn next_end_of_a_pulse_ns(&self, accel: bool, gyro: bool) -> Option<u64> {
        if !self.pulsed() {
            return None;
        }
        let end = |routed: bool, last: Option<u64>, channel: &Channel| {
            let last = last.filter(|edge| self.now_ns < edge + PULSE_NS);
            let edge = last.or_else(|| self.next_sample_ns(channel));
            edge.filter(|_| routed).map(|edge| edge + PULSE_NS)
        };
        [end(accel, self.accel_edge_ns, &self.accel), end(gyro, self.gyro_edge_ns, &self.gyro)]
            .into_iter()
            .flatten()
            .min()
    }

    fn next_sample_ns(&self, channel: &Channel) -> Option<u64> {
        let starts_ps = channel.starts_ns * 1000;
        let mut tick = self.next_tick;
        if starts_ps > self.clock.tick_ps(tick) {
            tick = self.clock.next_tick(starts_ps.saturating_sub(1));
        }
        loop {
            tick = channel.next_sample(tick)?;
            let edge_ns = self.clock.tick_ps(tick).div_ceil(1000);
            if !self.loses(edge_ns) {
                return Some(edge_ns);
            }
            tick += 1;
        }
    }
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
    /// Enables noise. A run spends most of its time on noise, which matters if it simulates an
    /// hour.
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

/// State in which the part does not answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Busy {
    /// Booting: nothing answers.
    Boot,
    /// A software reset: `SW_RESET` reads 1, writes are lost.
    Reset,
}

/// State of an SPI transaction.
#[derive(Clone, Copy, Debug, Default)]
enum Phase {
    /// Chip select is high.
    #[default]
    Idle,
    /// The next byte is an address.
    Address,
    /// The next byte goes to the master.
    Reading(u8),
    /// The next byte comes from the master.
    Writing(u8),
}

//! Signal path of one sensor from motion to codes, for its three axes: the setting in the registers, a low-pass filter,
//! noise, and the codes.

use super::clock::Clock;
use super::memory::Memory;
use super::random::Random;
use crate::noise;
use crate::register::{self, ctrl1_xl, ctrl2_g, ctrl4_c, ctrl5_c, ctrl6_c, ctrl8_xl};
use crate::scale::{AccelFullScale, DEGREE, GyroFullScale, STANDARD_GRAVITY};
use crate::setting::{AccelFilter, Ftype, GyroFilter, Odr};

/// Fraction of the data rate used if the gyroscope's cut-off is unknown.
const UNKNOWN_CUTOFF: f64 = 0.4;

/// Settings of a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Setting {
    /// Ticks from one sample to the next; 0 is off.
    pub(super) divider: u64,
    /// Cut-off, Hz; `None` disables the filter.
    pub(super) cutoff: Option<f64>,
    /// SI units per code.
    pub(super) sensitivity: f64,
    /// Noise density, SI units per √Hz.
    pub(super) density: f64,
    /// Test signal, SI units.
    pub(super) test_signal: [f64; 3],
}

/// A channel: filters and the newest sample.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    setting: Setting,
    low_pass: LowPass,
    states: Option<[FilterState; 3]>,
    codes_per_unit: f64,
    noise_codes: f64,
    /// Codes of the newest sample.
    pub(super) codes: [i16; 3],
    /// Time of the earliest sample, ns.
    pub(super) starts_ns: u64,
}

impl Channel {
    pub(super) fn new() -> Self {
        Self {
            setting: Setting {
                divider: 0,
                cutoff: None,
                sensitivity: 1.0,
                density: 0.0,
                test_signal: [0.0; 3],
            },
            low_pass: LowPass::OPEN,
            states: None,
            codes_per_unit: 1.0,
            noise_codes: 0.0,
            codes: [0; 3],
            starts_ns: 0,
        }
    }

    /// Applies another setting. A sensor that was off gives its first sample `turn_on_ns` later.
    pub(super) fn set(&mut self, setting: Setting, now_ns: u64, turn_on_ns: u64) {
        if setting == self.setting {
            return;
        }
        if self.setting.divider == 0 {
            self.starts_ns = now_ns + turn_on_ns;
            self.states = None;
        }
        if setting.sensitivity != self.setting.sensitivity || setting.cutoff != self.setting.cutoff
        {
            self.states = None;
        }
        self.low_pass =
            setting.cutoff.map_or(LowPass::OPEN, |cutoff| LowPass::new(cutoff, Clock::RATE));
        self.codes_per_unit = 1.0 / setting.sensitivity;
        // White noise of a density up to half the rate of the ticks.
        self.noise_codes = setting.density * libm::sqrt(Clock::RATE / 2.0) * self.codes_per_unit;
        self.setting = setting;
    }

    pub(super) const fn is_on(&self) -> bool {
        self.setting.divider != 0
    }

    /// Returns the first tick from `tick` on that gives a sample, ignoring the start time.
    pub(super) const fn next_sample(&self, tick: u64) -> Option<u64> {
        if self.is_on() { Some(tick.next_multiple_of(self.setting.divider)) } else { None }
    }

    /// Processes one tick; returns whether a new sample was produced.
    pub(super) fn tick(
        &mut self,
        tick: u64,
        tick_ns: u64,
        input: [f64; 3],
        noise: Option<&mut Random>,
    ) -> bool {
        const LAST: f64 = 32_767.0;
        const FIRST: f64 = -32_768.0;
        let mut x: [f64; 3] = core::array::from_fn(|axis| {
            (input[axis] + self.setting.test_signal[axis]) * self.codes_per_unit
        });
        if let Some(random) = noise {
            for x in &mut x {
                *x += self.noise_codes * random.normal();
            }
        }
        // A NaN or an infinity would stay in the filter forever.
        let x = x.map(|x| if x.is_nan() { 0.0 } else { x.clamp(FIRST, LAST) });
        let states = self.states.get_or_insert_with(|| x.map(|x| self.low_pass.settled(x)));
        let mut y = [0.0; 3];
        for ((y, state), x) in y.iter_mut().zip(states).zip(x) {
            *y = self.low_pass.step(state, x);
        }
        let is_sample = tick.is_multiple_of(self.setting.divider) && tick_ns >= self.starts_ns;
        if is_sample {
            // The cast saturates.
            self.codes = y.map(|y| libm::floor(y + 0.5) as i16);
        }
        is_sample
    }
}

/// Setting of the accelerometer's channel by the registers, with this change under a test signal, m/s².
pub(super) fn accel_setting(memory: &Memory, test_signal: [f64; 3]) -> Setting {
    let ctrl1 = memory.get(register::CTRL1_XL);
    let odr_code = ctrl1_xl::ODR_XL.of(ctrl1);
    let ctrl8 = memory.get(register::CTRL8_XL);
    let full_scale = match accel_full_scale(ctrl1_xl::FS_XL.of(ctrl1)) {
        // The code of 16 g is a second code of 2 g in the mode with a range up to 8 g.
        AccelFullScale::G16 if ctrl8_xl::XL_FS_MODE.is_set(ctrl8) => AccelFullScale::G2,
        full_scale => full_scale,
    };
    let rate = nominal_rate(odr_code);
    let filter = if ctrl1_xl::LPF2_XL_EN.is_set(ctrl1) {
        let hpcf = ctrl8_xl::HPCF_XL.of(ctrl8);
        AccelFilter::ALL[usize::from(hpcf) + 1]
    } else {
        AccelFilter::OdrDiv2
    };
    let sign = match ctrl5_c::ST_XL.of(memory.get(register::CTRL5_C)) {
        0b01 => 1.0,
        0b10 => -1.0,
        _ => 0.0,
    };
    let density = noise::accel_micro_g_per_root_hertz(full_scale);
    Setting {
        divider: divider(odr_code),
        cutoff: Some(rate / f64::from(filter.divisor())),
        sensitivity: accel_sensitivity(full_scale),
        density: f64::from(density) * 1.0e-6 * f64::from(STANDARD_GRAVITY),
        test_signal: test_signal.map(|signal| sign * signal),
    }
}

/// Setting of the gyroscope's channel by the registers, with this change under a test signal, rad/s.
pub(super) fn gyro_setting(memory: &Memory, test_signal: [f64; 3]) -> Setting {
    let ctrl2 = memory.get(register::CTRL2_G);
    let odr_code = ctrl2_g::ODR_G.of(ctrl2);
    let full_scale = gyro_full_scale(ctrl2);
    let filter = if ctrl4_c::LPF1_SEL_G.is_set(memory.get(register::CTRL4_C)) {
        let ftype = ctrl6_c::FTYPE.of(memory.get(register::CTRL6_C));
        GyroFilter::Lpf1(Ftype::ALL[usize::from(ftype)])
    } else {
        GyroFilter::Lpf2
    };
    let cutoff =
        filter.cutoff(odr(odr_code)).map_or(UNKNOWN_CUTOFF * nominal_rate(odr_code), f64::from);
    let sign = match ctrl5_c::ST_G.of(memory.get(register::CTRL5_C)) {
        0b01 => 1.0,
        0b11 => -1.0,
        _ => 0.0,
    };
    let asleep = ctrl4_c::SLEEP_G.is_set(memory.get(register::CTRL4_C));
    // The gyroscope has no 1.6 Hz rate.
    let divider = if odr_code > 10 || asleep { 0 } else { divider(odr_code) };
    Setting {
        divider,
        cutoff: Some(cutoff),
        sensitivity: gyro_sensitivity(full_scale),
        density: f64::from(noise::GYRO_MILLI_DPS_PER_ROOT_HERTZ) * 1.0e-3 * f64::from(DEGREE),
        test_signal: test_signal.map(|signal| sign * signal),
    }
}

/// Converts an ODR field to ticks per sample. The data rates are 6667 Hz divided by powers of two.
const fn divider(odr_code: u8) -> u64 {
    match odr_code {
        code @ 1..=10 => 1 << (10 - code),
        // 1.6 Hz.
        11 => 4096,
        _ => 0,
    }
}

fn odr(code: u8) -> Odr {
    Odr::ALL.into_iter().find(|odr| odr.code() == code).unwrap_or_default()
}

/// Nominal rate by ST's names, Hz, for the cut-offs that are fractions of it.
fn nominal_rate(odr_code: u8) -> f64 {
    f64::from(odr(odr_code).hertz())
}

/// Returns the full scale for a value of `FS_XL`.
fn accel_full_scale(fs_xl: u8) -> AccelFullScale {
    AccelFullScale::ALL
        .into_iter()
        .find(|full_scale| full_scale.code() == fs_xl)
        .unwrap_or_default()
}

/// Returns the full scale for a value of `CTRL2_G`.
fn gyro_full_scale(ctrl2: u8) -> GyroFullScale {
    let fs_g = ctrl2_g::FS_G.of(ctrl2);
    if ctrl2_g::FS_125.is_set(ctrl2) {
        return GyroFullScale::Dps125;
    }
    GyroFullScale::ALL
        .into_iter()
        .find(|full_scale| full_scale.code() == fs_g && *full_scale != GyroFullScale::Dps125)
        .unwrap_or_default()
}

/// Sensitivity, m/s² per code.
fn accel_sensitivity(full_scale: AccelFullScale) -> f64 {
    f64::from(full_scale.milli_g_per_code()) * 1.0e-3 * f64::from(STANDARD_GRAVITY)
}

/// Sensitivity, rad/s per code.
fn gyro_sensitivity(full_scale: GyroFullScale) -> f64 {
    f64::from(full_scale.milli_dps_per_code()) * 1.0e-3 * f64::from(DEGREE)
}

/// Coefficients of a second-order Butterworth low-pass, by the bilinear transform with prewarping.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LowPass {
    b0: f64,
    b1: f64,
    b2: f64,
    a1: f64,
    a2: f64,
}

/// State of the filter.
#[derive(Clone, Copy, Debug, Default)]
struct FilterState {
    s1: f64,
    s2: f64,
}

impl LowPass {
    /// Passes everything.
    const OPEN: Self = Self { b0: 1.0, b1: 0.0, b2: 0.0, a1: 0.0, a2: 0.0 };

    /// Creates a filter with its −3 dB point at `cutoff`. It passes everything if `cutoff` is nearly half the rate or more.
    fn new(cutoff: f64, rate: f64) -> Self {
        if cutoff >= 0.49 * rate {
            return Self::OPEN;
        }
        let k = libm::tan(core::f64::consts::PI * cutoff / rate);
        let norm = 1.0 / (1.0 + core::f64::consts::SQRT_2 * k + k * k);
        let b0 = k * k * norm;
        Self {
            b0,
            b1: 2.0 * b0,
            b2: b0,
            a1: 2.0 * (k * k - 1.0) * norm,
            a2: (1.0 - core::f64::consts::SQRT_2 * k + k * k) * norm,
        }
    }

    /// State in which a constant input passes unchanged.
    const fn settled(&self, x: f64) -> FilterState {
        FilterState { s1: x * (1.0 - self.b0), s2: x * (self.b2 - self.a2) }
    }

    const fn step(&self, state: &mut FilterState, x: f64) -> f64 {
        let y = self.b0 * x + state.s1;
        state.s1 = self.b1 * x - self.a1 * y + state.s2;
        state.s2 = self.b2 * x - self.a2 * y;
        y
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn divided_data_rates_match_their_nominal_values() {
        for odr in Odr::ALL {
            let divider = divider(odr.code());
            if odr == Odr::Off {
                assert_eq!(divider, 0);
            } else {
                let rate = Clock::RATE / divider as f64;
                // 12.5 Hz is 13.02 Hz, as on the part, by the formula in its datasheet.
                assert!((rate / f64::from(odr.hertz()) - 1.0).abs() < 0.05, "{odr:?}");
            }
        }
    }

    #[test]
    fn full_scales_are_found_by_their_codes() {
        for full_scale in AccelFullScale::ALL {
            assert_eq!(accel_full_scale(full_scale.code()), full_scale);
        }
        for full_scale in GyroFullScale::ALL {
            let fs_125 = u8::from(full_scale == GyroFullScale::Dps125);
            let ctrl2 = ctrl2_g::FS_G.place(full_scale.code()) | ctrl2_g::FS_125.place(fs_125);
            assert_eq!(gyro_full_scale(ctrl2), full_scale);
        }
    }

    #[test]
    fn a_code_is_the_nearest_multiple_and_ends_with_the_range() {
        let mut channel = Channel::new();
        channel.set(
            Setting {
                divider: 1,
                cutoff: None,
                sensitivity: 0.5,
                density: 0.0,
                test_signal: [0.0; 3],
            },
            0,
            0,
        );
        assert!(channel.tick(0, 0, [0.74, -0.76, 1.0e9], None));
        assert_eq!(channel.codes, [1, -2, i16::MAX]);
        assert!(channel.tick(1, 0, [-1.0e9, f64::NAN, 0.0], None));
        assert_eq!(channel.codes, [i16::MIN, 0, 0]);
    }

    const RATE: f64 = 6667.0;

    fn gain(cutoff: f64, frequency: f64) -> f64 {
        let filter = LowPass::new(cutoff, RATE);
        let mut state = FilterState::default();
        let mut peak: f64 = 0.0;
        for i in 0..60_000 {
            let x = libm::sin(core::f64::consts::TAU * frequency * f64::from(i) / RATE);
            let y = filter.step(&mut state, x);
            if i > 30_000 {
                peak = peak.max(y.abs());
            }
        }
        peak
    }

    #[test]
    fn half_the_power_is_left_at_the_cut_off() {
        for cutoff in [12.5, 333.35, 335.0, 1442.0] {
            assert!(
                (gain(cutoff, cutoff) - core::f64::consts::FRAC_1_SQRT_2).abs() < 0.01,
                "{cutoff}"
            );
        }
    }

    #[test]
    fn aliasing_frequencies_are_damped_to_a_third_or_less() {
        // 667 Hz folds onto the cut-off itself: −12 dB.
        assert!(gain(335.0, 667.0) < 0.26);
        assert!(gain(335.0, 1000.0) < 0.12);
    }

    #[test]
    fn slow_motion_is_delayed_by_two_thirds_of_a_millisecond() {
        for cutoff in [333.35, 335.0] {
            let filter = LowPass::new(cutoff, RATE);
            let mut state = FilterState::default();
            // A ramp of one unit per second, long after its start.
            let late = (0..10_000).fold(0.0, |_, i| {
                let x = f64::from(i) / RATE;
                x - filter.step(&mut state, x)
            });
            assert!((late - 0.67e-3).abs() < 0.005e-3, "{cutoff} Hz: {late} s");
        }
    }

    #[test]
    fn a_settled_filter_gives_back_a_constant() {
        let filter = LowPass::new(335.0, RATE);
        let mut state = filter.settled(123.0);
        for _ in 0..10 {
            assert!((filter.step(&mut state, 123.0) - 123.0).abs() < 1.0e-9);
        }
    }
}

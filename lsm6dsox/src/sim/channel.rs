//! Signal path of one sensor from motion to codes, for its three axes.

use super::clock::Clock;
use super::filter::{LowPass, State};
use super::random::Random;
use crate::register::ctrl2_g;
use crate::scale::{AccelFullScale, DEGREE, GyroFullScale, STANDARD_GRAVITY};

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
    states: Option<[State; 3]>,
    codes_per_unit: f64,
    noise_codes: f64,
    /// Codes of the newest sample.
    pub(super) codes: [i16; 3],
    /// Time of the earliest sample, ns.
    pub(super) starts_ns: u64,
}

/// Converts an ODR field to ticks per sample. The data rates are 6667 Hz divided by powers of two.
pub(super) const fn divider(odr_code: u8) -> u64 {
    match odr_code {
        code @ 1..=10 => 1 << (10 - code),
        // 1.6 Hz.
        11 => 4096,
        _ => 0,
    }
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
        // A NaN or an infinity would stay in the filter for good.
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

/// Returns the full scale for a value of `FS_XL`.
pub(super) fn accel_full_scale(fs_xl: u8) -> AccelFullScale {
    AccelFullScale::ALL
        .into_iter()
        .find(|full_scale| full_scale.code() == fs_xl)
        .unwrap_or_default()
}

/// Returns the full scale for a value of `CTRL2_G`.
pub(super) fn gyro_full_scale(ctrl2: u8) -> GyroFullScale {
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
pub(super) fn accel_sensitivity(full_scale: AccelFullScale) -> f64 {
    f64::from(full_scale.milli_g_per_code()) * 1.0e-3 * f64::from(STANDARD_GRAVITY)
}

/// Sensitivity, rad/s per code.
pub(super) fn gyro_sensitivity(full_scale: GyroFullScale) -> f64 {
    f64::from(full_scale.milli_dps_per_code()) * 1.0e-3 * f64::from(DEGREE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setting::Odr;

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
}

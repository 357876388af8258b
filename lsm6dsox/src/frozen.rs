//! Detection of a part that reports new samples with old values: the whole part, one sensor, or one axis.
//!
//! Codes scatter by their sensor's noise, so they also repeat by chance. The probability of a repeat depends on the noise in
//! codes, which at the kilohertz preset is 4.1 codes of specific force and 1.0 of angular rate. It is largest if the mean lies
//! in the middle of a code. For such a mean, and for the filter's correlation of 0.24 from one sample to the next, it is:
//!
//! | noise | accelerometer | gyroscope |
//! |---|---|---|
//! | that of the preset | 0.10 | 0.39 |
//! | half of it | 0.20 | 0.69 |
//!
//! Repeats are counted in blocks of [`BLOCK`](FrozenDetector::BLOCK) samples, in which an axis has
//! either changed or not:
//!
//! | repeated | blocks without a change | detected after at most | false alarms in 100 years, at the preset's noise | at half of it |
//! |---|---|---|---|---|
//! | one axis of the accelerometer | 2 | 30 samples | 9 · 10⁻⁹ | 0.008 |
//! | the accelerometer | 1 | 20 samples | 3 · 10⁻¹⁹ | 2 · 10⁻¹⁰ |
//! | one axis of the gyroscope | 8 | 90 samples | 5 · 10⁻²¹ | 0.25 |
//! | the gyroscope | 3 | 40 samples | 2 · 10⁻²⁵ | 0.002 |
//!
//! A unit test computes these values. If the noise is below 0.49 codes, behind a narrow filter or at a wide full
//! scale, a working axis repeats as long. Repeats prove nothing at the end of the range either. The kilohertz preset
//! has 1.0 codes of noise in angular rate. The preset for 417 Hz, with its filter of 171 Hz, has 0.7 codes.
//!
//! **A part with less noise** shows it by runs without a change that end by themselves. The detector keeps the longest of
//! them, and takes only a run for frozen that is [`FACTOR`](FrozenDetector::FACTOR) times as long. Among *n* blocks the
//! longest run has *log n* / *log q* blocks if a block repeats with probability 1/*q*. So a run of five times that length
//! comes by chance once in *n*⁵ blocks. An axis whose runs of 510 samples end by themselves is not judged.
//!
//! At a start no run has ended yet, so the first runs of such a part could be taken for frozen. With 0.3 codes of noise,
//! this would happen in one start of a hundred. Therefore an axis that changes in less than a third of the samples is
//! judged only after [`PROVEN`](FrozenDetector::PROVEN) samples. At 0.3 codes unit tests see no false alarm in an hour of
//! rest, nor in 500 starts. Below 0.25 codes a run can still be so long that it is taken for frozen.

use crate::sample::RawSample;

/// Detects fresh samples that have stopped changing.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrozenDetector {
    last: [i16; AXES],
    /// Whether each axis has changed in this block.
    changed: [bool; AXES],
    /// Whether each axis changed in the previous blocks.
    changed_before: [bool; AXES],
    repeats: u16,
    /// Samples until this block ends; 0 before the first sample.
    left: u8,
    /// Consecutive blocks without a change of each axis, and of all axes of each sensor.
    axes: [Run; AXES],
    sensors: [Run; 2],
    /// Samples in which each axis has changed, of the first [`PROVEN`](Self::PROVEN).
    changes: [u16; AXES],
    samples: u16,
    /// Longest repeat of all six codes that ended by itself.
    longest_repeats: u16,
    frozen: u8,
    seen: bool,
}

/// Consecutive blocks without a change.
#[derive(Clone, Copy, Debug, Default)]
struct Run {
    now: u8,
    /// Longest run that ended by itself, blocks.
    longest: u8,
}

impl Run {
    /// Adds a block.
    fn update(&mut self, changed: bool) {
        if changed {
            self.longest = self.longest.max(self.now);
            self.now = 0;
        } else {
            self.now = self.now.saturating_add(1);
        }
    }

    /// Returns whether the run is too long for a working part: at least `least` blocks, and several times the longest run that ended.
    fn is_frozen(self, least: u8) -> bool {
        let most = self.longest.checked_mul(FrozenDetector::FACTOR);
        most.is_some_and(|most| self.now >= most.max(least))
    }
}

/// Axes in the order ax ay az wx wy wz.
const AXES: usize = 6;

impl FrozenDetector {
    /// Repeats of all six codes from which the part counts as frozen.
    pub const REPEATS: u16 = 8;

    /// Samples per block.
    pub const BLOCK: u8 = 10;

    /// Blocks without a change from which one axis of the accelerometer counts as stuck.
    pub const ACCEL_AXIS_BLOCKS: u8 = 2;
    /// Blocks without a change from which all axes of the accelerometer count as stuck.
    pub const ACCEL_BLOCKS: u8 = 1;
    /// Blocks without a change from which one axis of the gyroscope counts as stuck.
    pub const GYRO_AXIS_BLOCKS: u8 = 8;
    /// Blocks without a change from which all axes of the gyroscope count as stuck.
    pub const GYRO_BLOCKS: u8 = 3;

    /// Multiple of the longest run without a change that ended by itself from which a run counts as frozen.
    pub const FACTOR: u8 = 5;

    /// Samples after which an axis is judged however seldom it changes. The longest run is known by then.
    pub const PROVEN: u16 = 1_000;

    /// Mask of all axes: the part as a whole.
    pub const EVERY_AXIS: u8 = 0b11_1111;

    /// Creates a detector without samples.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Processes the next sample and returns the frozen axes: bit *i* is axis *i* of ax ay az wx wy wz. Stale samples
    /// change nothing, because they are already flagged.
    pub fn update(&mut self, sample: &RawSample) -> u8 {
        if !sample.is_fresh() {
            return self.frozen();
        }
        let ([ax, ay, az], [wx, wy, wz]) = (sample.specific_force.codes, sample.angular_rate.codes);
        let codes = [ax, ay, az, wx, wy, wz];
        let last = core::mem::replace(&mut self.last, codes);
        for ((changed, code), last) in self.changed.iter_mut().zip(codes).zip(last) {
            *changed |= code != last;
        }
        if self.samples < Self::PROVEN {
            self.samples += 1;
            for ((changes, code), last) in self.changes.iter_mut().zip(codes).zip(last) {
                *changes += u16::from(code != last);
            }
        }
        if codes == last {
            self.repeats = self.repeats.saturating_add(1);
        } else {
            self.longest_repeats = self.longest_repeats.max(self.repeats);
            self.repeats = 0;
        }
        match self.left.checked_sub(1) {
            Some(left) => self.left = left,
            None => self.end_block(),
        }
        self.frozen()
    }

    /// Creates a detector without samples that keeps the part's noise as this one has seen it.
    #[must_use]
    pub fn restarted(&self) -> Self {
        let kept = |run: &Run| Run { now: 0, longest: run.longest };
        Self {
            axes: self.axes.each_ref().map(kept),
            sensors: self.sensors.each_ref().map(kept),
            changes: self.changes,
            samples: self.samples,
            longest_repeats: self.longest_repeats,
            ..Self::default()
        }
    }

    /// Number of consecutive repeats of the last sample, for a caller that must decide before
    /// [`REPEATS`](Self::REPEATS) of them.
    #[must_use]
    pub const fn repeats(&self) -> u16 {
        self.repeats
    }

    /// Returns whether the last sample has repeated at least `least` times, and more than twice as often as in any
    /// earlier run of repeats that ended.
    #[must_use]
    pub const fn has_repeated(&self, least: u16) -> bool {
        self.repeats >= least && self.repeats > self.longest_repeats.saturating_mul(2)
    }

    /// The frozen axes, as [`update`](Self::update) returns them.
    #[must_use]
    pub const fn frozen(&self) -> u8 {
        if self.has_repeated(Self::REPEATS) { Self::EVERY_AXIS } else { self.frozen }
    }

    /// Returns whether each axis has changed since the first sample.
    #[must_use]
    pub fn every_axis_has_changed(&self) -> bool {
        let mut axes = self.changed.iter().zip(self.changed_before);
        self.seen && axes.all(|(now, before)| *now || before)
    }

    /// Ends a block. Called once per block, and at the first sample, which has no predecessor.
    fn end_block(&mut self) {
        let changed = core::mem::take(&mut self.changed);
        self.left = Self::BLOCK - 1;
        if !self.seen {
            self.seen = true;
            self.repeats = 0;
            return;
        }
        for (before, now) in self.changed_before.iter_mut().zip(changed) {
            *before |= now;
        }
        for (run, changed) in self.axes.iter_mut().zip(changed) {
            run.update(changed);
        }
        let [ax, ay, az, wx, wy, wz] = changed;
        let [accel, gyro] = &mut self.sensors;
        accel.update(ax || ay || az);
        gyro.update(wx || wy || wz);
        let [axes @ .., wx, wy, wz] = self.axes;
        let frozen = stuck(*accel, axes, Self::ACCEL_AXIS_BLOCKS, Self::ACCEL_BLOCKS)
            | stuck(*gyro, [wx, wy, wz], Self::GYRO_AXIS_BLOCKS, Self::GYRO_BLOCKS) << 3;
        self.frozen = frozen & self.known();
    }

    /// Mask of the axes of which enough is known to judge them.
    fn known(&self) -> u8 {
        let is_known = |changes: u16| self.samples >= Self::PROVEN || 3 * changes >= self.samples;
        let axes = self.changes.iter().enumerate();
        axes.fold(0, |known, (axis, changes)| known | u8::from(is_known(*changes)) << axis)
    }
}

/// Returns the frozen axes of a sensor, given the run of all its axes together and the run of each axis.
fn stuck(together: Run, [x, y, z]: [Run; 3], one: u8, all: u8) -> u8 {
    if together.is_frozen(all) {
        return 0b111;
    }
    let [x, y, z] = [x, y, z].map(|axis| u8::from(axis.is_frozen(one)));
    x | y << 1 | z << 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::scale::FullScale;
    use std::vec::Vec;

    /// Creates a sample with these codes, ax ay az wx wy wz.
    fn sample(status: u8, codes: [i16; 6]) -> RawSample {
        let [ax, ay, az, wx, wy, wz] = codes;
        let mut bytes = [0; 16];
        bytes[0] = status;
        for (pair, code) in bytes[4..].chunks_exact_mut(2).zip([wx, wy, wz, ax, ay, az]) {
            pair.copy_from_slice(&code.to_le_bytes());
        }
        RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ).unwrap()
    }

    /// Codes at a time; the axes in `still` do not change.
    fn moving(time: usize, still: u8) -> RawSample {
        let codes = core::array::from_fn(|axis| {
            let moves = still & 1 << axis == 0;
            if moves { (time % 3) as i16 - 1 } else { 7 }
        });
        sample(3, codes)
    }

    #[test]
    fn eight_repeats_of_a_fresh_sample_are_a_frozen_part() {
        let mut detector = FrozenDetector::new();
        for repeat in 0..=FrozenDetector::REPEATS {
            let frozen = detector.update(&sample(3, [7; 6])) == FrozenDetector::EVERY_AXIS;
            assert_eq!(frozen, repeat == FrozenDetector::REPEATS);
        }
        assert_eq!(detector.update(&sample(3, [8; 6])), 0);
    }

    #[test]
    fn stale_samples_are_not_counted_as_repeats() {
        let mut detector = FrozenDetector::new();
        assert!((0..1000).all(|_| detector.update(&sample(0, [7; 6])) == 0));
        assert!((0..1000).all(|time| {
            let stale = detector.update(&sample(1, [7; 6]));
            stale | detector.update(&moving(time, 0)) == 0
        }));
    }

    #[test]
    fn frozen_axis_or_sensor_is_detected_within_its_bound() {
        for (still, most) in [
            (0b00_0001, 30),
            (0b00_0010, 30),
            (0b00_0100, 30),
            (0b00_0101, 30),
            (0b00_0111, 20),
            (0b00_1000, 90),
            (0b01_0000, 90),
            (0b10_0000, 90),
            (0b11_1000, 40),
            (0b10_0001, 90),
        ] {
            for phase in 0..10 {
                let mut detector = FrozenDetector::new();
                assert!((0..100 + phase).all(|time| detector.update(&moving(time, 0)) == 0));
                let mut named = Vec::new();
                for time in 0..=most {
                    named.push(detector.update(&moving(time, still)));
                }
                assert_eq!(named.last(), Some(&still), "{still:06b}, phase {phase}");
                assert!(named.iter().all(|named| named & !still == 0));
                // A single change clears the axis, at the end of its block.
                let sound = (0..10).map(|time| detector.update(&moving(time, 0))).last();
                assert_eq!(sound, Some(0));
            }
        }
    }

    #[test]
    fn every_axis_has_changed_once_the_last_of_them_has() {
        let mut detector = FrozenDetector::new();
        assert!(!detector.every_axis_has_changed());
        for time in 0..25 {
            detector.update(&moving(time, 0b10_0000));
            assert!(!detector.every_axis_has_changed());
        }
        detector.update(&moving(0, 0));
        assert!(detector.every_axis_has_changed());
    }

    /// Samples of a sensor at rest, its gyroscope with this noise in codes and its mean in the middle of a code. The
    /// accelerometer changes in each sample.
    fn quiet(sigma: f64, samples: usize) -> impl Iterator<Item = RawSample> {
        quiet_from(1, sigma, samples)
    }

    /// Samples as from `quiet`, with noise from this seed.
    fn quiet_from(seed: u64, sigma: f64, samples: usize) -> impl Iterator<Item = RawSample> {
        let mut state = seed;
        // The sum of twelve numbers is nearly normal.
        let mut normal = move || {
            let mut sum = -6.0;
            for _ in 0..12 {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                sum += (state >> 40) as f64 / (1_u64 << 24) as f64;
            }
            sum
        };
        (0..samples).map(move |time| {
            let [wx, wy, wz] = [(); 3].map(|()| (sigma * normal()).round() as i16);
            let moving = time as i16;
            sample(3, [moving, moving, moving, wx, wy, wz])
        })
    }

    /// Half an hour at 417 Hz.
    const HALF_AN_HOUR: usize = 30 * 60 * 417;

    #[test]
    fn quiet_gyroscope_is_no_frozen_one() {
        for sigma in [0.7, 0.5, 0.4, 0.3, 0.25] {
            let mut detector = FrozenDetector::new();
            let named = quiet(sigma, HALF_AN_HOUR).find_map(|sample| {
                let frozen = detector.update(&sample);
                (frozen != 0).then_some(frozen)
            });
            assert_eq!(named, None, "{sigma} codes of noise");
        }
    }

    #[test]
    fn quiet_gyroscope_is_no_frozen_one_for_an_hour() {
        const AN_HOUR: usize = 3_600_000;
        let mut detector = FrozenDetector::new();
        let named = quiet_from(2, 0.3, AN_HOUR).position(|sample| detector.update(&sample) != 0);
        assert_eq!(named, None);
    }

    #[test]
    fn quiet_gyroscope_is_no_frozen_one_at_any_start() {
        for start in 0..500 {
            let mut detector = FrozenDetector::new();
            let mut samples =
                quiet_from(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(start + 1), 0.3, 3_000);
            let named = samples.position(|sample| detector.update(&sample) != 0);
            assert_eq!(named, None, "start {start}");
        }
    }

    #[test]
    fn frozen_axis_of_a_quiet_gyroscope_is_still_detected() {
        for (sigma, most) in [(0.7, 150), (0.5, 300), (0.3, 1_500)] {
            let mut detector = FrozenDetector::new();
            for sample in quiet(sigma, HALF_AN_HOUR) {
                detector.update(&sample);
            }
            let detected = quiet(sigma, 3_000).position(|mut stuck| {
                stuck.angular_rate.codes[1] = 0;
                detector.update(&stuck) == 0b01_0000
            });
            assert!(detected.is_some_and(|after| after < most), "{sigma}: {detected:?}");
        }
    }

    #[test]
    fn repeats_that_ended_by_themselves_raise_the_limit() {
        let mut detector = FrozenDetector::new();
        for code in [1, 1, 1, 2, 2, 2, 2] {
            detector.update(&sample(3, [code; 6]));
        }
        // Two repeats ended, so that three are not enough.
        assert_eq!((detector.repeats(), detector.has_repeated(3)), (3, false));
        let mut restarted = detector.restarted();
        for _ in 0..6 {
            restarted.update(&sample(3, [7; 6]));
        }
        assert!(restarted.has_repeated(3));
    }

    /// Probability that a code repeats after many repeats, with its mean in the middle of a code: the
    /// largest eigenvalue of the transition from one sample to the next within the code, for a
    /// normal sequence of standard deviation `sigma` codes and this correlation between neighbours.
    fn chance_of_a_repeat(sigma: f64, correlation: f64) -> f64 {
        const POINTS: usize = 41;
        let width = 1.0 / POINTS as f64;
        let at = |i: usize| (i as f64 + 0.5) * width - 0.5;
        let deviation = sigma * (1.0 - correlation * correlation).sqrt();
        let density = |from: f64, to: f64| {
            let x = (to - correlation * from) / deviation;
            (-0.5 * x * x).exp() / (deviation * core::f64::consts::TAU.sqrt())
        };
        let mut vector = [1.0; POINTS];
        let mut eigenvalue = 0.0;
        for _ in 0..100 {
            let next: [f64; POINTS] = core::array::from_fn(|to| {
                let terms = vector.iter().enumerate();
                width * terms.map(|(from, v)| density(at(from), at(to)) * v).sum::<f64>()
            });
            eigenvalue = next.into_iter().fold(0.0, f64::max);
            vector = next.map(|v| v / eigenvalue);
        }
        eigenvalue
    }

    /// Upper bound of false alarms in a hundred years at this fraction of the preset's noise: accelerometer's
    /// axis and whole, gyroscope's axis and whole.
    fn false_alarms(part: f64) -> [f64; 4] {
        const BLOCKS: f64 = 100.0 * 365.25 * 86_400.0 * 1000.0 / FrozenDetector::BLOCK as f64;
        // The autocorrelation of white noise behind a second-order Butterworth low-pass of 335 Hz,
        // after 1 ms.
        let x = core::f64::consts::TAU * 0.335 / 2.0_f64.sqrt();
        let correlation = (-x).exp() * (x.cos() + x.sin());
        let config = Config::FRESH_KILOHERTZ;
        let (noise, params) = (config.noise(), config.params());
        let chance = |noise: Option<f32>, sensitivity: f32| {
            let sigma = part * f64::from(noise.unwrap() / sensitivity);
            chance_of_a_repeat(sigma, correlation)
        };
        let accel = chance(noise.specific_force, params.accel.full_scale.sensitivity());
        let gyro = chance(noise.angular_rate, params.gyro.full_scale.sensitivity());
        let one = |chance: f64, blocks: u8| {
            3.0 * BLOCKS * chance.powi(i32::from(blocks * FrozenDetector::BLOCK))
        };
        let all = |chance: f64, blocks: u8| {
            BLOCKS * chance.powi(3 * i32::from(blocks * FrozenDetector::BLOCK))
        };
        [
            one(accel, FrozenDetector::ACCEL_AXIS_BLOCKS),
            all(accel, FrozenDetector::ACCEL_BLOCKS),
            one(gyro, FrozenDetector::GYRO_AXIS_BLOCKS),
            all(gyro, FrozenDetector::GYRO_BLOCKS),
        ]
    }

    #[test]
    fn noise_of_a_preset_has_its_margin_above_the_limit() {
        for (config, margin) in
            [(Config::FRESH_KILOHERTZ, 0.50..0.55), (Config::FRESH_417_HERTZ, 0.29..0.34)]
        {
            let sensitivity = config.params().gyro.full_scale.sensitivity();
            let codes = config.noise().angular_rate.unwrap() / sensitivity;
            let left = 1.0 - 0.49 / codes;
            assert!(margin.contains(&left), "{codes} codes, {left}");
        }
    }

    #[test]
    fn false_alarms_stay_below_their_bounds_at_half_of_the_noise() {
        for (part, most) in [
            (1.0, [1.0e-7, 1.0e-17, 1.0e-19, 1.0e-23]),
            (0.5, [0.02, 1.0e-8, 0.3, 0.003]),
            (0.49, [0.03, 1.0e-8, 1.0, 0.01]),
        ] {
            let alarms = false_alarms(part);
            std::println!("at {part} of the noise: {alarms:?}");
            for (alarms, most) in alarms.into_iter().zip(most) {
                assert!(alarms <= most, "at {part} of the noise: {alarms:e}");
            }
        }
        // Less noise than that causes false alarms.
        assert!(false_alarms(0.45).into_iter().any(|alarms| alarms > 1.0));
    }
}

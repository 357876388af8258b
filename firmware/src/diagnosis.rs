//! Measurements for the diagnosis of a board: noise and mean of the sensor's codes at rest, and the rate of its edges.

use lsm6dsox::RawSample;
use wire::Diagnosis;

use crate::sampling::{Measurement, Tick};

/// Ticks of an interval.
const INTERVAL: u16 = 1_000;

/// Largest difference of two successive codes that counts. A larger difference is motion, and its interval then counts as motion.
const LARGEST: i32 = 255;

/// Noise and mean of the codes of successive samples.
#[derive(Clone, Debug, Default)]
pub struct CodeMeter {
    has_last: bool,
    /// Samples with a predecessor.
    samples: u16,
    axes: [Axis; 6],
}

#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    last: i16,
    /// Sum of the squared differences of successive codes. A slow motion adds little to it.
    squares: u32,
    sum: i32,
}

impl CodeMeter {
    /// Number of samples for which the sums have room.
    const MOST: u16 = 60_000;

    /// Takes a sample. The first one is not counted, because it has no predecessor. Samples after 60 000 are ignored.
    pub fn take(&mut self, raw: &RawSample) {
        let ([ax, ay, az], [wx, wy, wz]) = (raw.specific_force.codes, raw.angular_rate.codes);
        let counts = core::mem::replace(&mut self.has_last, true) && self.samples < Self::MOST;
        self.samples += u16::from(counts);
        for (axis, code) in self.axes.iter_mut().zip([ax, ay, az, wx, wy, wz]) {
            let code = i32::from(code);
            let last = i32::from(core::mem::replace(&mut axis.last, code as i16));
            let difference = (code - last).clamp(-LARGEST, LARGEST);
            if counts {
                axis.squares += (difference * difference) as u32;
                axis.sum += code;
            }
        }
    }

    /// Forgets the last sample, because the next one does not follow it.
    pub const fn skip(&mut self) {
        self.has_last = false;
    }

    /// Sum of the squared differences of all axes: the measure of quietness.
    fn unrest(&self) -> u32 {
        self.axes.iter().fold(0, |sum, axis| sum.saturating_add(axis.squares))
    }

    /// Writes noise and mean, or leaves them unchanged if there were no two successive samples.
    pub fn write(&self, diagnosis: &mut Diagnosis) {
        let samples = i32::from(self.samples);
        let axes = diagnosis.noise.iter_mut().zip(&mut diagnosis.mean);
        for ((noise, mean), axis) in axes.zip(&self.axes) {
            // The variance of a difference is twice that of a sample.
            let noise_now = (1_000 * u64::from(axis.squares)).checked_div(u64::from(self.samples));
            let rounded = axis.sum + axis.sum.signum() * samples / 2;
            if let (Some(noise_now), Some(mean_now)) = (noise_now, rounded.checked_div(samples)) {
                *noise = noise_now as u32;
                *mean = mean_now as i16;
            }
        }
    }

    /// Starts again behind the last sample.
    fn restart(&mut self) {
        self.samples = 0;
        for axis in &mut self.axes {
            (axis.squares, axis.sum) = (0, 0);
        }
    }
}

/// Measures in intervals of [`INTERVAL`] ticks.
#[derive(Clone, Debug, Default)]
pub(crate) struct DiagnosisMeter {
    ticks: u16,
    edges: u16,
    codes: CodeMeter,
    /// [`CodeMeter::unrest`] of the quietest whole interval so far.
    least: Option<u32>,
}

impl DiagnosisMeter {
    /// Takes a tick. Updates `diagnosis` at the end of an interval.
    #[inline(never)]
    pub(crate) fn take(
        &mut self,
        tick: &Tick,
        measurement: &Measurement,
        diagnosis: &mut Diagnosis,
    ) {
        self.edges = self.edges.saturating_add(tick.edges.unwrap_or(0));
        match &measurement.raw {
            Some(raw) if raw.is_fresh() => self.codes.take(raw),
            _ => self.codes.skip(),
        }
        self.ticks += 1;
        if self.ticks < INTERVAL {
            return;
        }
        diagnosis.edges = core::mem::take(&mut self.edges);
        self.ticks = 0;
        // Each sample of a whole interval has a predecessor, except the very first sample.
        let is_whole = self.codes.samples + 1 >= INTERVAL;
        let unrest = self.codes.unrest();
        if is_whole && self.least.is_none_or(|least| unrest < least) {
            self.least = Some(unrest);
            self.codes.write(diagnosis);
        }
        self.codes.restart();
    }
}

#[cfg(test)]
mod tests {
    use estimator_core::{ImuSample, Timestamp};
    use lsm6dsox::Config;

    use super::*;
    use crate::sampling::{Activity, BusHealth, ReadAt};

    /// Runs ticks whose gyroscope alternates by `swing` codes about 10 on its last axis.
    fn measure(meter: &mut DiagnosisMeter, diagnosis: &mut Diagnosis, ticks: u16, swing: i16) {
        for number in 0..ticks {
            let mut bytes = [0; 16];
            bytes[0] = 3;
            let code = if number % 2 == 0 { 10 } else { 10 + swing };
            bytes[8..10].copy_from_slice(&code.to_le_bytes());
            let raw = RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ).expect("a status");
            let measurement = Measurement {
                sample: ImuSample::default(),
                raw: Some(raw),
                activity: Activity::Measuring,
                fault: None,
                saturated_for_long: false,
                read_at: ReadAt::Edge,
                restarts: 0,
                misreads: 0,
                bus: BusHealth::default(),
            };
            let tick = Tick { time: Timestamp::from_micros(0), edges: Some(7), ..Tick::default() };
            meter.take(&tick, &measurement, diagnosis);
        }
    }

    #[test]
    fn noise_and_mean_are_those_of_the_quietest_interval() {
        let (mut meter, mut diagnosis) = (DiagnosisMeter::default(), Diagnosis::default());
        measure(&mut meter, &mut diagnosis, 999, 2);
        assert_eq!((diagnosis.edges, diagnosis.noise), (0, [0; 6]));
        measure(&mut meter, &mut diagnosis, 1, 2);
        // 998 of the 999 differences are 2 codes, so the noise is 1000 · 998 · 4 / 999, rounded down.
        assert_eq!((diagnosis.edges, diagnosis.noise), (7_000, [0, 0, 0, 0, 0, 3_995]));
        assert_eq!(diagnosis.mean, [0, 0, 0, 0, 0, 11]);
        measure(&mut meter, &mut diagnosis, 1_000, 40);
        assert_eq!(diagnosis.noise[5], 3_995, "motion is not noise");
        // The first of two intervals begins with the end of the motion.
        measure(&mut meter, &mut diagnosis, 2_000, 1);
        assert_eq!((diagnosis.noise[5], diagnosis.mean[5]), (1_000, 11));
    }

    #[test]
    fn samples_that_are_missing_add_no_noise() {
        let mut meter = CodeMeter::default();
        let mut diagnosis = Diagnosis::default();
        meter.write(&mut diagnosis);
        assert_eq!(diagnosis, Diagnosis::default(), "nothing was measured");
        for (code, follows) in [(100_i16, true), (100, true), (-100, false), (-100, true)] {
            let mut bytes = [0; 16];
            bytes[10..12].copy_from_slice(&code.to_le_bytes());
            let raw = RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ).expect("a status");
            if !follows {
                meter.skip();
            }
            meter.take(&raw);
        }
        meter.write(&mut diagnosis);
        assert_eq!((diagnosis.noise, meter.samples), ([0; 6], 2));
    }
}

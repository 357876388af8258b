//! Conversion of a recording to another sample rate.
//!
//! | to | values | label, load |
//! |---|---|---|
//! | a higher rate | linear interpolation between the samples on both sides | of the sample before |
//! | a lower rate | weighted mean, Hann window two new periods long | of the sample before |
//!
//! The window attenuates by 6 dB at half the new rate and has a zero at the new rate. It has no negative
//! weights, so a landing does not ring in the samples before it. Times may be uneven. A gap is bridged like
//! any other step.

use std::f64::consts::PI;

use estimator_core::{AngularRate, ImuSample, SpecificForce, Timestamp, Validity, Vec3};
use samples::{RecordedSample, Recording};

/// Relative difference below which rates are treated as equal.
const SAME_RATE: f64 = 0.01;

/// Converts a recording to `sample_rate`, Hz, from its first sample to its last; it is unchanged if its rate
/// is the same within 1 %.
#[must_use]
pub fn resample(recording: &Recording, sample_rate: f32) -> Recording {
    let (old, new) = (f64::from(recording.sample_rate), f64::from(sample_rate));
    let (Some(first), Some(last)) = (recording.samples.first(), recording.samples.last()) else {
        return recording.clone();
    };
    if (new / old - 1.0).abs() < SAME_RATE {
        return recording.clone();
    }
    let (first, last) = (micros(first), micros(last));
    let period = 1.0e6 / new;
    let count = ((last - first) / period) as usize + 1;
    // Index of the newest sample that is not later than the new one.
    let mut before = 0;
    let samples = (0..count).map(|k| {
        let time = (first + k as f64 * period).round();
        while (recording.samples.get(before + 1)).is_some_and(|next| micros(next) <= time) {
            before += 1;
        }
        if new > old {
            interpolated(&recording.samples, before, time)
        } else {
            smoothed(&recording.samples, before, time, period)
        }
    });
    Recording { samples: samples.collect(), sample_rate, ..recording.clone() }
}

fn micros(sample: &RecordedSample) -> f64 {
    sample.imu.timestamp.as_micros() as f64
}

/// Interpolates between the sample at `before` and the next.
fn interpolated(samples: &[RecordedSample], before: usize, time: f64) -> RecordedSample {
    let from = &samples[before];
    let Some(to) = samples.get(before + 1) else {
        return weighted(from, time, [(from, 1.0)].into_iter());
    };
    let share = ((time - micros(from)) / (micros(to) - micros(from))).clamp(0.0, 1.0);
    weighted(from, time, [(from, 1.0 - share), (to, share)].into_iter())
}

/// Weighted mean of the samples within a period, with the largest weight for the nearest.
fn smoothed(samples: &[RecordedSample], before: usize, time: f64, period: f64) -> RecordedSample {
    let weight = |sample: &RecordedSample| {
        let away = (micros(sample) - time).abs() / period;
        0.5 + 0.5 * libm::cos(PI * away)
    };
    let is_near = |sample: &&RecordedSample| (micros(sample) - time).abs() < period;
    let (past, future) = samples.split_at(before + 1);
    let past = past.iter().rev().take_while(is_near);
    let near: Vec<_> = past.chain(future.iter().take_while(is_near)).collect();
    if near.is_empty() {
        return interpolated(samples, before, time);
    }
    let weights = near.into_iter().map(|sample| (sample, weight(sample)));
    weighted(&samples[before], time, weights)
}

/// Weighted mean of samples, with the label and the load of the previous sample. An invalid sample makes the mean
/// invalid.
fn weighted<'a>(
    before: &RecordedSample,
    time: f64,
    samples: impl Iterator<Item = (&'a RecordedSample, f64)>,
) -> RecordedSample {
    let (mut sums, mut weights, mut validity) = ([0.0; 6], 0.0, Validity::Valid);
    for (RecordedSample { imu, .. }, weight) in samples.filter(|(_, weight)| *weight > 0.0) {
        let (a, w) = (imu.specific_force.0, imu.angular_rate.0);
        for (sum, value) in sums.iter_mut().zip([a.x, a.y, a.z, w.x, w.y, w.z]) {
            *sum += weight * f64::from(value);
        }
        weights += weight;
        if imu.validity != Validity::Valid {
            validity = imu.validity;
        }
    }
    let [ax, ay, az, wx, wy, wz] = sums.map(|sum| (sum / weights) as f32);
    RecordedSample {
        imu: ImuSample {
            timestamp: Timestamp::from_micros(time as u64),
            specific_force: SpecificForce(Vec3::new(ax, ay, az)),
            angular_rate: AngularRate(Vec3::new(wx, wy, wz)),
            validity,
        },
        ..*before
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Gravity;
    use samples::Label;

    /// Two seconds at 1 kHz; the second half is stable.
    fn recording(ax: impl Fn(f64) -> f64) -> Recording {
        let row = |k: u32| RecordedSample {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(1000 * u64::from(k)),
                specific_force: SpecificForce(Vec3::new(
                    ax(f64::from(k) / 1000.0) as f32,
                    0.0,
                    0.0,
                )),
                angular_rate: AngularRate(Vec3::new(0.0, 0.0, 1.0)),
                ..ImuSample::default()
            },
            load: None,
            label: Some(if k < 1000 { Label::NotStable } else { Label::Stable }),
        };
        Recording {
            name: "made up".to_owned(),
            sample_rate: 1000.0,
            gravity: Gravity::Removed,
            load_title: String::new(),
            samples: (0..2000).map(row).collect(),
        }
    }

    /// Largest force away from both ends, where a window has only one half.
    fn largest_force(recording: &Recording) -> f32 {
        let inner = &recording.samples[1..recording.samples.len() - 1];
        let forces = inner.iter().map(|s| s.imu.specific_force.0.x.abs());
        forces.fold(0.0, f32::max)
    }

    #[test]
    fn resample_keeps_bits_at_its_own_rate() {
        let recording = recording(|t| (40.0 * t).sin());
        assert_eq!(resample(&recording, 1000.0), recording);
    }

    #[test]
    fn interpolation_lies_on_the_line() {
        let fine = resample(&recording(|t| 3.0 * t), 1660.0);
        assert_eq!(fine.samples.len(), 3319);
        for sample in &fine.samples {
            let expected = 3.0 * sample.time_s() as f32;
            assert!((sample.imu.specific_force.0.x - expected).abs() < 1e-5);
            assert_eq!(sample.imu.angular_rate.0.z, 1.0);
        }
    }

    #[test]
    fn label_is_taken_from_the_sample_before() {
        for rate in [100.0, 390.0, 1660.0] {
            for sample in resample(&recording(|_| 0.0), rate).samples {
                let stable = sample.imu.timestamp.as_micros() >= 1_000_000;
                assert_eq!(sample.label == Some(Label::Stable), stable, "{rate} Hz");
            }
        }
    }

    #[test]
    fn decimation_keeps_slow_motion_and_removes_aliases() {
        let wave = |frequency: f64| recording(move |t| (2.0 * PI * frequency * t).sin());
        let at_100 = |frequency| largest_force(&resample(&wave(frequency), 100.0));
        assert!(at_100(5.0) > 0.99, "{}", at_100(5.0));
        // 210 Hz would alias to 10 Hz.
        assert!(at_100(210.0) < 0.03, "{}", at_100(210.0));
        assert!(largest_force(&wave(210.0)) > 0.99);
    }

    #[test]
    fn doubtful_sample_makes_its_neighbours_doubtful() {
        let mut recording = recording(|_| 0.0);
        recording.samples[500].imu.validity = Validity::Stale;
        let coarse = resample(&recording, 100.0);
        let doubtful = |s: &&RecordedSample| s.imu.validity == Validity::Stale;
        assert_eq!(coarse.samples.iter().filter(doubtful).count(), 1);
    }
}

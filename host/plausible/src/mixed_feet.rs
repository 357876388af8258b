//! Readings of several feet that alternate in one recording.
//!
//! The readings of `n` feet are cut into `n` series, each with every `n`-th reading. If a window of readings is of one foot,
//! all series move alike. If it is of several feet, then one stands while another swings.

use samples::RecordedSample;
use samples::space::components;

use crate::finding::Finding;

/// Numbers of feet that are looked for.
const FEET: [usize; 3] = [2, 3, 4];

/// Number of readings of each foot in a window. In each half of the window one foot stands and the other swings.
const OF_EACH: usize = 16;

/// Deviation of the readings of a foot that swings, in units of 9.81 m/s² and of 1 rad/s, and the multiple by which it
/// exceeds the deviation of a foot that stands.
const SWINGS: f32 = 0.2;
const RATIO: f32 = 6.0;

/// Share of the windows beyond which feet are mixed. No recording of one foot reaches it, and nearly every recording in
/// which two feet alternate exceeds it (`host-tests/tests/findings.rs`).
const LEAST_SHARE: f64 = 0.03;

/// Smallest number of such windows.
const LEAST_WINDOWS: u32 = 5;

/// Compares the series of readings for each number of feet.
pub(crate) struct MixedFeetCheck {
    windows: [Window; FEET.len()],
}

/// Readings for one number of feet.
#[derive(Clone, Copy, Default)]
struct Window {
    place: usize,
    /// Series of the first half and of the second.
    halves: [[Series; 4]; 2],
    mixed: u32,
    of: u32,
}

/// Sums and sums of squares of every `n`-th reading.
#[derive(Clone, Copy, Default)]
struct Series {
    sums: [f32; 6],
    squares: [f32; 6],
}

impl Default for MixedFeetCheck {
    fn default() -> Self {
        Self { windows: [Window::default(); FEET.len()] }
    }
}

impl MixedFeetCheck {
    pub(crate) fn add(&mut self, sample: &RecordedSample) {
        let force = components(sample.imu.specific_force.0).map(|value| value / 9.81);
        let rate = components(sample.imu.angular_rate.0);
        let [ax, ay, az] = force;
        let [wx, wy, wz] = rate;
        let reading = [ax, ay, az, wx, wy, wz];
        for (window, feet) in self.windows.iter_mut().zip(FEET) {
            window.add(reading, feet);
        }
    }

    /// Finding about the number of feet.
    pub(crate) fn finding(&self) -> Option<Finding> {
        let share = |window: &Window| f64::from(window.mixed) / f64::from(window.of.max(1));
        let are_mixed =
            |window: &Window| window.mixed >= LEAST_WINDOWS && share(window) >= LEAST_SHARE;
        // Windows for a wrong number of feet may look mixed, too, but fewer of them, so the largest share wins.
        let counted = self.windows.iter().zip(FEET).filter(|(window, _)| are_mixed(window));
        let (_, feet) =
            counted.max_by(|(one, _), (other, _)| share(one).total_cmp(&share(other)))?;
        Some(Finding::MixedFeet { feet })
    }
}

impl Window {
    fn add(&mut self, reading: [f32; 6], feet: usize) {
        let half = 2 * self.place / (feet * OF_EACH);
        self.halves[half][self.place % feet].add(reading);
        self.place += 1;
        if self.place < feet * OF_EACH {
            return;
        }
        // Both halves must look mixed, because a single foot that starts or stops swinging moves in only one half.
        let stand_and_swing = |series: &[Series; 4]| {
            let deviations = series[..feet].iter().map(Series::deviation);
            let (least, most) = deviations
                .fold((f32::MAX, 0.0_f32), |(least, most), next| (least.min(next), most.max(next)));
            most > SWINGS && least < most / RATIO
        };
        let is_mixed = self.halves.iter().all(stand_and_swing);
        let mixed = self.mixed + u32::from(is_mixed);
        *self = Self { mixed, of: self.of + 1, ..Self::default() };
    }
}

impl Series {
    fn add(&mut self, reading: [f32; 6]) {
        for ((sum, squares), value) in self.sums.iter_mut().zip(&mut self.squares).zip(reading) {
            *sum += value;
            *squares += value * value;
        }
    }

    /// Standard deviation of the readings in half a window.
    fn deviation(&self) -> f32 {
        let count = (OF_EACH / 2) as f32;
        let variances = self.sums.iter().zip(self.squares).map(|(sum, squares)| {
            let mean = sum / count;
            (squares / count - mean * mean).max(0.0)
        });
        libm::sqrtf(variances.sum())
    }
}

#[cfg(test)]
mod tests {
    use estimator_core::Timestamp;
    use samples::Recording;

    use crate::check;
    use crate::finding::Finding;
    use crate::fixtures::{found, walk};

    /// The walks of several feet, each later than the previous one, with alternating samples.
    fn mixed(feet: usize) -> Recording {
        let foot = walk();
        let count = foot.samples.len() / 2;
        let samples = (0..feet * count).map(|k| {
            let mut sample = foot.samples[k / feet + k % feet * 200 / feet];
            sample.imu.timestamp = Timestamp::from_micros(5_000 * k as u64 / feet as u64);
            sample
        });
        Recording { sample_rate: 200.0 * feet as f32, samples: samples.collect(), ..foot }
    }

    #[test]
    fn alternating_samples_of_several_feet_are_found() {
        assert_eq!(found(&mixed(1)), [""; 0]);
        for feet in [2, 3, 4] {
            let findings = check(&mixed(feet));
            let is_mixed = |finding: &Finding| *finding == Finding::MixedFeet { feet };
            assert!(findings.iter().any(is_mixed), "{feet}: {findings:?}");
        }
    }
}

//! Rest of the foot, from its motions.

use std::collections::VecDeque;

use recordings::samples::space::Vector;

use super::moments::Motion;

/// Time without motion that counts as rest, µs.
const REST_US: u64 = 500_000;

/// Fewest motions in that time: frames of a bus come each 20 ms.
const FEWEST: usize = 15;

/// Standard deviation of a foot at rest, m/s² and rad/s: five times the noise of the sensor.
const FORCE: f64 = 0.15;
const RATE: f64 = 0.02;

/// Mean and standard deviation of motions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Statistics {
    pub(super) force: Vector,
    pub(super) rate: Vector,
    /// Largest standard deviation of an axis, m/s² and rad/s.
    pub(super) force_noise: f64,
    pub(super) rate_noise: f64,
}

impl Statistics {
    pub(super) fn of<'a>(motions: impl ExactSizeIterator<Item = &'a Motion> + Clone) -> Self {
        let (force, force_noise) = moments(motions.clone().map(|motion| motion.force));
        let (rate, rate_noise) = moments(motions.map(|motion| motion.rate));
        Self { force, rate, force_noise, rate_noise }
    }

    fn is_rest(&self) -> bool {
        self.force_noise < FORCE && self.rate_noise < RATE
    }
}

/// Mean, and largest standard deviation of an axis.
fn moments(values: impl ExactSizeIterator<Item = Vector> + Clone) -> (Vector, f64) {
    let per_value = 1.0 / values.len().max(1) as f64;
    let sum = values.clone();
    let mean = sum.fold(Vector::default(), |sum, value| sum + value) * per_value;
    let mut squares = [0.0; 3];
    for value in values {
        let differences = (value + mean * -1.0).to_array();
        for (sum, difference) in squares.iter_mut().zip(differences) {
            *sum += difference * difference;
        }
    }
    let largest = squares.into_iter().fold(0.0, f64::max);
    (mean, (largest * per_value).sqrt())
}

/// Detector of rest.
#[derive(Default)]
pub(super) struct Stillness {
    motions: VecDeque<Motion>,
}

impl Stillness {
    /// Takes a motion; returns the statistics of the newest half a second where the foot was at rest in it.
    pub(super) fn take(&mut self, motion: Motion) -> Option<Statistics> {
        let newest_us = motion.at.as_micros();
        self.motions.push_back(motion);
        let mut span_us = 0;
        while let Some(first) = self.motions.front() {
            span_us = newest_us.saturating_sub(first.at.as_micros());
            // After a restart, times of the foot begin again.
            if span_us <= REST_US && first.at <= motion.at {
                break;
            }
            self.motions.pop_front();
        }
        if self.motions.len() < FEWEST || span_us < REST_US * 9 / 10 {
            return None;
        }
        let statistics = Statistics::of(self.motions.iter());
        statistics.is_rest().then_some(statistics)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Timestamp;

    fn at(ms: u64, force: f64) -> Motion {
        Motion {
            at: Timestamp::from_micros(1000 * ms),
            force: Vector::new(0.0, 0.0, force),
            ..Motion::default()
        }
    }

    #[test]
    fn rest_is_found_half_a_second_after_the_last_motion() {
        let mut stillness = Stillness::default();
        let found = (0..2000).step_by(20).find(|ms| {
            let force = if *ms < 1000 { 9.0 + (ms % 40) as f64 } else { 9.8 };
            stillness.take(at(*ms, force)).is_some()
        });
        assert!(found.is_some_and(|ms| (1440..=1500).contains(&ms)), "{found:?}");
    }

    #[test]
    fn restart_of_the_clock_begins_a_new_rest() {
        let mut stillness = Stillness::default();
        let at_rest = |stillness: &mut Stillness, from: u64| {
            (from..from + 1000).step_by(20).find(|ms| stillness.take(at(*ms, 9.8)).is_some())
        };
        assert_eq!(at_rest(&mut stillness, 50_000), Some(50_460));
        assert_eq!(at_rest(&mut stillness, 0), Some(460));
    }
}

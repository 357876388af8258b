//! Quietness of the foot, which sets the weight of an accelerometer sample in the estimate of up.

use super::inclination::Correction;
use crate::order::Order;
use crate::units::{DEGREE, STANDARD_GRAVITY};
use crate::vector::Vec3;

/// Time constant of the short mean that deviations are measured from, s. Shorter than a stance;
/// from 0.1 s on, clipping of the gyroscope in the swing is not corrected in the stance.
const MEAN_TIME_CONSTANT: f32 = 0.04;

/// Time constant of the decay after an impact, s.
const RELEASE_TIME_CONSTANT: f32 = 0.025;

/// Largest deviation that a sample counts for, m/s²: an impact of 16 g decays as
/// fast as one of half a g.
const LARGEST_DEVIATION: f32 = 0.5 * STANDARD_GRAVITY;

/// Largest angular rate that a sample counts for, rad/s.
const LARGEST_RATE: f32 = 100.0 * DEGREE;

#[derive(Clone, Copy, Debug)]
pub(super) struct QuietnessCoefficients {
    least_noise: f32,
    inverse_acceleration: f32,
    inverse_rate: f32,
}

impl QuietnessCoefficients {
    pub(super) fn new(quiet_gain: f32, quiet_acceleration: f32, quiet_rate: f32) -> Self {
        Self {
            least_noise: 1.0 / quiet_gain,
            inverse_acceleration: 1.0 / quiet_acceleration,
            inverse_rate: 1.0 / quiet_rate,
        }
    }
}

/// Follows the deviation of acceleration and angular rate from rest.
#[derive(Clone, Debug)]
pub(super) struct Quietness {
    coefficients: QuietnessCoefficients,
    /// Short mean of the specific force, world frame, m/s².
    mean: Vec3,
    /// Envelope of the deviation, m/s².
    deviation: f32,
    /// Envelope of the angular rate, rad/s.
    rate: f32,
}

impl Quietness {
    /// A foot that is quiet until it shows that it is not.
    pub(super) const fn new(coefficients: QuietnessCoefficients) -> Self {
        Self { coefficients, mean: Vec3::ZERO, deviation: 0.0, rate: 0.0 }
    }

    pub(super) const fn start(&mut self, force_magnitude: f32) {
        self.mean = Vec3::new(0.0, 0.0, force_magnitude);
    }

    /// After an unknown turn: quiet has to be observed again, as after an impact.
    pub(super) const fn forget(&mut self) {
        self.deviation = LARGEST_DEVIATION;
        self.rate = LARGEST_RATE;
    }

    /// Processes a sample and returns its noise relative to one in motion: 1 for all samples in
    /// motion, down to 1/`quiet_gain` in perfect quiet.
    pub(super) fn update(&mut self, force_world: Vec3, rate_magnitude: f32, dt: f32) -> f32 {
        let difference = force_world - self.mean;
        let distance = difference.length();
        let mut mean_gain = dt / (MEAN_TIME_CONSTANT + dt);
        if distance > LARGEST_DEVIATION {
            // An impact moves the mean by a bounded amount.
            mean_gain *= LARGEST_DEVIATION / distance;
        }
        self.mean += difference * mean_gain;

        // An impact counts at once, and decays.
        let release = dt / (RELEASE_TIME_CONSTANT + dt);
        let follow =
            |envelope: f32, newest: f32| newest.greater(envelope + release * (newest - envelope));
        self.deviation = follow(self.deviation, distance.lesser(LARGEST_DEVIATION));
        self.rate = follow(self.rate, rate_magnitude.lesser(LARGEST_RATE));

        let deviation = self.deviation * self.coefficients.inverse_acceleration;
        let rate = self.rate * self.coefficients.inverse_rate;
        let unrest = deviation * deviation + rate * rate;
        ((1.0 + unrest * unrest) * self.coefficients.least_noise).lesser(1.0)
    }

    /// Applies a correction of the world frame.
    pub(super) fn turn_frame(&mut self, correction: Correction) {
        self.mean = correction.turn(self.mean);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quietness() -> Quietness {
        let mut quietness = Quietness::new(QuietnessCoefficients::new(200.0, 0.25, 3.0 * DEGREE));
        quietness.start(STANDARD_GRAVITY);
        quietness
    }

    fn settle(quietness: &mut Quietness, seconds: f32) -> f32 {
        let up = Vec3::new(0.0, 0.0, STANDARD_GRAVITY);
        let steps = (seconds * 1000.0) as u32;
        (0..steps).fold(1.0, |_, _| quietness.update(up, 0.0, 0.001))
    }

    #[test]
    fn perfect_quiet_reaches_the_least_noise_within_a_stance() {
        let noise = settle(&mut quietness(), 0.25);
        assert!((noise * 200.0 - 1.0).abs() < 0.02, "{noise}");
    }

    #[test]
    fn first_sample_of_an_impact_has_little_weight() {
        let mut quietness = quietness();
        settle(&mut quietness, 1.0);
        let impact = Vec3::new(60.0, 0.0, 30.0);
        assert_eq!(quietness.update(impact, 0.0, 0.001), 1.0);
    }

    #[test]
    fn smoothly_turning_foot_is_not_quiet() {
        let mut quietness = quietness();
        settle(&mut quietness, 1.0);
        let up = Vec3::new(0.0, 0.0, STANDARD_GRAVITY);
        let noise = (0..200).fold(0.0, |_, _| quietness.update(up, 0.5, 0.001));
        assert_eq!(noise, 1.0);
    }

    #[test]
    fn impact_moves_the_mean_by_a_bounded_amount() {
        let mean_after = |force: f32| {
            let mut quietness = quietness();
            let force = Vec3::new(force, 0.0, STANDARD_GRAVITY);
            quietness.update(force, 0.0, 0.001);
            quietness.mean.x
        };
        let limit = mean_after(LARGEST_DEVIATION);
        assert!((limit - LARGEST_DEVIATION / 41.0).abs() < 1e-5, "{limit}");
        for force in [2.0 * LARGEST_DEVIATION, 156.0] {
            assert!((mean_after(force) - limit).abs() < 1e-5, "{force}");
        }
    }
}

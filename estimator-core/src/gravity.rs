//! Check whether gravity has really been removed from samples.

use crate::sample::{ImuSample, Validity};
use crate::stream::{Gravity, Stream, period_s};
use crate::units::STANDARD_GRAVITY;
use crate::vector::Vec3;

/// Time constant of the mean force, s. The acceleration of a foot averages out over a step.
const TIME_CONSTANT_S: f32 = 1.0;

/// Mean force that still contains gravity, m/s². To have it without gravity, a foot would have to become 5 m/s faster in
/// a second. With gravity, the mean of a foot that turns to and fro is larger, even if it turns by 60°.
const LEAST_MEAN: f32 = 0.5 * STANDARD_GRAVITY;

/// Search for gravity in the samples of a stream with [`Gravity::Removed`].
///
/// If they contain gravity after all, a [`ContactEstimator`](crate::ContactEstimator) takes 9.81 m/s² for motion. Its
/// foot is then never stable, and no flag gives the reason. So pass the same samples to this check.
///
/// ```
/// use estimator_core::gravity::GravityCheck;
/// use estimator_core::{Gravity, ImuSample, SpecificForce, Stream, Vec3};
///
/// let mut check = GravityCheck::new(Stream::new(1000.0, Gravity::Removed)?);
/// let specific_force = SpecificForce(Vec3::new(0.0, 0.0, 9.81));
/// for _ in 0..1000 {
///     check.push(&ImuSample { specific_force, ..ImuSample::default() });
/// }
/// assert!(check.is_gravity_left());
/// # Ok::<(), estimator_core::ParamsError>(())
/// ```
#[derive(Clone, Debug)]
pub struct GravityCheck {
    gravity: Gravity,
    /// Share of the newest sample in the mean.
    share: f32,
    /// Mean force, m/s², from 0.
    mean: Vec3,
}

impl GravityCheck {
    /// Check of the samples of a stream, before the first one.
    #[must_use]
    pub fn new(stream: Stream) -> Self {
        Self {
            gravity: stream.gravity(),
            share: period_s(stream.period_us()) / TIME_CONSTANT_S,
            mean: Vec3::new(0.0, 0.0, 0.0),
        }
    }

    /// Adds the next sample. A sample that is not valid does not count.
    pub fn push(&mut self, sample: &ImuSample) {
        if self.gravity == Gravity::Removed && sample.checked_validity() == Validity::Valid {
            self.mean = self.mean + (sample.specific_force.0 - self.mean) * self.share;
        }
    }

    /// Returns whether the samples contain gravity although the stream says that it was removed: their mean over the
    /// last second is more than half of it. Always false with [`Gravity::Included`].
    #[must_use]
    pub fn is_gravity_left(&self) -> bool {
        self.mean.dot(self.mean) > LEAST_MEAN * LEAST_MEAN
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::SpecificForce;

    /// Returns the first sample of 4 s at 200 Hz after which gravity is found.
    fn first_found(gravity: Gravity, force: impl Fn(f32) -> Vec3) -> Option<usize> {
        let stream = Stream::new(200.0, gravity).expect("a rate");
        let mut check = GravityCheck::new(stream);
        (0..800).position(|sample| {
            let specific_force = SpecificForce(force(sample as f32 / 200.0));
            check.push(&ImuSample { specific_force, ..ImuSample::default() });
            check.is_gravity_left()
        })
    }

    /// Force of a foot that pitches by up to 45° twice a second, m/s², with or without gravity.
    fn walking(seconds: f32, gravity: f32) -> Vec3 {
        let phase = 4.0 * (seconds * 2.0 % 1.0);
        let wave = if phase < 2.0 { phase - 1.0 } else { 3.0 - phase };
        Vec3::new(gravity * 0.7 * wave + 30.0 * wave, 0.0, gravity * (1.0 - 0.3 * wave * wave))
    }

    #[test]
    fn gravity_is_found_within_a_second_whatever_its_axis() {
        for axis in 0..3 {
            let force = |_| {
                let along = |other| if other == axis { -STANDARD_GRAVITY } else { 0.0 };
                Vec3::new(along(0), along(1), along(2))
            };
            let found = first_found(Gravity::Removed, force);
            assert!(found.is_some_and(|sample| (100..200).contains(&sample)), "{found:?}");
        }
        let found = first_found(Gravity::Removed, |t| walking(t, STANDARD_GRAVITY));
        assert!(found.is_some_and(|sample| sample < 300), "{found:?}");
    }

    #[test]
    fn walk_without_gravity_has_none_left() {
        assert_eq!(first_found(Gravity::Removed, |t| walking(t, 0.0)), None);
        assert_eq!(first_found(Gravity::Included, |t| walking(t, STANDARD_GRAVITY)), None);
    }

    #[test]
    fn invalid_samples_do_not_count() {
        assert_eq!(first_found(Gravity::Removed, |_| Vec3::new(f32::NAN, 0.0, 1.0e9)), None);
    }
}

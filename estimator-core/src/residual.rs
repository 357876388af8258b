//! What gravity removal leaves: the acceleration that a quiet foot still shows.
//!
//! A tilt error of one degree leaves 0.17 m/s² along the ground, and an accelerometer's bias stays
//! where no rest has taught it. A running foot stands for a tenth of a second at a time, too short
//! for an attitude filter that must not follow impacts. But what is left hardly changes within a
//! stance, nor from one to the next, and a foot that is quiet has no acceleration: the mean over
//! the quiet stretch is the error, and is taken out of every sample.
//!
//! What is learnt first counts most: the mean starts with a weight of 20 ms and so has half of
//! the error after as long. It may be no more than what leaves a foot at rest inside its
//! half-width, for otherwise a wrong residual would keep the foot from looking quiet,
//! and itself from being learnt anew; and without quiet it is forgotten.
//!
//! A push that stays looks like a tilt, as it does to anyone who stands on a platform that speeds
//! up, and both this and the attitude filter take it for one. Out of a stance that has been quiet
//! for long, a steady push of 0.15 m/s² or more is seen within 60 ms, but after 0.2 to 1 s, though the
//! push goes on, the foot is called stable again. One of 0.1 m/s² is not seen at all, nor is one of
//! 0.15 m/s² that is there from the landing on: what is quiet from the first moment on is what is
//! learnt fastest. (With [`Residual::Kept`] these two are seen, for 0.1 to 0.3 s.)

use crate::axis::PerAxis;
use crate::vector::Vec3;

/// What becomes of the acceleration that a quiet foot shows where gravity has been removed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Residual {
    /// It stays in, as in the paper.
    Kept,
    /// It is learnt from quiet stretches and taken out, up to 5/6 of the half-widths; so is a slide
    /// that speeds up as steadily. Without effect on samples that come without gravity.
    #[default]
    Removed,
}

/// How long a quiet stretch counts as already when it begins, s: two short windows, so that one
/// sample more or less of the landing's end does not matter.
const START: f32 = 0.02;

/// Memory of a long quiet stretch, s: several times that of a slide's speed, so that a slide is
/// seen before it is taken for an error.
const MEMORY: f32 = 0.5;

/// In which it is forgotten without quiet, s: a swing of half a second forgets a tenth.
const FORGETTING: f32 = 5.0;

/// The largest residual, in half-widths: with the default blur of the edges the mass on an axis at
/// rest is then still 0.62, and a foot with one such axis quiet. One with two or three looks as if it
/// moved, until in a second or two enough is forgotten.
const LARGEST: f32 = 5.0 / 6.0;

/// The residual that is learnt.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ResidualFilter {
    /// m/s², sensor frame.
    value: Vec3,
    /// Largest magnitude per axis, m/s².
    limit: Vec3,
    /// [`START`] and [`MEMORY`] in samples.
    start: f32,
    memory: f32,
    /// Share that is forgotten with each sample without quiet.
    forget: f32,
    /// Length of the quiet stretch so far and of its start, in samples; at most `memory`.
    weight: f32,
}

impl ResidualFilter {
    /// Nothing learnt yet. `sample_rate` in Hz; `half_width` in m/s².
    pub fn new(sample_rate: f32, half_width: PerAxis<f32>) -> Self {
        let start = at_least_one(START * sample_rate);
        Self {
            value: Vec3::default(),
            limit: Vec3::new(half_width.ax, half_width.ay, half_width.az) * LARGEST,
            start,
            memory: at_least_one(MEMORY * sample_rate),
            forget: 1.0 / at_least_one(FORGETTING * sample_rate),
            weight: start,
        }
    }

    /// m/s², sensor frame.
    pub const fn value(&self) -> Vec3 {
        self.value
    }

    /// Learns from an acceleration in m/s² from which the residual has been taken already.
    #[inline]
    pub fn update(&mut self, acceleration: Vec3, foot: Foot) {
        match foot {
            // The window takes a few samples to notice a jerk; this one has.
            Foot::Quiet if self.may_be_residual(acceleration) => {
                if self.weight < self.memory {
                    self.weight += 1.0;
                }
                let value = self.value + acceleration * (1.0 / self.weight);
                self.value = Vec3::new(
                    limited(value.x, self.limit.x),
                    limited(value.y, self.limit.y),
                    limited(value.z, self.limit.z),
                );
            }
            Foot::Quiet | Foot::Moving => {
                self.weight = self.start;
                self.value = self.value + self.value * -self.forget;
            }
        }
    }

    fn may_be_residual(&self, acceleration: Vec3) -> bool {
        acceleration.x.abs() <= self.limit.x
            && acceleration.y.abs() <= self.limit.y
            && acceleration.z.abs() <= self.limit.z
    }

    /// Forgets everything.
    pub const fn clear(&mut self) {
        self.value = Vec3::ZERO;
        self.weight = self.start;
    }
}

/// What the foot seems to do at the moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Foot {
    /// Nothing.
    Quiet,
    /// Anything else.
    Moving,
}

fn at_least_one(samples: f32) -> f32 {
    if samples > 1.0 { samples } else { 1.0 }
}

/// `value` within ±`limit`; 0 if it is not a number.
fn limited(value: f32, limit: f32) -> f32 {
    if value.abs() <= limit {
        value
    } else if value > 0.0 {
        limit
    } else if value < 0.0 {
        -limit
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::Kernel;

    const HALF_WIDTH: PerAxis<f32> = PerAxis::by_sensor(0.4, 0.04);

    fn filter() -> ResidualFilter {
        ResidualFilter::new(1000.0, HALF_WIDTH)
    }

    /// Samples of a foot whose error of gravity removal is `error`; what is left of it then.
    fn feed(filter: &mut ResidualFilter, error: Vec3, foot: Foot, samples: usize) -> Vec3 {
        for _ in 0..samples {
            filter.update(error - filter.value(), foot);
        }
        error - filter.value()
    }

    const ERROR: Vec3 = Vec3::new(0.2, -0.1, 0.3);

    #[test]
    fn half_of_an_error_is_gone_after_twenty_milliseconds_of_quiet_and_most_after_a_stance() {
        let mut filter = filter();
        let left = feed(&mut filter, ERROR, Foot::Quiet, 20);
        assert!(
            (left.length() / ERROR.length() - 0.5).abs() < 0.02,
            "{left:?}"
        );
        let left = feed(&mut filter, ERROR, Foot::Quiet, 180);
        assert!(left.length() < 0.12 * ERROR.length(), "{left:?}");
    }

    #[test]
    fn a_foot_that_moves_teaches_nothing_and_a_swing_forgets_little() {
        let mut filter = filter();
        feed(&mut filter, ERROR, Foot::Quiet, 2_000);
        let left = feed(&mut filter, Vec3::new(30.0, 0.0, -5.0), Foot::Moving, 500);
        let kept = Vec3::new(30.0, 0.0, -5.0) - left;
        assert!(
            (kept.length() / ERROR.length() - 0.9).abs() < 0.02,
            "{kept:?}"
        );
    }

    #[test]
    fn a_residual_leaves_a_foot_without_any_inside_its_half_width() {
        let mut filter = filter();
        // Led on, step by step.
        for scale in 1..=4 {
            let error = Vec3::new(0.11, -0.11, 0.0) * scale as f32;
            feed(&mut filter, error, Foot::Quiet, 10_000);
        }
        let expected = Vec3::new(1.0, -1.0, 0.0) * (0.4 * LARGEST);
        assert!((filter.value() - expected).is_within(1e-6), "{filter:?}");
        let kernel = Kernel::new(0.02, 0.4, 0.4);
        assert!(kernel.mass(filter.value().x).to_f32() > 0.6);
    }

    #[test]
    fn a_jerk_in_a_quiet_stretch_teaches_nothing() {
        let mut filter = filter();
        feed(&mut filter, ERROR, Foot::Quiet, 300);
        let before = filter.value();
        filter.update(Vec3::new(0.0, 2.5, 0.0), Foot::Quiet);
        assert!((filter.value() - before).is_within(1e-3), "{filter:?}");
    }

    #[test]
    fn no_number_upsets_it() {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
            let mut filter = filter();
            filter.update(Vec3::new(value, value, value), Foot::Quiet);
            assert!(filter.value().is_within(0.4), "{value}: {filter:?}");
        }
    }
}

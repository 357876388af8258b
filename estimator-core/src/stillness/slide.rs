//! The slide without shaking: how much speed a foot has picked up along the ground.
//!
//! A foot on a slick floor can slide off at a tenth of the acceleration that its stances show. Its
//! accelerations all point one way, though, and add up. So what lies across up is summed into a speed
//! that forgets:
//!
//! ```text
//! v ← v + a·dt − v·dt/τ,  |v| limited
//! P(no slide) = 1 / (1 + 0.7 r + 0.3 r²),  r = (|v|/s)²
//! ```
//!
//! where s is [`SlideParams::speed`], or more for a foot that rolls in its stances: a lever times the
//! rate that is still usual there.
//!
//! What it cannot see: a steady acceleration below s/τ, whatever speed it leads to; a foot that slides
//! on at a constant speed, once the start of it is forgotten; and all slides below [`SLOWEST_RATE`],
//! where samples do not add up to a speed.

use super::params::SlideParams;
use crate::order::Order;
use crate::vector::Vec3;

/// Samples at a lower rate are not summed up, Hz: a landing rings at up to 80 Hz, and of what lies
/// above half the sample rate a sum of samples is no speed.
pub const SLOWEST_RATE: f32 = 400.0;

/// How much of the doubt grows with the square of the speed, and so begins below the limit; the rest
/// grows with its fourth power.
const BELOW: f32 = 0.6;

/// The speed along the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slide {
    params: SlideParams,
    /// Time between samples, s.
    period: f32,
    /// Share of the speed that is forgotten with each sample.
    forget: f32,
    /// m/s, sensor frame.
    speed: Vec3,
    /// Square of what counts as a slide, m²/s².
    limit_squared: f32,
}

impl Slide {
    /// A foot at rest; `None` where samples come too slowly.
    pub fn new(params: SlideParams, sample_rate: f32) -> Option<Self> {
        (sample_rate >= SLOWEST_RATE).then(|| {
            let period = 1.0 / sample_rate;
            Self {
                params,
                period,
                forget: (period / params.time_constant).lesser(1.0),
                speed: Vec3::ZERO,
                limit_squared: params.speed * params.speed,
            }
        })
    }

    /// Adds up an acceleration along the ground, m/s², on a foot whose stances turn at `still_rate`,
    /// rad/s.
    #[inline]
    pub fn push(&mut self, level_acceleration: Vec3, still_rate: f32) {
        let limit = (self.params.lever * still_rate).greater(self.params.speed);
        self.limit_squared = limit * limit;
        self.speed += level_acceleration * self.period + self.speed * -self.forget;
        let most = self.params.limit * self.params.limit * self.limit_squared;
        let square = self.speed.dot(self.speed);
        if square > most {
            self.speed = self.speed * crate::root::sqrt(most / square);
        }
    }

    /// What is known of the motion says nothing about the speed any more: as fast as can be
    /// remembered, in whatever direction.
    pub fn doubt(&mut self) {
        let most = self.params.limit * crate::root::sqrt(self.limit_squared);
        self.speed = Vec3::new(most, 0.0, 0.0);
    }

    /// The probability that the foot does not slide.
    pub fn probability(&self) -> f32 {
        let ratio = self.speed.dot(self.speed) / self.limit_squared;
        1.0 / (1.0 + ratio * (BELOW + (1.0 - BELOW) * ratio))
    }
}

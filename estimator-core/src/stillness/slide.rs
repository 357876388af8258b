//! Detection of slides without shaking, by the speed gained along the ground.
//!
//! A foot on a slick floor can slide off at a tenth of the acceleration that its stances show. Its
//! accelerations all point one way, though, and add up. So the component across up is summed into a speed
//! that decays:
//!
//! ```text
//! v ← v + clip(a)·dt − v·dt/τ                    speed
//! s ← s + clip(a)·dt − s·dt/τₛ                   the same over a shorter time: shaking
//! P(no slide) = 1 / (1 + w r²),  r = (|v|/limit)²
//! limit² = speed² + (usual·min(usual/shaking, spread))² + (lever·turn)²
//! ```
//!
//! The limit is the foot's own. *usual* is a quantile of |s| in the foot's stances: 0.5 mm/s on a
//! noise-free simulated robot, 10 mm/s on a NAO. A foot that shakes more drifts more, too, so the limit grows
//! faster than *usual*. It is learnt from samples that count as stable, so it grows where speeds are continuous from
//! rest upwards, and stays where a gap lies between the stances and the slides; the shorter sum lets slides
//! count for less. A foot that finds no stance for [`LONGEST_WITHOUT`] starts to learn it again. *turn* is the rate at which the foot rolls: an IMU at the heel of a foot that rolls
//! over its toe moves, and slides nowhere.
//!
//! No constant depends on a sample rate, so a foot is judged alike at every rate from [`FULL_RATE`] on.
//! Below it the speed counts less and less, and not at all from [`SLOWEST_RATE`] down: a landing rings at up
//! to 80 Hz, and the sum of a signal that rings between samples does not give a speed.
//!
//! Not detected: a steady acceleration below limit/τ, whatever the resulting speed; a foot that
//! slides on at a constant speed, once its start has decayed; and slides at low rates.

use super::params::SlideParams;
use crate::logarithm::exp;
use crate::order::Order;
use crate::root::sqrt;
use crate::vector::Vec3;

/// Rate below which samples do not add up to a speed, Hz: a landing rings at up to 80 Hz.
const SLOWEST_RATE: f32 = 200.0;

/// Rate from which the speed counts in full, Hz; in between its weight is interpolated linearly.
pub const FULL_RATE: f32 = 250.0;

/// Weight of the slide at a sample rate in Hz: 0 up to 200 Hz, where samples do not give a speed, 1 from 250 Hz on.
#[must_use]
pub fn slide_weight(sample_rate: f32) -> f32 {
    ((sample_rate - SLOWEST_RATE) / (FULL_RATE - SLOWEST_RATE))
        .greater(0.0)
        .lesser(1.0)
}

/// Range of the usual speed, m/s.
const USUAL: (f32, f32) = (1.0e-4, 0.2);

/// Probability above which the foot is more probably still than not.
const STILL: f32 = 0.5;

/// Longest time without a stance, s, after which the usual speed returns to that of the start: only stances teach, so
/// a limit too low for this foot would stay. In all recordings a foot finds a stance sooner.
const LONGEST_WITHOUT: f32 = 4.0;

/// Time constant of the return, s.
const FOUND_AGAIN: f32 = 1.0;

/// Coefficients of the slide test at a sample rate.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct Coefficients {
    params: SlideParams,
    /// Time between samples, s.
    period: f32,
    /// Share of the speed that decays with each sample while the foot is still by the other quantities.
    forget_still: f32,
    /// The same while the foot moves.
    forget_moving: f32,
    /// Share of the shaking that decays with each sample.
    forget_shaking: f32,
    /// Share of the newest rate in its mean.
    newest_turn: f32,
    /// Weight of the slide at this sample rate.
    weight: f32,
    /// Square of the limit of an acceleration in the sum, m²/s⁴.
    impact_squared: f32,
    /// Square of the largest speed over the limit.
    most: f32,
}

/// Speed along the ground, and the usual speed in a stance.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Slide {
    coefficients: Coefficients,
    /// Speed along the ground, m/s, sensor frame.
    speed: Vec3,
    /// The same over a shorter time, m/s, sensor frame.
    shaking: Vec3,
    /// Mean rate beyond [`SlideParams::rate`], rad/s.
    turn: f32,
    /// Usual speed in a stance, m/s.
    usual: f32,
    /// Duration of the stances that it was learnt from, s; at most the memory.
    learnt: f32,
    /// Length of the stance so far, s.
    stance: f32,
    /// Time since the last sample of a stance, s.
    without: f32,
    /// Square of the limit of a foot that does not roll, m²/s².
    standing_squared: f32,
    /// Square of the limit, m²/s².
    limit_squared: f32,
}

impl Slide {
    /// A foot at rest.
    pub fn new(params: SlideParams, sample_rate: f32) -> Self {
        let period = 1.0 / sample_rate;
        let share = |time_constant: f32| 1.0 - exp(-period / time_constant);
        let mut slide = Self {
            coefficients: Coefficients {
                params,
                period,
                forget_still: share(params.time_constant),
                forget_moving: share(params.moving_time_constant),
                forget_shaking: share(params.shake_time_constant),
                newest_turn: share(params.turn_time_constant),
                weight: slide_weight(sample_rate),
                impact_squared: params.impact * params.impact,
                most: params.limit * params.limit,
            },
            speed: Vec3::ZERO,
            shaking: Vec3::ZERO,
            turn: 0.0,
            usual: params.usual,
            learnt: 0.0,
            stance: 0.0,
            without: 0.0,
            standing_squared: 0.0,
            limit_squared: 0.0,
        };
        slide.place_standing_limit();
        slide.limit_squared = slide.standing_squared;
        slide
    }

    /// Updates the limit of a foot that does not roll; called where the usual speed has changed.
    fn place_standing_limit(&mut self) {
        let SlideParams {
            speed,
            spread,
            shaking,
            ..
        } = self.coefficients.params;
        let usual = self.usual * (self.usual / shaking).lesser(spread);
        self.standing_squared = speed * speed + usual * usual;
    }

    /// Adds an acceleration along the ground, m/s², of a foot that is still with probability `still`
    /// according to the other quantities. Returns the probability that it does not slide.
    #[inline]
    pub fn push(&mut self, level_acceleration: Vec3, still: f32) -> f32 {
        let Coefficients {
            ref params,
            period,
            forget_still,
            forget_moving,
            forget_shaking,
            weight,
            impact_squared,
            most,
            ..
        } = self.coefficients;
        let square = level_acceleration.dot(level_acceleration);
        let clipped = match square > impact_squared {
            true => level_acceleration * (params.impact / sqrt(square)),
            false => level_acceleration,
        };
        let gained = clipped * period;
        self.shaking = self.shaking * (1.0 - forget_shaking) + gained;
        // The sum left by a swing carries no information about the stance after it.
        let forget = forget_moving + (forget_still - forget_moving) * still;
        let left = self.speed * (1.0 - forget);
        let next = left + gained;
        let ratio = next.dot(next) / self.limit_squared;
        // An increment beyond the largest speed is not added: no root on the way to the probability.
        self.speed = match ratio > most {
            true => left,
            false => next,
        };
        let ratio = ratio.lesser(most);
        1.0 / (1.0 + weight * ratio * ratio)
    }

    /// Returns whether the foot is no faster than a standing one.
    pub fn is_slow(&self) -> bool {
        self.speed.dot(self.speed) < self.standing_squared
    }

    /// Updates the limit for the next sample, for a foot that turns at a rate given as its square, rad²/s².
    pub fn roll(&mut self, rate_squared: f32) {
        let Coefficients {
            params,
            newest_turn,
            ..
        } = self.coefficients;
        // Most samples are below the rate, and need no root.
        let turn = match rate_squared > params.rate * params.rate {
            true => (sqrt(rate_squared) - params.rate)
                .greater(0.0)
                .lesser(params.largest_rate),
            false => 0.0,
        };
        self.turn += (turn - self.turn) * newest_turn;
        let turn = params.lever * self.turn;
        self.limit_squared = self.standing_squared + turn * turn;
    }

    /// Learns the usual speed from the newest sample, which is stable with this probability: up and down
    /// steps of a fixed size converge to a quantile.
    pub fn learn(&mut self, stable: f32) {
        let Coefficients { params, period, .. } = self.coefficients;
        if stable <= STILL {
            self.stance = 0.0;
            // Ends where a period no longer adds to it, after hours.
            self.without += period;
            if self.without <= LONGEST_WITHOUT {
                return;
            }
            self.usual += (params.usual - self.usual).greater(0.0) * (period / FOUND_AGAIN);
        } else {
            self.without = 0.0;
            // Limited to the range of interest, so that an hour of standing is not counted in steps of 1 ms.
            self.stance = (self.stance + period).lesser(2.0 * params.learn_until);
            if self.stance < params.learn_from || self.stance > params.learn_until {
                return;
            }
            self.learnt = (self.learnt + period).lesser(params.memory);
            let gain = params.gain * period / (self.learnt + params.prior);
            // Up by the quantile, down by its complement, and in between near the usual speed, so that the learnt
            // value does not depend on the last bit of a sum.
            let ratio = self.shaking.dot(self.shaking) / (self.usual * self.usual);
            let square = ratio * ratio;
            let step = square / (1.0 + square) - (1.0 - params.quantile);
            let (least, most) = USUAL;
            self.usual = (self.usual * (1.0 + gain * step))
                .greater(least)
                .lesser(most);
        }
        self.place_standing_limit();
    }
}

#[cfg(test)]
mod tests {
    use super::super::params::StillnessParams;
    use super::*;

    const PARAMS: SlideParams = StillnessParams::DEFAULT.slide;

    /// Feeds a foot that is still by the other quantities and turns at `rate`, for `seconds` at `sample_rate`;
    /// returns the last probability.
    fn feed(slide: &mut Slide, push: f32, rate: f32, seconds: f32, sample_rate: f32) -> f32 {
        let mut probability = 1.0;
        for _ in 0..(seconds * sample_rate) as u32 {
            probability = slide.push(Vec3::new(push, 0.0, 0.0), 1.0);
            slide.learn(probability);
            slide.roll(rate * rate);
        }
        probability
    }

    /// A foot after quiet stances.
    fn quiet(sample_rate: f32) -> Slide {
        let mut slide = Slide::new(PARAMS, sample_rate);
        for _ in 0..5 {
            feed(&mut slide, 0.0, 0.0, 0.4, sample_rate);
            slide.learn(0.0);
        }
        slide
    }

    #[test]
    fn foot_without_stances_returns_to_the_usual_speed_of_the_start() {
        let mut slide = quiet(1000.0);
        let learnt = slide.usual;
        assert!(learnt < 0.5 * PARAMS.usual, "{learnt}");
        let swing = |slide: &mut Slide, seconds: f32| {
            (0..(seconds * 1000.0) as u32).for_each(|_| slide.learn(0.0));
        };
        swing(&mut slide, 0.99 * LONGEST_WITHOUT);
        assert_eq!(slide.usual, learnt);
        swing(&mut slide, 5.0 * FOUND_AGAIN);
        assert!(slide.usual > 0.98 * PARAMS.usual, "{}", slide.usual);
        assert!(slide.standing_squared > quiet(1000.0).standing_squared);
    }

    #[test]
    fn a_push_is_a_slide_at_every_rate_after_the_same_time() {
        for rate in [FULL_RATE, 500.0, 1000.0, 1660.0] {
            let mut slide = quiet(rate);
            assert!(feed(&mut slide, 0.0, 0.0, 0.5, rate) > 0.99);
            let after = |seconds: f32| feed(&mut slide.clone(), 0.3, 0.0, seconds, rate);
            assert!(after(0.03) < 0.45, "{rate} Hz: {}", after(0.03));
            assert!(after(0.002) > 0.55 || rate < 500.0, "{rate} Hz");
        }
    }

    #[test]
    fn speed_counts_less_at_lower_rates_and_ends_at_the_slowest() {
        let after = |rate: f32| feed(&mut quiet(rate), 0.3, 0.0, 0.1, rate);
        let [none, half, full] =
            [SLOWEST_RATE, 0.5 * (SLOWEST_RATE + FULL_RATE), FULL_RATE].map(after);
        assert_eq!(none, 1.0);
        assert!(full < 0.8 * half && half < 0.8, "{half}, {full}");
    }

    #[test]
    fn a_foot_whose_stances_drift_learns_their_speed() {
        let mut slide = Slide::new(PARAMS, 1000.0);
        let still = quiet(1000.0).standing_squared;
        // To and fro at 5 Hz, by 0.15 m/s² at most, stance after stance.
        for stance in 0..40 {
            for k in 0..400 {
                let push = 0.15 * libm::sinf(0.0314 * (k + 37 * stance) as f32);
                let probability = slide.push(Vec3::new(push, 0.0, 0.0), 1.0);
                slide.learn(probability);
                slide.roll(0.0);
            }
            slide.learn(0.0);
        }
        let drifting = slide.standing_squared;
        assert!(drifting > 4.0 * still, "{drifting}, {still}");
    }

    #[test]
    fn a_slide_far_beyond_the_stances_is_not_learnt() {
        let mut slide = Slide::new(PARAMS, 1000.0);
        for _ in 0..40 {
            feed(&mut slide, 0.0, 0.0, 0.3, 1000.0);
            assert!(feed(&mut slide, 1.0, 0.0, 0.3, 1000.0) < 0.5);
            assert!(slide.usual <= PARAMS.usual, "{}", slide.usual);
            slide.speed = Vec3::ZERO;
        }
    }

    #[test]
    fn a_foot_that_rolls_may_move_by_the_lever() {
        let mut slide = quiet(1000.0);
        let rolls = feed(&mut slide.clone(), 0.3, PARAMS.rate + 0.3, 0.06, 1000.0);
        let slides = feed(&mut slide, 0.3, 0.0, 0.06, 1000.0);
        assert!(rolls > 0.5 && slides < 0.5, "{rolls}, {slides}");
    }

    #[test]
    fn landing_spike_is_limited_per_sample() {
        let mut slide = Slide::new(PARAMS, 500.0);
        let probability = slide.push(Vec3::new(30.0, 0.0, 0.0), 1.0);
        assert!(probability > 0.5, "{probability}");
    }
}

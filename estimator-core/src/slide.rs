//! The slide without shaking: how much speed a foot has picked up along the ground.
//!
//! The paper's condition for stable contact is a velocity that is zero and stays so; what it tests
//! is acceleration, sample by sample. A foot on a slick floor can slide off at a tenth of the
//! acceleration half-width and never leave it. Its accelerations all point one way, though, and
//! add up. So the two axes along the ground are summed into a speed that forgets:
//!
//! ```text
//! v ← v + a·dt − v·dt/τ,  limited to ±5/4 δ
//! ```
//!
//! and that speed is tested as every other quantity is: a kernel, integrated over ±δ. It can only
//! lower the probability of its axis.
//!
//! The limit is what lets the sum forget a swing of 1 m/s: from ±5/4 δ it is back inside ±δ after
//! τ·ln(5/4), 16 ms at τ = 70 ms, which is sooner than the landing has left the window.
//!
//! δ is what one sets, or more on a robot that shakes: the speed of a vibration of
//! [`TREMOR_FREQUENCY`] that just stays within the acceleration's half-width. So the calibration of
//! half-widths is that of speeds too.
//!
//! What it cannot see: a steady acceleration below δ/τ, 0.076 m/s² in the default, whatever speed it
//! leads to; a foot that slides on at a constant speed, once the start of it is forgotten; and slides
//! slower than δ, which is 53 mm/s where the acceleration's half-width is 4 m/s².
//!
//! Vertically there is no such sum: what an accelerometer's own scale and bias leave of gravity
//! would add up to more than a slide does. And below [`SLOWEST_RATE`] there is none at all.

use crate::axis::PerAxis;
use crate::kernel::Kernel;
use crate::params::{ParamsError, in_range};
use crate::sample::LinearAcceleration;

/// What counts as a slide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlideParams {
    /// Least half-width δ of the speed along each axis, m/s; 1e-6 to 1e3.
    pub speed: f32,
    /// τ, the time over which speed is remembered, s; 1e-3 to 10.
    pub time_constant: f32,
}

/// Vibration of a foot that stands under a walking robot, Hz: the middle of the 7 to 20 Hz at
/// which legs of some decimetres swing on their drives.
pub const TREMOR_FREQUENCY: f32 = 12.0;

/// Samples at a lower rate are not summed up, Hz: a landing rings at up to 80 Hz, and of what lies
/// above half the sample rate a sum of samples is no speed.
pub const SLOWEST_RATE: f32 = 200.0;

impl SlideParams {
    /// | field | value | reason |
    /// |---|---|---|
    /// | `speed` | 5 mm/s | a hundredth of a walking speed of 0.5 m/s, what leg odometry that takes the foot for fixed is then wrong by; 1.5 mm over a stance of 0.3 s, what a rubber sole gives |
    /// | `time_constant` | 70 ms | as long as gravity allows: in good stances of the simulated walk and trot 95 % of samples are left with less than 0.06 m/s², which adds up to 4 mm/s |
    pub const DEFAULT: Self = Self {
        speed: 5.0e-3,
        time_constant: 0.07,
    };

    /// What the sum is computed with at a sample rate in Hz, with the half-widths of the
    /// accelerations in m/s²; none where samples come too slowly.
    pub(crate) fn validate(
        &self,
        sample_rate: f32,
        half_width: PerAxis<f32>,
    ) -> Result<Option<SlideCoefficients>, ParamsError> {
        in_range("slide.speed", self.speed, 1.0e-6, 1.0e3)?;
        in_range("slide.time_constant", self.time_constant, 1.0e-3, 10.0)?;
        if sample_rate < SLOWEST_RATE {
            return Ok(None);
        }
        let period = 1.0 / sample_rate;
        let forget = period / self.time_constant;
        let axis = |half_width: f32| {
            let tremor = half_width / (core::f32::consts::TAU * TREMOR_FREQUENCY);
            let speed = if tremor > self.speed {
                tremor
            } else {
                self.speed
            };
            Direction {
                kernel: Kernel::new(NOISE * speed, speed, TOLERANCE),
                limit: LIMIT * speed,
            }
        };
        Ok(Some(SlideCoefficients {
            period,
            forget: if forget < 1.0 { forget } else { 1.0 },
            x: axis(half_width.ax),
            y: axis(half_width.ay),
        }))
    }
}

/// The edge of ±δ is blurred by this part of δ: a ramp from 0.57 δ to 1.43 δ.
const TOLERANCE: f32 = 0.25;

/// Bandwidth of the speed's kernel, in half-widths. What a speed is uncertain by is mostly not
/// noise, so it is small beside [`TOLERANCE`].
const NOISE: f32 = 0.01;

/// Speed is remembered up to so many half-widths. The mass is then 0.21.
const LIMIT: f32 = 1.25;

/// Parameters that have been checked, in the form the sum is computed with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SlideCoefficients {
    /// Time between samples, s.
    period: f32,
    /// Share of the speed that is forgotten with each sample.
    forget: f32,
    x: Direction,
    y: Direction,
}

/// What is known of one direction along the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Direction {
    kernel: Kernel,
    /// m/s.
    limit: f32,
}

/// The speed along the two axes of the ground.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slide {
    coefficients: SlideCoefficients,
    /// m/s, sensor frame.
    x: f32,
    y: f32,
}

impl Slide {
    pub const fn new(coefficients: SlideCoefficients) -> Self {
        Self {
            coefficients,
            x: 0.0,
            y: 0.0,
        }
    }

    /// Adds up one sample's acceleration.
    #[inline]
    pub fn push(&mut self, acceleration: LinearAcceleration) {
        let SlideCoefficients {
            period,
            forget,
            x,
            y,
        } = &self.coefficients;
        let add = |speed: f32, acceleration: f32, limit: f32| {
            let sum = speed + acceleration * period - speed * forget;
            // What is not a number is no rest either.
            if sum.abs() <= limit {
                sum
            } else if sum > 0.0 {
                limit
            } else {
                -limit
            }
        };
        self.x = add(self.x, acceleration.0.x, x.limit);
        self.y = add(self.y, acceleration.0.y, y.limit);
    }

    /// The probability along x and along y that the foot has not picked up speed.
    pub fn probabilities(&self) -> (f32, f32) {
        let SlideCoefficients { x, y, .. } = &self.coefficients;
        (
            x.kernel.mass(self.x).to_f32(),
            y.kernel.mass(self.y).to_f32(),
        )
    }

    /// The foot rests.
    pub const fn clear(&mut self) {
        self.x = 0.0;
        self.y = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::Vec3;

    const HALF_WIDTH: PerAxis<f32> = PerAxis::by_sensor(0.4, 0.04);

    fn slide_at(rate: f32, half_width: PerAxis<f32>) -> Option<Slide> {
        let coefficients = SlideParams::DEFAULT.validate(rate, half_width);
        coefficients.expect("the default").map(Slide::new)
    }

    fn slide() -> Slide {
        slide_at(1000.0, HALF_WIDTH).expect("a fast rate")
    }

    fn push(slide: &mut Slide, x: f32, y: f32, times: usize) -> (f32, f32) {
        for _ in 0..times {
            slide.push(LinearAcceleration(Vec3::new(x, y, 9.0)));
        }
        slide.probabilities()
    }

    #[test]
    fn a_push_that_no_sample_betrays_adds_up_to_a_slide() {
        // A quarter of the acceleration half-width, for a twentieth of a second: 5 mm/s, of which
        // a third is forgotten by then.
        let mut slide = slide();
        let (x, y) = push(&mut slide, 0.1, 0.0, 50);
        assert!((0.75..0.9).contains(&x), "{x}");
        assert!(y > 0.9999, "{y}");
        let (x, _) = push(&mut slide, 0.1, 0.0, 80);
        assert!(x < 0.5, "{x}");
    }

    #[test]
    fn shaking_adds_up_to_nothing() {
        let mut slide = slide();
        for i in 0..500 {
            let sign = if i % 20 < 10 { 0.3 } else { -0.3 };
            let (x, y) = push(&mut slide, sign, -sign, 1);
            assert!(x > 0.9 && y > 0.9, "{x}, {y} at {i}");
        }
    }

    #[test]
    fn a_swing_of_any_speed_is_forgotten_before_a_landing_leaves_the_window() {
        for a in [3.0, -50.0, f32::MAX, f32::NEG_INFINITY, f32::NAN] {
            let mut slide = slide();
            let (swinging, _) = push(&mut slide, a, a, 300);
            assert!(swinging < 0.25, "{a}: {swinging}");
            let (resting, _) = push(&mut slide, 0.0, 0.0, 17);
            assert!(resting > 0.5, "{a}: {resting}");
            let (resting, _) = push(&mut slide, 0.0, 0.0, 33);
            assert!(resting > 0.9, "{a}: {resting}");
        }
    }

    #[test]
    fn the_sum_is_one_of_time_and_not_of_samples() {
        let [slow, fast] = [200.0, 2000.0].map(|rate| {
            let mut slide = slide_at(rate, HALF_WIDTH).expect("a fast rate");
            push(&mut slide, 0.1, 0.0, (0.06 * rate) as usize).0
        });
        assert!((slow - fast).abs() < 0.03, "{slow} and {fast}");
        assert!(slide_at(199.0, HALF_WIDTH).is_none());
    }

    #[test]
    fn a_robot_that_shakes_may_gain_the_speed_of_its_shaking() {
        let half_width = PerAxis {
            ax: 4.0,
            ..HALF_WIDTH
        };
        let mut slide = slide_at(1000.0, half_width).expect("a fast rate");
        let (x, y) = push(&mut slide, 1.0, 1.0, 20);
        assert!(x > 0.99 && y < 0.25, "{x}, {y}");
    }
}

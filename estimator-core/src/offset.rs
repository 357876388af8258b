//! Offset of the accelerometer: a constant error, in the frame of the sensor.
//!
//! The attitude filter takes an offset for a tilt and for a part of gravity, and both are right for one inclination of
//! the foot. When the shank then leans over the standing foot, the offset turns with it, and gravity does not. With 40 mg
//! on each axis and a lean of 20°, the difference is an acceleration of 0.2 m/s² along the ground, as in a slide.
//!
//! A standing foot does not accelerate on average. So what is left of the acceleration in stances is removed from the
//! force, before up is estimated:
//!
//! ```text
//! offset ← offset + clip(a)·dt/τ      where P > 0.9
//! ```
//!
//! At one inclination *a* is 0, and nothing is learnt. The more the shank leans in its stances, the sooner the offset is
//! known. τ is long against the sway of a leg that hangs: with 2 s the offset would follow its acceleration.
//! Until the offset is known, the slide test allows for it.

use crate::vector::Vec3;

/// Time constant τ, s. With 6 s, and an offset that is learnt sooner, a run after a step of the gyroscope's bias has more
/// false stances a minute later (`drift.rs` of the host's tests). With 8 s, the offset of one foot of a simulated robot that
/// moves its body is not known in time.
const TIME_CONSTANT: f32 = 7.0;

/// Largest acceleration that counts, m/s², because the trembling of a stance must not outweigh the rest of it.
const LARGEST_ACCELERATION: f32 = 0.5;

/// Largest offset, m/s²: 100 mg. An LSM6DSOX has 20 mg on each axis, and more after soldering.
const LARGEST: f32 = 1.0;

/// Probability above which the foot certainly stands, so that offset and bias may be learnt. At the beginning of a
/// swing, P falls below this value first.
pub(crate) const CERTAIN_STANCE: f32 = 0.9;

/// Estimate of the offset of an accelerometer, m/s², frame of the sensor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ForceOffset(Vec3);

impl ForceOffset {
    /// No offset so far.
    pub(crate) const NONE: Self = Self(Vec3::ZERO);

    /// Removes the offset from a force, m/s².
    pub(crate) fn removed_from(&self, force: Vec3) -> Vec3 {
        force - self.0
    }

    /// Learns from the acceleration of a standing foot without gravity and offset, m/s², which lasted for `seconds`.
    pub(crate) fn learn(&mut self, acceleration: Vec3, seconds: f32) {
        let error = acceleration.clipped(LARGEST_ACCELERATION);
        self.0 = (self.0 + error * (seconds / TIME_CONSTANT)).clipped(LARGEST);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Offset after `seconds` of stance with this acceleration, before the offset is removed.
    fn learnt(acceleration: Vec3, seconds: u32) -> Vec3 {
        let mut offset = ForceOffset::NONE;
        for _ in 0..1_000 * seconds {
            offset.learn(offset.removed_from(acceleration), 0.001);
        }
        offset.0
    }

    #[test]
    fn acceleration_that_stays_in_stances_is_an_offset() {
        let offset = Vec3::new(0.3, -0.2, 0.1);
        let error = (learnt(offset, 30) - offset).length();
        assert!(error < 0.01, "{error}");
    }

    #[test]
    fn offset_is_limited() {
        assert!(learnt(Vec3::new(0.0, 5.0, 0.0), 60).length() <= 1.001 * LARGEST);
    }
}

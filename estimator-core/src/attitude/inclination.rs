//! Inclination correction: a low-pass of the specific force in the world frame, with a variable gain.
//!
//! A second-order Butterworth low-pass runs in its own time, which passes as fast as the samples
//! are worth: a scalar Riccati equation weighs the doubt that grows with time and turning against
//! the evidence that a sample brings. Position, speed and gain of the low-pass are all in that
//! time, so that a change of gain leaves no momentum behind.

use crate::order::Order;
use crate::root::inverse_root;
use crate::sample::Saturation;
use crate::vector::{Quaternion, Vec3};

/// Time constant of the correction right after the start, s: the first second is a running mean.
const START_TIME_CONSTANT: f32 = 0.1;

/// Growth of doubt with the angular rate, s/rad: a gyroscope's scale error turns with it.
const RATE_DOUBT: f32 = 0.1;

/// Time constant of the correction after clipped accelerometer samples, s.
const ACCELEROMETER_CLIPPED: f32 = 1.0;

/// Clipping time of the accelerometer for its full effect, s. Clipped samples are left out, so the
/// mean of a stride lacks the force that stopped the foot: a runner's landing, which clips for a few ms,
/// must not pull the filter towards that mean. A foot that clips for longer has hit something that its gyroscope may not have followed.
const ACCELEROMETER_CLIPPING_TIME: f32 = 0.2;

/// Growth of doubt with the square of the angle that a turn may be wrong by, 1/(s rad²). It is
/// small because a moving foot cannot use it: with 50, samples lost in bursts of 10 ms let the
/// forces of a run's landings tilt the estimate by 7° instead of 0.5°.
const TURN_DOUBT: f32 = 1.0;

/// Time constant of the correction after a gap, s, at most: the turn in it is a guess, but a better one
/// than the mean of a part of a stride.
const GAP: f32 = 2.0;

/// Time constant of the correction after clipped gyroscope samples or an unknown turn, s.
const TURN_UNKNOWN: f32 = 0.3;

/// Clipping time of the gyroscope for its full effect, s: a single clipped sample does little.
const GYROSCOPE_CLIPPING_TIME: f32 = 0.02;

/// Largest correction within one step, rad.
const LARGEST_CORRECTION: f32 = 0.25;

/// Time constant of the correction, s, from which the inclination counts as settled: the forces of a stride have then been
/// averaged. It lies above that after clipped samples.
const SETTLED_TIME_CONSTANT: f32 = 1.1;

#[derive(Clone, Copy, Debug)]
pub(super) struct InclinationCoefficients {
    /// Growth of doubt with time, 1/s².
    growth: f32,
}

impl InclinationCoefficients {
    pub(super) fn new(motion_time_constant: f32) -> Self {
        Self { growth: 1.0 / (motion_time_constant * motion_time_constant) }
    }
}

/// State of the inclination correction.
#[derive(Clone, Debug)]
pub(super) struct Inclination {
    coefficients: InclinationCoefficients,
    /// Doubt about the inclination: 1 over the time constant of the correction, 1/s.
    doubt: f32,
    /// The low-passed specific force, world frame, m/s².
    force: Vec3,
    /// Rate of change of the low-passed force in the filter's own time, m/s².
    speed: Vec3,
}

impl Inclination {
    pub(super) const fn new(coefficients: InclinationCoefficients) -> Self {
        Self {
            coefficients,
            doubt: 1.0 / START_TIME_CONSTANT,
            force: Vec3::new(0.0, 0.0, crate::units::STANDARD_GRAVITY),
            speed: Vec3::ZERO,
        }
    }

    /// Increases the doubt over a step of `dt` s, in which the foot's turn may be wrong by an angle whose
    /// square is `spread_squared`, rad².
    pub(super) fn grow_doubt(
        &mut self,
        rate_magnitude: f32,
        saturation: Option<Saturation>,
        spread_squared: f32,
        dt: f32,
    ) {
        self.doubt += TURN_DOUBT * spread_squared;
        self.doubt += (1.0 + RATE_DOUBT * rate_magnitude) * dt * self.coefficients.growth;
        if saturation.is_some_and(Saturation::includes_accelerometer) {
            self.raise_towards(ACCELEROMETER_CLIPPED, dt / ACCELEROMETER_CLIPPING_TIME);
        }
        if saturation.is_some_and(Saturation::includes_gyroscope) {
            self.raise_towards(TURN_UNKNOWN, dt / GYROSCOPE_CLIPPING_TIME);
        }
        self.doubt = self.doubt.lesser(1.0 / START_TIME_CONSTANT);
    }

    /// Marks up as lost: it has to settle again.
    pub(super) fn lose(&mut self) {
        self.raise_towards(TURN_UNKNOWN, 1.0);
    }

    /// Doubts up after a turn that was guessed.
    pub(super) fn doubt_guess(&mut self) {
        self.raise_towards(GAP, 1.0);
    }

    /// Adds `share` of the doubt that belongs to `time_constant`, up to all of it.
    fn raise_towards(&mut self, time_constant: f32, share: f32) {
        let whole = 1.0 / time_constant;
        let raised = (self.doubt + share * whole).lesser(whole);
        self.doubt = self.doubt.greater(raised);
    }

    /// Processes the specific force of a sample with the relative `noise` and returns the
    /// correction that brings the low-passed force upright.
    pub(super) fn correct(&mut self, force_world: Vec3, noise: f32, dt: f32) -> Correction {
        let evidence = self.doubt * dt / noise;
        self.doubt /= 1.0 + evidence;
        // One step of implicit Euler, stable at any gain.
        let step = 2.0 * evidence / (1.0 + evidence);
        let damping = 1.0 / (1.0 + core::f32::consts::SQRT_2 * step + step * step);
        self.speed = (self.speed + (force_world - self.force) * step) * damping;
        self.force += self.speed * step;

        let correction = Correction::upright(self.force);
        self.force = correction.turn(self.force);
        self.speed = correction.turn(self.speed);
        correction
    }

    /// Returns whether the inclination has settled.
    pub(super) fn has_settled(&self) -> bool {
        self.doubt * SETTLED_TIME_CONSTANT <= 1.0
    }
}

/// Small rotation of the world frame about a horizontal axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Correction {
    /// rad about world x.
    x: f32,
    /// rad about world y.
    y: f32,
}

impl Correction {
    /// The rotation that takes `force` towards world z.
    fn upright(force: Vec3) -> Self {
        // The small number keeps the inverse of a vanishing force finite.
        let inverse = inverse_root(force.dot(force) + 1.0e-6);
        let (x, y) = (force.y * inverse, -force.x * inverse);
        let largest = x.abs().greater(y.abs());
        if force.z < 0.0 && largest < LARGEST_CORRECTION {
            // Upside down, where the sine of the tilt is small again, any axis leads out.
            return Self { x: LARGEST_CORRECTION, y: 0.0 };
        }
        let share = if largest > LARGEST_CORRECTION { LARGEST_CORRECTION / largest } else { 1.0 };
        Self { x: x * share, y: y * share }
    }

    /// Returns the orientation after the rotation of the world frame.
    pub(super) fn apply(self, orientation: Quaternion) -> Quaternion {
        let (x, y) = (0.5 * self.x, 0.5 * self.y);
        let turn = Quaternion { w: 1.0 - 0.5 * (x * x + y * y), x, y, z: 0.0 };
        turn.multiply(orientation).renormalised()
    }

    /// The rotation as a vector, rad, world frame.
    pub(super) const fn vector(self) -> Vec3 {
        Vec3::new(self.x, self.y, 0.0)
    }

    /// Returns a world-frame vector after the rotation, to first order.
    pub(super) fn turn(self, vector: Vec3) -> Vec3 {
        vector + self.vector().cross(vector)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::STANDARD_GRAVITY;

    const DT: f32 = 0.001;

    fn inclination() -> Inclination {
        Inclination::new(InclinationCoefficients::new(5.0))
    }

    #[test]
    fn a_correction_turns_the_force_towards_up() {
        let tilted = Vec3::new(1.0, -0.5, 9.7);
        let turned = Correction::upright(tilted).turn(tilted);
        assert!(turned.x.abs() < 0.02 && turned.y.abs() < 0.02, "{turned:?}");
    }

    #[test]
    fn time_constant_in_steady_motion_is_the_configured_one() {
        let mut inclination = inclination();
        let up = Vec3::new(0.0, 0.0, STANDARD_GRAVITY);
        for _ in 0..60_000 {
            inclination.grow_doubt(0.0, None, 0.0, DT);
            inclination.correct(up, 1.0, DT);
        }
        assert!((1.0 / inclination.doubt - 5.0).abs() < 0.05, "{inclination:?}");
    }

    #[test]
    fn clipping_raises_doubt_up_to_its_limit_and_never_lowers_it() {
        for (saturation, time_constant) in [
            (Saturation::Accelerometer, ACCELEROMETER_CLIPPED),
            (Saturation::Gyroscope, TURN_UNKNOWN),
        ] {
            let mut settled = inclination();
            settled.doubt = 0.2;
            for _ in 0..200 {
                settled.grow_doubt(0.0, Some(saturation), 0.0, DT);
            }
            assert!((1.0 / settled.doubt - time_constant).abs() < 0.01, "{settled:?}");
        }
        let mut fresh = inclination();
        fresh.grow_doubt(0.0, Some(Saturation::Both), 0.0, DT);
        assert_eq!(fresh.doubt, 1.0 / START_TIME_CONSTANT);
    }

    #[test]
    fn doubt_grows_with_the_uncertainty_of_the_turn() {
        let doubt_after = |spread_squared: f32| {
            let mut settled = inclination();
            settled.doubt = 0.2;
            settled.grow_doubt(0.0, None, spread_squared, DT);
            settled.doubt
        };
        let exact = doubt_after(0.0);
        assert!((doubt_after(0.01) - exact - 0.01).abs() < 1e-6);
        assert!((doubt_after(0.04) - exact - 0.04).abs() < 1e-6);
    }

    #[test]
    fn guessed_turn_leaves_more_doubt_than_motion_and_less_than_unknown() {
        let after = |change: fn(&mut Inclination)| {
            let mut settled = inclination();
            settled.doubt = 0.2;
            change(&mut settled);
            settled.doubt
        };
        let [guessed, lost] = [Inclination::doubt_guess, Inclination::lose].map(after);
        assert!(guessed > 2.0 * 0.2);
        assert!(2.0 * guessed < lost);
    }

    #[test]
    fn it_settles_in_quiet_and_not_before() {
        let mut inclination = inclination();
        let up = Vec3::new(0.0, 0.0, STANDARD_GRAVITY);
        let settled_at = |inclination: &mut Inclination, noise: f32| {
            (0..3_000).position(|_| {
                inclination.correct(up, noise, DT);
                inclination.has_settled()
            })
        };
        let quiet = settled_at(&mut inclination, 1.0 / 200.0).expect("quiet settles it");
        assert!((1..20).contains(&quiet), "{quiet} ms");
        let moving = settled_at(&mut self::inclination(), 1.0).expect("a mean settles it");
        assert!(moving > 990, "{moving} ms");
    }

    #[test]
    fn correction_turns_orientation_and_vectors_alike() {
        for (x, y) in [(0.1, 0.0), (0.0, -0.1), (0.15, 0.2)] {
            let up = Correction { x, y }.apply(Quaternion::IDENTITY).up();
            // World z, seen from a sensor that was turned by (x, y).
            assert!((up.y - libm::sinf(libm::hypotf(x, y)) * x / libm::hypotf(x, y)).abs() < 1e-3);
            assert!((up.x + libm::sinf(libm::hypotf(x, y)) * y / libm::hypotf(x, y)).abs() < 1e-3);
            assert!((up.length() - 1.0).abs() < 1e-4, "{up:?}");
        }
    }
}

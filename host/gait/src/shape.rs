//! Closed forms that make up a foot's motion.
//!
//! A [`Quintic`] carries a channel from one place to the next. [`Term`]s are added to it: the ringing after an impact,
//! a slide, a vibration. All of them are C² in time, except for the start of a [`TermShape::Ring`]. There the velocity
//! is continuous and the acceleration jumps, as in an impact.

use crate::jet::Jet;

/// The fifth-degree polynomial between two states: the path of least jerk that joins them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quintic {
    start: f64,
    duration: f64,
    /// Coefficients of the powers of (t − start)/duration, lowest first.
    coefficients: [f64; 6],
}

impl Quintic {
    /// Joins the state `from` at `start` to the state `to`, `duration` later; times in s.
    pub fn between(from: Jet, to: Jet, start: f64, duration: f64) -> Self {
        let (rate, curvature) = (from.rate * duration, from.acceleration * duration * duration);
        let half = 0.5 * curvature;
        // Contribution of the three upper terms at the end.
        let p = to.value - from.value - rate - half;
        let v = to.rate * duration - rate - curvature;
        let a = to.acceleration * duration * duration - curvature;
        Self {
            start,
            duration,
            coefficients: [
                from.value,
                rate,
                half,
                10.0 * p - 4.0 * v + 0.5 * a,
                -15.0 * p + 7.0 * v - a,
                6.0 * p - 3.0 * v + 0.5 * a,
            ],
        }
    }

    /// Stays at `value`.
    pub const fn rest(value: f64) -> Self {
        Self { start: 0.0, duration: 1.0, coefficients: [value, 0.0, 0.0, 0.0, 0.0, 0.0] }
    }

    /// Returns the state at time `t` in s, which lies between start and end.
    pub fn at(&self, t: f64) -> Jet {
        let s = Jet::moving((t - self.start) / self.duration, 1.0 / self.duration);
        self.coefficients.iter().rev().fold(Jet::default(), |sum, c| sum * s + Jet::constant(*c))
    }
}

/// Course of a [`Term`] over time.
#[derive(Clone, Copy, Debug)]
pub(crate) enum TermShape {
    /// Rises to `height` at half-time and falls back.
    Pulse {
        /// In the unit of the channel.
        height: f64,
    },
    /// A sine that swells and fades.
    Ripple {
        /// At half-time, in the unit of the channel.
        amplitude: f64,
        /// rad/s.
        angular_frequency: f64,
        /// At the start, rad.
        phase: f64,
    },
    /// A damped spring after an impact: begins at 0 with `speed`, and is at rest at the end.
    Ring {
        /// At the start, in the unit of the channel per s.
        speed: f64,
        /// Angular frequency of the damped oscillation, rad/s.
        angular_frequency: f64,
        /// Exponential decay, 1/s.
        decay: f64,
    },
    /// Runs from 0 to `distance` with least jerk, and stays there.
    Slide {
        /// In the unit of the channel.
        distance: f64,
    },
}

/// Contribution to one channel: 0 before its start, at rest after its end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Term {
    /// s.
    pub start: f64,
    /// s, positive.
    pub duration: f64,
    pub shape: TermShape,
}

impl Term {
    pub const fn new(start: f64, duration: f64, shape: TermShape) -> Self {
        Self { start, duration, shape }
    }

    /// Returns the contribution of the term at time `t` in s.
    pub fn at(&self, t: f64) -> Jet {
        if t < self.start {
            return Jet::default();
        }
        if t >= self.start + self.duration {
            return match self.shape {
                TermShape::Slide { distance } => Jet::constant(distance),
                TermShape::Pulse { .. } | TermShape::Ripple { .. } | TermShape::Ring { .. } => {
                    Jet::default()
                }
            };
        }
        let elapsed = Jet::moving(t - self.start, 1.0);
        let s = elapsed * (1.0 / self.duration);
        match self.shape {
            TermShape::Pulse { height } => pulse(s) * height,
            TermShape::Ripple { amplitude, angular_frequency, phase } => {
                let angle = elapsed * angular_frequency + Jet::constant(phase);
                pulse(s) * angle.sin_cos().0 * amplitude
            }
            TermShape::Ring { speed, angular_frequency, decay } => {
                // The cubic brings the exponential, which never ends, to exactly 0.
                let fade = (Jet::constant(1.0) - s).cubed();
                (elapsed * -decay).exp()
                    * (elapsed * angular_frequency).sin_cos().0
                    * fade
                    * (speed / angular_frequency)
            }
            TermShape::Slide { distance } => minimum_jerk(s) * distance,
        }
    }
}

/// 0 to 1 and back to 0 over s in [0, 1], with two derivatives that vanish at both ends.
fn pulse(s: Jet) -> Jet {
    (s * (Jet::constant(1.0) - s) * 4.0).cubed()
}

/// 0 to 1 over s in [0, 1], with two derivatives that vanish at both ends.
fn minimum_jerk(s: Jet) -> Jet {
    s.cubed() * (Jet::constant(10.0) - s * 15.0 + s * s * 6.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_same(actual: Jet, expected: Jet) {
        let difference = actual - expected;
        for part in [difference.value, difference.rate, difference.acceleration] {
            assert!(part.abs() < 1e-9, "{actual:?} is not {expected:?}");
        }
    }

    #[test]
    fn a_quintic_starts_and_ends_in_the_states_it_joins() {
        let from = Jet { value: 0.2, rate: -1.0, acceleration: 3.0 };
        let to = Jet { value: -0.1, rate: 0.5, acceleration: -7.0 };
        let path = Quintic::between(from, to, 2.0, 0.3);
        assert_same(path.at(2.0), from);
        assert_same(path.at(2.3), to);
    }

    #[test]
    fn every_shape_but_the_ring_begins_and_ends_at_rest() {
        let shapes = [
            (TermShape::Pulse { height: 0.05 }, 0.0),
            (TermShape::Ripple { amplitude: 1e-3, angular_frequency: 200.0, phase: 1.0 }, 0.0),
            (TermShape::Slide { distance: 0.04 }, 0.04),
        ];
        for (shape, end) in shapes {
            let term = Term { start: 1.0, duration: 0.25, shape };
            assert_same(term.at(1.0), Jet::default());
            assert_same(term.at(1.25 - 1e-15), Jet::constant(end));
            assert_eq!(term.at(1.25), Jet::constant(end));
        }
    }

    #[test]
    fn a_ring_takes_over_the_speed_of_the_impact_and_ends_at_rest() {
        let term = Term {
            start: 1.0,
            duration: 0.1,
            shape: TermShape::Ring { speed: -0.5, angular_frequency: 380.0, decay: 120.0 },
        };
        let hit = term.at(1.0);
        assert_eq!((hit.value, hit.rate), (0.0, -0.5));
        assert!((hit.acceleration - 0.5 * (2.0 * 120.0 + 3.0 * 2.0 / 0.1)).abs() < 1e-9);
        assert_same(term.at(1.1 - 1e-13), Jet::default());
    }
}

//! Constants of the self-calibrating estimate: the same for all feet, sensors and rates.

use crate::range::{ParamsError, in_range, name};

/// Defines the constants, each with its default and the range in which it may be tried.
macro_rules! constants {
    ($($(#[$about:meta])* $constant:ident = $default:literal, $least:literal to $most:literal;)*) => {
        /// Constants of the self-calibrating estimate. Values other than [`Self::DEFAULT`] are only for research:
        /// [`Self::with`] makes them.
        ///
        /// `docs/design/method.md` has the equations. `docs/design/choosing.md` describes how the values were chosen: by
        /// the mean RMSE of P over robots, with terms for stances lost and for moving feet that are called stable.
        /// Halving or doubling most of them changes the mean by less than 0.005.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Constants {
            $($(#[$about])* pub(crate) $constant: f32,)*
        }

        impl Constants {
            /// For any foot; each field states its default and the reason.
            pub const DEFAULT: Self = Self { $($constant: $default,)* };

            /// Names and values of all constants.
            pub fn iter(&self) -> impl Iterator<Item = (&'static str, f32)> + use<> {
                [$((stringify!($constant), self.$constant)),*].into_iter()
            }

            /// Names and ranges of all constants.
            pub fn ranges() -> impl Iterator<Item = (&'static str, f32, f32)> {
                [$((stringify!($constant), $least, $most)),*].into_iter()
            }

            /// Returns the same constants, with another value of the constant that has this name.
            ///
            /// # Errors
            /// No constant has the name, or the value is out of its range.
            pub fn with(mut self, constant: &str, value: f32) -> Result<Self, ParamsError> {
                match constant {
                    $(stringify!($constant) => {
                        in_range(name(stringify!($constant)), value, $least, $most)?;
                        self.$constant = value;
                    })*
                    _ => return Err(ParamsError::UnknownConstant),
                }
                Ok(self)
            }
        }
    };
}

constants! {
    /// Amplitude that is added to every acceleration, m/s²: u = ½ ln(|a|² + noise²).
    ///
    /// Amplitudes below this value look the same. It lies above the noise of an LSM6DSOX (0.04 over its three axes)
    /// and below the stances of real feet (0.3 to 3). Default: 0.17; flat from 0.1 to 0.25.
    noise = 0.17, 0.001 to 10.0;
    /// Amplitude of the acceleration in stances before any is observed, m/s². Default: 3.0.
    still = 3.0, 0.01 to 400.0;
    /// Amplitude of the acceleration in swings before any is observed, m/s².
    ///
    /// Default: 9.5; the swings of a GO1 have 23, those of TALOS 2.7.
    moving = 9.5, 0.01 to 400.0;
    /// Height of the edge of stillness, as a part of the way from stillness to motion:
    /// edge = still + part · (moving − still), all of them logarithms.
    ///
    /// The edge of the turn divides its own way in the same proportion. A lower edge loses stances, a
    /// higher one misses slips. Default: 0.66; with 0.6 stances of a GO1 are lost, with 0.68 slips are
    /// missed.
    part_of_the_way = 0.66, 0.0 to 1.0;
    /// Standard deviation h of the kernel, of the logarithm of the amplitude: mass = Φ((edge − u)/h).
    ///
    /// With 0.3 or more, P stays near ½ and decisions flicker. Default: 0.12; flat from 0.05 to 0.25.
    bandwidth = 0.12, 0.001 to 10.0;
    /// Time constant τ of most means, and of the speed along the ground, s.
    ///
    /// A longer time delays the decision. Default: 26 ms; flat from 15 to 33.
    window = 0.026, 0.001 to 1.0;
    /// Weight of the values before any observation, s of stance or swing.
    ///
    /// Default: 0.06, so that a tenth of a step outweighs it. With 0.2 a slide follows the first stance unseen.
    prior = 0.06, 0.001 to 10.0;
    /// Longest time that learnt values are based on, s of stance or swing.
    ///
    /// A longer time forgets another robot, gait or stuck axis more slowly. Default: 1.5, which forgets the walk of
    /// a stuck axis of the accelerometer within ten steps; flat up to 5.
    memory = 1.5, 0.01 to 1000.0;
    /// Duration of the shortest stance, s.
    ///
    /// Only this much of each stance teaches the classes and the usual speed, because a foot that stands for a minute
    /// would otherwise expect every stance to be as quiet. A rest lasts longer. Default: 0.2, shorter than the
    /// stances of a trot.
    stance = 0.2, 0.01 to 10.0;

    /// Rate of turn that is added to every rate, rad/s: v = ½ ln(|ω|² + `turn_noise`²).
    ///
    /// Turns below this rate look the same, and the mean of a foot at rest lies below it. It lies above the bias of a
    /// gyroscope that has not rested yet (0.02). Default: 0.05.
    turn_noise = 0.05, 0.001 to 10.0;
    /// Weight of the turn relative to the acceleration, if both separate stances from swings equally well.
    ///
    /// With 0 only the acceleration decides. Default: 1.5; `docs/design/parts.md` has its gain and its cost.
    turn_weight = 1.5, 0.0 to 100.0;
    /// Largest distance from the edge that counts, of the acceleration and of the turn, as a part of the
    /// distance between their classes.
    ///
    /// Without the limit one large acceleration would overrule the turn, or the reverse. Default: 0.5.
    turn_clip = 0.5, 0.0 to 10.0;
    /// Mean mass of the acceleration above which a quiet turn no longer excuses a large acceleration in this stance.
    ///
    /// Default: 0.9. If a quiet turn always excuses, more of the simulated slips are missed: 14.7 % instead of 10.8 %.
    turn_settled = 0.9, 0.0 to 1.0;

    /// Largest acceleration that counts in the speed along the ground, m/s².
    ///
    /// Larger accelerations are left to the classes, because landings would otherwise count as slides. Default: 0.48.
    slide_acceleration = 0.48, 0.0 to 100.0;
    /// Speed along the ground in stances before any is observed, m/s.
    ///
    /// Default: 0.01, with which no slide is reported before the first stance.
    slide_speed = 0.01, 1.0e-5 to 1.0;
    /// Speed of a slide as a multiple of the usual speed in stances, for a robot whose usual speed is 0.1 ms times the
    /// acceleration of its swings.
    ///
    /// Default: 1.45. With 1.5 more than 11 % of the simulated slips are missed; with less a runner's stances count as
    /// slips.
    slide_factor = 1.45, 0.01 to 100.0;
    /// Speed of a foot that rolls, over its angular rate, m: the height of the IMU above the sole.
    ///
    /// Default: 0.046. Without it a GO1, a NAO and a shoe lose their stances.
    slide_lever = 0.046, 0.0 to 10.0;

    /// Largest mean acceleration at rest, m/s².
    ///
    /// Default: 0.2. With 0.16 no recorded set changes by more than 0.0015, with 0.1 the mean over seven sets rises by 0.002;
    /// with 0.3 a NAO has 0.005 more.
    rest_acceleration = 0.2, 0.0 to 100.0;
    /// Largest change of the mean acceleration within a stance at rest, m/s².
    ///
    /// Default: 0.12. With 0.15 a sway of 0.3 m/s² at 0.8 Hz passes for rest.
    rest_acceleration_change = 0.12, 0.0 to 100.0;
    /// Largest change of the mean angular rate within a stance at rest, rad/s.
    ///
    /// Default: 0.015. With 0.03 a boat is stable for 66 % of the time. The recorded sets hardly depend on it: with 0.01 and
    /// 0.03 none changes by more than 0.0015.
    rest_rate_change = 0.015, 0.0 to 100.0;
    /// Fall of the logarithm of the acceleration from a swing to the stance after it that counts as a landing.
    ///
    /// Default: 1.5, a factor of 4.5. With 1.4 to 1.45 a pendulum after a walk is stable for 18 to 30 % of the time.
    landing = 1.5, 0.1 to 10.0;
    /// Largest change of speed from one landing to the next, as a part of the sum of all changes: |Σ a| < leftover · Σ
    /// |a|.
    ///
    /// A real swing loses the speed that it gained; most end with less than half of it. A shaken foot is fastest where
    /// its acceleration falls. Default: 0.8.
    leftover = 0.8, 0.0 to 10.0;
    /// Time for which a landing or a rest is evidence of a standing foot, and for which a swing may precede a landing,
    /// s.
    ///
    /// This time is longer than a stride. After a walk a hanging foot is reported stable for at most twice as long.
    /// Default: 1.75.
    evidence = 1.75, 0.01 to 1000.0;
}

impl Constants {
    /// Upper end of stillness, for classes of these mean logarithms of the amplitude.
    pub(crate) fn edge(&self, still: f32, moving: f32) -> f32 {
        still + self.part_of_the_way * (moving - still)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_constant_is_set_alone_by_its_name() {
        for (changed, least, most) in Constants::ranges() {
            for value in [least, most] {
                let constants = Constants::DEFAULT.with(changed, value).expect(changed);
                for ((name, now), (_, before)) in constants.iter().zip(Constants::DEFAULT.iter()) {
                    assert_eq!(
                        now,
                        if name == changed { value } else { before },
                        "{changed}, {name}"
                    );
                }
            }
        }
    }

    #[test]
    fn value_out_of_range_is_rejected_by_name() {
        for (constant, least, most) in Constants::ranges() {
            for value in [least.next_down(), most.next_up(), f32::NAN] {
                let error = Constants::DEFAULT.with(constant, value).unwrap_err();
                let ParamsError::OutOfRange { field, .. } = error else {
                    panic!("{constant}: {error}");
                };
                assert_eq!(field, constant);
            }
        }
        let unknown = Constants::DEFAULT.with("half_width", 0.1);
        assert_eq!(unknown, Err(ParamsError::UnknownConstant));
    }

    #[test]
    fn defaults_are_within_their_ranges() {
        for (constant, value) in Constants::DEFAULT.iter() {
            assert_eq!(Constants::DEFAULT.with(constant, value), Ok(Constants::DEFAULT));
        }
    }
}

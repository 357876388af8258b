//! Constants of the self-calibrating estimate: the same for all feet, sensors and rates.

/// Constants of the self-calibrating estimate. Values other than [`Self::DEFAULT`] are only for research.
///
/// `docs/design/method.md` has the equations. `docs/design/choosing.md` describes how the values were chosen: by the
/// mean RMSE of P over robots, with terms for stances lost and for moving feet that are called stable. Halving or
/// doubling most of them changes the mean by less than 0.005.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constants {
    /// Amplitude that is added to every acceleration, m/s²: u = ½ ln(|a|² + noise²).
    ///
    /// Amplitudes below it look the same. It lies above the noise of an LSM6DSOX (0.04 over its three axes) and below
    /// the stances of real feet (0.3 to 3). Default: 0.17; flat from 0.1 to 0.25.
    pub noise: f32,
    /// Amplitude of the acceleration in stances before any is observed, m/s². Default: 3.0.
    pub still: f32,
    /// Amplitude of the acceleration in swings before any is observed, m/s².
    ///
    /// Default: 9.5; the swings of a GO1 have 23, those of TALOS 2.7.
    pub moving: f32,
    /// Height of the edge of stillness, as a part of the way from stillness to motion:
    /// edge = still + part · (moving − still), all of them logarithms.
    ///
    /// A lower edge loses stances, a higher one misses slips. Default: 0.66; with 0.6 stances of a GO1 are lost, with
    /// 0.68 slips are missed.
    pub part_of_the_way: f32,
    /// Standard deviation h of the kernel, of the logarithm of the amplitude: mass = Φ((edge − u)/h).
    ///
    /// With 0.3 or more, P stays near ½ and decisions flicker. Default: 0.12; flat from 0.05 to 0.25.
    pub bandwidth: f32,
    /// Time constant τ of all means, and of the speed along the ground, s.
    ///
    /// A longer one delays the decision. Default: 26 ms; flat from 15 to 33.
    pub window: f32,
    /// Weight of the values before any observation, s of stance or swing.
    ///
    /// Default: 0.06, so that a tenth of a step outweighs it. With 0.2 a slide follows the first stance unseen.
    pub prior: f32,
    /// Longest time that learnt values are based on, s of stance or swing.
    ///
    /// A longer one forgets another robot, gait or stuck axis more slowly. Default: 1.5, which forgets the walk of a
    /// stuck axis within ten steps; flat up to 5.
    pub memory: f32,
    /// Duration of the shortest stance, s.
    ///
    /// Only this much of each stance teaches the classes and the usual speed: a foot that stands for a minute would
    /// otherwise take its own quiet for that of all stances. A rest lasts longer. Default: 0.2, shorter than the
    /// stances of a trot.
    pub stance: f32,
    /// Time after a landing in which the whole stance teaches the classes, s.
    ///
    /// Default: 0.4. With 0.3 the limits of a stuck axis stay for longer. Without it a GO1 that stood after a walk
    /// loses stances.
    pub lesson: f32,

    /// Rate of turn that is added to every rate, rad/s: v = ½ ln(|ω|² + `turn_noise`²).
    ///
    /// Turns below it look the same. It lies above the bias of a gyroscope that has not rested yet (0.02). Default:
    /// 0.05.
    pub turn_noise: f32,
    /// Rate of turn in stances before any is observed, rad/s. Default: 0.3.
    pub turn_still: f32,
    /// Rate of turn in swings before any is observed, rad/s. Default: 2.0.
    pub turn_moving: f32,
    /// Height of the edge of the turn, as a part of the way from that of stances to that of swings. Default: 0.66.
    pub turn_part: f32,
    /// Weight of the turn relative to the acceleration, if both separate stances from swings equally well.
    ///
    /// With 0 only the acceleration decides. Default: 1.5; `docs/design/parts.md` has its gain and its cost.
    pub turn_weight: f32,
    /// Largest distance of acceleration and turn from their edges that counts, as a part of the distance of their
    /// classes.
    ///
    /// Without it a single large value would decide against the other. Default: 0.5.
    pub turn_clip: f32,
    /// Mean mass of the acceleration above which a quiet turn no longer excuses a large acceleration in this stance.
    ///
    /// Default: 0.9. Without it 14.6 % of the simulated slips are missed.
    pub turn_settled: f32,

    /// Largest acceleration that counts in the speed along the ground, m/s².
    ///
    /// The classes judge larger accelerations. Without this limit landings count as slides. Default: 0.48.
    pub slide_acceleration: f32,
    /// Speed along the ground in stances before any is observed, m/s.
    ///
    /// Default: 0.01, with which no slide is reported before the first stance.
    pub slide_speed: f32,
    /// Speed of a slide as a multiple of the usual speed in stances, for a robot whose usual speed is 0.1 ms times the
    /// acceleration of its swings.
    ///
    /// Default: 1.45. With 1.5 more than 11 % of the simulated slips are missed; with less a runner's stances count as
    /// slips.
    pub slide_factor: f32,
    /// Speed of a foot that rolls, over its angular rate, m: the height of the IMU above the sole.
    ///
    /// Default: 0.046. Without it a GO1, a NAO and a shoe lose their stances.
    pub slide_lever: f32,

    /// Largest mean acceleration at rest, m/s². Default: 0.2; with 0.16 the RMSE of a GO1 rises by 0.005.
    pub rest_acceleration: f32,
    /// Largest change of the mean acceleration within a stance at rest, m/s².
    ///
    /// Default: 0.12. With 0.15 a sway of 0.3 m/s² at 0.8 Hz passes for rest.
    pub rest_acceleration_change: f32,
    /// Largest mean angular rate at rest, rad/s. Default: 0.05.
    pub rest_rate: f32,
    /// Largest change of the mean angular rate within a stance at rest, rad/s.
    ///
    /// Default: 0.015. With 0.03 a boat is stable for 66 % of the time; with 0.01 the RMSE of walks that begin in their
    /// middle rises by 0.005.
    pub rest_rate_change: f32,
    /// Fall of the logarithm of the acceleration from a swing to the stance after it that counts as a landing.
    ///
    /// Default: 1.5, a factor of 4.5. With 1.4 to 1.45 a pendulum after a walk is stable for 18 to 30 % of the time.
    pub landing: f32,
    /// Largest change of speed from one landing to the next, as a part of the sum of all changes: |Σ a| < leftover · Σ
    /// |a|.
    ///
    /// A real swing loses the speed that it gained; most end with less than half of it. A shaken foot is fastest where
    /// its acceleration falls. Default: 0.8.
    pub leftover: f32,
    /// Time for which a landing or a rest is evidence of a standing foot, and for which a swing may precede a landing,
    /// s.
    ///
    /// It is longer than a stride. After a walk a hanging foot is reported stable for at most twice as long. Default:
    /// 1.75.
    pub evidence: f32,
}

impl Constants {
    /// For any foot; each field states its default and the reason.
    pub const DEFAULT: Self = Self {
        noise: 0.17,
        still: 3.0,
        moving: 9.5,
        part_of_the_way: 0.66,
        bandwidth: 0.12,
        window: 0.026,
        prior: 0.06,
        memory: 1.5,
        stance: 0.2,
        lesson: 0.4,
        turn_noise: 0.05,
        turn_still: 0.3,
        turn_moving: 2.0,
        turn_part: 0.66,
        turn_weight: 1.5,
        turn_clip: 0.5,
        turn_settled: 0.9,
        slide_acceleration: 0.48,
        slide_speed: 0.01,
        slide_factor: 1.45,
        slide_lever: 0.046,
        rest_acceleration: 0.2,
        rest_acceleration_change: 0.12,
        rest_rate: 0.05,
        rest_rate_change: 0.015,
        landing: 1.5,
        leftover: 0.8,
        evidence: 1.75,
    };

    /// Upper end of stillness, for classes of these mean logarithms of the amplitude.
    pub(crate) fn edge(&self, still: f32, moving: f32) -> f32 {
        still + self.part_of_the_way * (moving - still)
    }
}

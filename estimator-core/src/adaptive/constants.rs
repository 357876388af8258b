//! Constants of the self-calibrating estimate: the same for all feet, sensors and rates.

/// Constants of the estimate. How each was chosen stands in `docs/choosing.md`; others than
/// [`Self::DEFAULT`] are for research alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constants {
    /// Amplitude below which stillness is not told apart, m/s²: noise of sensors, trembling of robots.
    pub noise: f32,
    /// Amplitude of the acceleration in stances, before any is observed, m/s².
    pub still: f32,
    /// Amplitude of the acceleration in swings, before any is observed, m/s².
    pub moving: f32,
    /// Mean deviation of the logarithm of the amplitude in stances, before any is observed.
    pub width: f32,
    /// Height of the edge of stillness above its mean, in widths.
    pub widths: f32,
    /// Largest height of the edge, as a part of the way from stillness to motion.
    pub part_of_the_way: f32,
    /// Standard deviation of the kernel, of the logarithm of the amplitude.
    pub bandwidth: f32,
    /// Time constant of the mean mass, s.
    pub window: f32,
    /// Weight of the values before any observation, s of stance or swing.
    pub prior: f32,
    /// Longest time that learnt values rest on, s of stance or swing.
    pub memory: f32,
    /// Time from the beginning of each stance that is learnt from, s.
    pub stance: f32,

    /// Time constant of the speed along the ground, s.
    pub slide_time_constant: f32,
    /// Largest acceleration in the speed, m/s².
    pub slide_acceleration: f32,
    /// Speed in stances, before any is observed, m/s.
    pub slide_speed: f32,
    /// Speed of a slide over that of the foot's stances, where that is [`Self::slide_quiet`] times the swing's
    /// acceleration.
    pub slide_factor: f32,
    /// Exponent with which the factor grows with the speed in stances.
    pub slide_growth: f32,
    /// Weight of a stance's speeds above the learnt one, over that of speeds below.
    pub slide_upwards: f32,
    /// Speed of a foot that rolls, over its angular rate, m.
    pub slide_lever: f32,

    /// Time for which a foot has to rest, s.
    pub rest: f32,
    /// Largest acceleration at rest, m/s².
    pub rest_acceleration: f32,
    /// Largest angular rate at rest, rad/s.
    pub rest_rate: f32,
    /// Time constant of the means that rest and calm are judged by, s.
    pub evidence_time_constant: f32,
    /// Fall of the logarithm of the acceleration from a swing to the stance after it.
    pub landing: f32,
    /// Longest time from the swing to the stance, s.
    pub landing_time: f32,
    /// Largest fall of the logarithm of a swing's acceleration below the mean of swings.
    pub swing: f32,
    /// Time after a landing or rest for which they are evidence, s.
    pub evidence_lasts: f32,
}

impl Constants {
    /// Of any foot.
    pub const DEFAULT: Self = Self {
        noise: 0.18,
        still: 2.8,
        moving: 9.3,
        width: 0.29,
        widths: 2.0,
        part_of_the_way: 0.644,
        bandwidth: 0.122,
        window: 0.0256,
        prior: 0.071,
        memory: 10.0,
        stance: 0.23,
        slide_time_constant: 0.028,
        slide_acceleration: 0.584,
        slide_speed: 0.0108,
        slide_factor: 2.84,
        slide_growth: 0.615,
        slide_upwards: 0.466,
        slide_lever: 0.051,
        rest: 0.2,
        rest_acceleration: 0.2,
        rest_rate: 0.05,
        evidence_time_constant: 0.023,
        landing: 1.52,
        landing_time: 1.13,
        swing: 0.89,
        evidence_lasts: 1.79,
    };
}

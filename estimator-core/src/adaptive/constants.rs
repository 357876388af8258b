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
    /// Time constant of all means, and of the speed along the ground, s.
    pub window: f32,
    /// Weight of the values before any observation, s of stance or swing.
    pub prior: f32,
    /// Longest time that learnt values rest on, s of stance or swing.
    pub memory: f32,
    /// Shortest stance, s: only so much of each is learnt from, and a rest is no shorter.
    pub stance: f32,

    /// Largest acceleration in the speed along the ground, m/s².
    pub slide_acceleration: f32,
    /// That speed in stances, before any is observed, m/s.
    pub slide_speed: f32,
    /// Speed of a slide over the usual speed in stances, for a robot whose usual speed is 0.1 ms times the acceleration
    /// of its swings.
    pub slide_factor: f32,
    /// Weight of speeds above the usual one, over that of speeds below.
    pub slide_upwards: f32,
    /// Weight of the speed of a slide, over that of a stance.
    pub slide_teaches: f32,
    /// Speed of a foot that rolls, over its angular rate, m.
    pub slide_lever: f32,

    /// Largest acceleration at rest, m/s².
    pub rest_acceleration: f32,
    /// Largest angular rate at rest, rad/s.
    pub rest_rate: f32,
    /// Fall of the logarithm of the acceleration from a swing to the stance after it.
    pub landing: f32,
    /// Time for which a swing may precede a landing, and a landing or rest is evidence, s.
    pub evidence: f32,
}

impl Constants {
    /// For any foot.
    pub const DEFAULT: Self = Self {
        noise: 0.17,
        still: 3.0,
        moving: 9.5,
        width: 0.28,
        widths: 2.0,
        part_of_the_way: 0.64,
        bandwidth: 0.12,
        window: 0.026,
        prior: 0.06,
        memory: 1.5,
        stance: 0.2,
        slide_acceleration: 0.48,
        slide_speed: 0.01,
        slide_factor: 2.7,
        slide_upwards: 0.55,
        slide_teaches: 0.35,
        slide_lever: 0.046,
        rest_acceleration: 0.2,
        rest_rate: 0.05,
        landing: 1.5,
        evidence: 1.75,
    };
}

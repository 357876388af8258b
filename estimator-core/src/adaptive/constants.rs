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
    /// Height of the edge of stillness, as a part of the way from stillness to motion.
    pub part_of_the_way: f32,
    /// Standard deviation of the kernel, of the logarithm of the amplitude.
    pub bandwidth: f32,
    /// Time constant of all means, and of the speed along the ground, s.
    pub window: f32,
    /// Weight of the values before any observation, s of stance or swing.
    pub prior: f32,
    /// Longest time that learnt values rest on, s of stance or swing.
    pub memory: f32,
    /// Shortest stance, s: as much of each teaches the usual speed, and a rest is longer.
    pub stance: f32,
    /// Time after a landing that teaches the classes, s.
    pub lesson: f32,

    /// Largest acceleration in the speed along the ground, m/s².
    pub slide_acceleration: f32,
    /// That speed in stances, before any is observed, m/s.
    pub slide_speed: f32,
    /// Speed of a slide over the usual speed in stances, for a robot whose usual speed is 0.1 ms times the acceleration
    /// of its swings.
    pub slide_factor: f32,
    /// Speed of a foot that rolls, over its angular rate, m.
    pub slide_lever: f32,

    /// Largest acceleration at rest, m/s².
    pub rest_acceleration: f32,
    /// Largest change of it within a stance, m/s².
    pub rest_acceleration_change: f32,
    /// Largest angular rate at rest, rad/s.
    pub rest_rate: f32,
    /// Largest change of it within a stance, rad/s.
    pub rest_rate_change: f32,
    /// Fall of the logarithm of the acceleration from a swing to the stance after it.
    pub landing: f32,
    /// Largest change of speed from one landing to the next, as a part of the sum of all changes of it.
    pub leftover: f32,
    /// Time for which a swing may precede a landing, and a landing or rest is evidence, s.
    pub evidence: f32,
}

impl Constants {
    /// For any foot.
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
        lesson: 0.5,
        slide_acceleration: 0.48,
        slide_speed: 0.01,
        slide_factor: 1.5,
        slide_lever: 0.046,
        rest_acceleration: 0.2,
        rest_acceleration_change: 0.12,
        rest_rate: 0.05,
        rest_rate_change: 0.015,
        landing: 1.5,
        leftover: 0.8,
        evidence: 1.75,
    };
}

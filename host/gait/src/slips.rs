//! A grid of slips: walks in which every other stance slides, over gaits, speeds, floors, headings
//! and vibrations.

use crate::plan::{GaitName, Ground, Plan};
use crate::record::{Simulation, simulate};
use crate::sensor::SensorParams;
use crate::step::Slip;

/// Friction of the floor, as felt by the foot besides the slide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Friction {
    /// Negligible friction: the foot glides.
    Ice,
    /// A film of oil or water: slight, uneven drag.
    Wet,
    /// Rubber beyond its grip: stick-slip.
    Rubber,
}

impl Friction {
    /// All kinds of floor.
    pub const ALL: [Self; 3] = [Self::Ice, Self::Wet, Self::Rubber];

    /// Amplitude of stick-slip, m/s².
    const fn chatter(self) -> f64 {
        match self {
            Self::Ice => 0.0,
            Self::Wet => 1.0,
            Self::Rubber => 5.0,
        }
    }
}

/// Vibration of the standing foot caused by the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vibration {
    /// As the gait has it: 7 to 14 Hz, up to 0.08 m/s² and 0.008 rad/s.
    Usual,
    /// Three times the frequency at the same speed, and so three times the acceleration. At the usual frequency
    /// that would move the foot faster than [`SPEED_LIMIT`](crate::label::SPEED_LIMIT), which is not a good
    /// stance.
    Strong,
}

/// Point of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// Gait of the robot.
    pub gait: GaitName,
    /// Top speed of each slide, m/s.
    pub speed: f64,
    /// Friction of the floor.
    pub friction: Friction,
    /// Direction of the slide, counter-clockwise from forward, quarter turns.
    pub heading: u8,
    /// Vibration of the standing foot.
    pub vibration: Vibration,
}

/// Sensor that records the walks.
pub const SENSOR: SensorParams = SensorParams::LSM6DSOX_WARMING;

/// Top speeds of the slides, m/s: from twice [`SPEED_LIMIT`](crate::label::SPEED_LIMIT), a creep, to a foot that
/// has lost its grip.
pub const SPEEDS: [f64; 5] = [0.01, 0.02, 0.05, 0.15, 0.40];

/// All profiles.
pub fn profiles() -> impl Iterator<Item = Profile> {
    let gaits = [GaitName::Walk, GaitName::Trot];
    gaits.into_iter().flat_map(|gait| {
        SPEEDS.into_iter().flat_map(move |speed| {
            Friction::ALL.into_iter().flat_map(move |friction| {
                (0..4).flat_map(move |heading| {
                    [Vibration::Usual, Vibration::Strong].map(|vibration| Profile {
                        gait,
                        speed,
                        friction,
                        heading,
                        vibration,
                    })
                })
            })
        })
    })
}

impl Profile {
    /// Plans a walk in which every other stance slips: from 45 % of the stance on, alternately for 15 % and for
    /// half of it.
    #[must_use]
    pub fn plan(&self, seconds: f64, seed: u64) -> Plan {
        let mut plan = Plan::steady(self.gait, Ground::Hard, seconds, seed);
        for (index, step) in plan.steps.iter_mut().enumerate() {
            if self.vibration == Vibration::Strong {
                step.tremor.frequency *= 3.0;
                step.tremor.acceleration *= 3.0;
                step.tremor.rate *= 3.0;
            }
            if index % 2 == 1 {
                let duration = [0.15, 0.5][index / 2 % 2] * step.stance;
                step.slips = vec![Slip {
                    onset: 0.45 * step.stance,
                    duration,
                    distance: self.speed * duration / 1.875,
                    heading: f64::from(self.heading) * std::f64::consts::FRAC_PI_2,
                    twist: 0.0,
                    chatter: self.friction.chatter(),
                    chatter_frequency: 35.0 + 7.0 * (index % 5) as f64,
                }];
            }
        }
        plan
    }

    /// Simulates [`Self::plan`] as recorded by the foot's sensor.
    #[must_use]
    pub fn simulate(&self, seconds: f64, seed: u64) -> Simulation {
        simulate(&self.plan(seconds, seed), &SENSOR, seed)
    }
}

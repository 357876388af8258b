//! A grid of slips: walks in which every other stance slides, over gaits, speeds, floors, headings
//! and vibrations.

use crate::plan::{GaitName, Ground, Plan, Slip};
use crate::record::{Simulation, simulate};
use crate::sensor::SensorParams;

/// Point of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipProfile {
    /// Gait of the robot.
    pub gait: GaitName,
    /// Top speed of each slide, m/s.
    pub speed: f64,
    /// Amplitude of stick-slip, m/s².
    pub chatter: f64,
    /// Direction of the slide, counter-clockwise from forward, quarter turns.
    pub heading: u8,
    /// Factor of both the frequency and the acceleration of the vibration that the standing foot has in the gait. If only
    /// the acceleration were three times as large, the foot would move faster than
    /// [`SPEED_LIMIT`](crate::label::SPEED_LIMIT), and its stance would not be good.
    pub vibration: f64,
}

/// Sensor that records the walks.
pub const SENSOR: SensorParams = SensorParams::LSM6DSOX_WARMING;

/// Top speeds of the slides, m/s: from twice [`SPEED_LIMIT`](crate::label::SPEED_LIMIT), a creep, to a foot that
/// has lost its grip.
pub const SPEEDS: [f64; 5] = [0.01, 0.02, 0.05, 0.15, 0.40];

/// Amplitudes of stick-slip, m/s²: ice; a film of oil or water; rubber beyond its grip.
const CHATTERS: [f64; 3] = [0.0, 1.0, 5.0];

/// All profiles.
pub fn profiles() -> impl Iterator<Item = SlipProfile> {
    (0..240_usize).map(|k| SlipProfile {
        gait: [GaitName::Walk, GaitName::Trot][k / 120],
        speed: SPEEDS[k / 24 % 5],
        chatter: CHATTERS[k / 8 % 3],
        heading: (k / 2 % 4) as u8,
        vibration: [1.0, 3.0][k % 2],
    })
}

impl SlipProfile {
    /// Plans a walk in which every other stance slips: from 45 % of the stance on, alternately for 15 % and for
    /// half of it.
    #[must_use]
    pub fn plan(&self, seconds: f64, seed: u64) -> Plan {
        let mut plan = Plan::steady(self.gait, Ground::Hard, seconds, seed);
        for (index, step) in plan.steps.iter_mut().enumerate() {
            step.tremor.frequency *= self.vibration;
            step.tremor.acceleration *= self.vibration;
            step.tremor.rate *= self.vibration;
            if index % 2 == 1 {
                let duration = [0.15, 0.5][index / 2 % 2] * step.stance;
                step.slips = vec![Slip {
                    onset: 0.45 * step.stance,
                    duration,
                    distance: self.speed * duration / 1.875,
                    heading: f64::from(self.heading) * std::f64::consts::FRAC_PI_2,
                    twist: 0.0,
                    chatter: self.chatter,
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
